// The --stats table.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "lumigrove/renderer.h"

namespace lumigrove {

// --stats
void add_stats_option(CLI::App& command, bool& stats);

// Adds times and rays of `frame`; sizes and counts become those of `frame`.
void accumulate(RenderStats& total, const RenderStats& frame);

// Passes (ms, rays, million rays a second), structures (build ms, bytes, bytes a light), totals.
std::string stats_table(const RenderStats& stats, int frames);

}  // namespace lumigrove
