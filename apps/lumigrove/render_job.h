// Rendering as the commands do it: progress, Ctrl-C, a receipt in the image, files.
#pragma once

#include <string>
#include <vector>

#include "frame/receipt.h"
#include "interrupt.h"
#include "lumigrove/renderer.h"
#include "progress.h"

namespace lumigrove {

// load_scene and set_environment (unless empty), with times and warnings in the log.
Scene open_scene(const std::string& name, const std::string& environment);

// Renders one frame; a signal caught by `guard` ends it after the samples that are finished. The image
// carries the receipt, which is completed. `history`: of the frames of a sequence.
Image render_frame(const Scene& scene, const Settings& settings, Receipt& receipt, ProgressPrinter& progress,
                   const InterruptGuard& guard, History* history = nullptr);

// Writes the image to every file and says so on stdout unless `quiet`.
void write_files(const Image& image, const std::vector<std::string>& files, const ToneMap& tone,
                 const Receipt& receipt, bool quiet);

}  // namespace lumigrove
