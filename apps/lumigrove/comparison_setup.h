// How a comparison describes itself: names, files, the settings of its methods, and whether an earlier one is the same.
#pragma once

#include <string>

#include "comparison.h"

namespace lumigrove {

// What the settings' image shows of the light: the whole of it, or direct light only. Or the layer asked for.
std::string measured_light(const ComparisonJob& job, const Settings& settings);

// A name as a part of a file name.
std::string slug(const std::string& name);

// Of one frame: its time, random numbers and view.
Settings settings_at(const ComparisonJob& job, const Scene& scene, Settings settings, int frame);

// What renders the same picture to the bit.
std::string render_command(const ComparisonJob& job, Settings settings, int spp, const std::string& file);

// Everything that is known before the first sample.
Results describe_job(const ComparisonJob& job, const Scene& scene);

// Takes over what `old` measured. Refuses (Error) anything but the same comparison; more seeds may be asked for. When
// nothing is left to measure, program and machine may be others: only the report is written again.
void take_up(Results& now, Results old, const std::string& folder);

}  // namespace lumigrove
