// Frame ranges and the file names of sequences.
#pragma once

#include <string>
#include <vector>

namespace lumigrove {

// "7", "0-47" or "0-47x2" (every second one) -> frame numbers. Throws Error for anything else.
std::vector<int> parse_frames(const std::string& text);

// Puts the frame number into a file name: a run of '#' is replaced by as many digits (out.####.exr), %d or
// %04d as by printf; a name with neither gets ".0007" before its extension. Throws Error for two places or
// another '%'.
std::string frame_file(const std::string& pattern, int frame);

}  // namespace lumigrove
