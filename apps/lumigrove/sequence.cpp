#include "sequence.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <regex>

#include "lumigrove/error.h"

namespace lumigrove {
namespace {

constexpr int kMaxFrames = 1000000;

[[noreturn]] void refuse_frames(const std::string& text) {
  throw Error(
      fmt::format("--frames is '{}', but must be A, A-B or A-BxS with whole numbers A <= B and S >= 1, "
                  "at most {} frames",
                  text, kMaxFrames));
}

int number(const std::string& digits, const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) refuse_frames(text);
  return value;
}

}  // namespace

std::vector<int> parse_frames(const std::string& text) {
  static const std::regex kRange("([0-9]+)(?:-([0-9]+)(?:x([0-9]+))?)?");
  std::smatch match;
  if (!std::regex_match(text, match, kRange)) refuse_frames(text);
  const std::int64_t first = number(match[1], text);
  const std::int64_t last = match[2].matched ? number(match[2], text) : first;
  const std::int64_t step = match[3].matched ? number(match[3], text) : 1;
  if (last < first || step < 1 || (last - first) / step >= kMaxFrames) refuse_frames(text);
  std::vector<int> frames;
  for (std::int64_t frame = first; frame <= last; frame += step) frames.push_back(static_cast<int>(frame));
  return frames;
}

std::string frame_file(const std::string& pattern, int frame) {
  static const std::regex kPlace("#+|%(?:0[1-9])?d");
  const std::filesystem::path path(pattern);
  const std::string name = path.filename().string();  // folders may contain anything
  std::smatch match;
  if (!std::regex_search(name, match, kPlace)) {
    if (name.find('%') != std::string::npos)
      throw Error(fmt::format("output '{}': only %d and %0Nd stand for the frame number", pattern));
    const std::string numbered =
        fmt::format("{}.{:04}{}", path.stem().string(), frame, path.extension().string());
    return (path.parent_path() / numbered).string();
  }
  if (match.suffix().str().find_first_of("#%") != std::string::npos ||
      match.prefix().str().find('%') != std::string::npos)
    throw Error(fmt::format("output '{}' has more than one place for the frame number", pattern));
  const std::string place = match.str();
  std::string digits;
  if (place[0] == '#')
    digits = fmt::format("{:0{}}", frame, place.size());
  else if (place == "%d")
    digits = std::to_string(frame);
  else
    digits = fmt::format("{:0{}}", frame, place[2] - '0');
  return (path.parent_path() / (match.prefix().str() + digits + match.suffix().str())).string();
}

}  // namespace lumigrove
