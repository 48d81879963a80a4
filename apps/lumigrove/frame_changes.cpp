#include "frame_changes.h"

#include <cmath>

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

const Run* find_run(const Results& results, int method, int seed, int frame) {
  for (const Run& run : results.runs)
    if (run.method == method && run.seed == seed && run.frame == frame) return &run;
  return nullptr;
}

const Reference* find_reference(const Results& results, const std::string& light, int frame) {
  for (const Reference& reference : results.references)
    if (reference.light == light && reference.frame == frame) return &reference;
  return nullptr;
}

// Empty when the file is not there.
std::vector<float> shown(const fs::path& folder, const std::string& file, const ToneMap& tone) {
  if (file.empty() || !fs::exists(folder / file)) return {};
  return tone_map(rgb_of(read_image(folder / file), "", file).rgb, tone);
}

// Of one method with one seed at one budget.
void add_changes(const Results& results, const fs::path& folder, const ToneMap& tone, int method, int seed, Budget budget,
                 std::vector<FrameChange>& changes) {
  const std::string& light = results.methods[static_cast<std::size_t>(method)].light;
  std::vector<float> last, last_reference;
  for (const int frame : results.frames) {
    const Run* run = find_run(results, method, seed, frame);
    const Reference* reference = find_reference(results, light, frame);
    std::vector<float> now, now_reference;
    if (run && reference) {
      now = shown(folder, run->stage(budget).file, tone);
      now_reference = shown(folder, reference->file, tone);
    }
    if (!now.empty() && now.size() == now_reference.size() && now.size() == last.size()) {
      FrameChange change = change_between(last, now, last_reference, now_reference);
      change.method = method;
      change.seed = seed;
      change.frame = frame;
      change.budget = budget;
      changes.push_back(change);
    }
    last = std::move(now);
    last_reference = std::move(now_reference);
  }
}

}  // namespace

FrameChange change_between(const std::vector<float>& a, const std::vector<float>& b, const std::vector<float>& ra,
                           const std::vector<float>& rb) {
  double error = 0, own = 0, wanted = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double change = double(b[i]) - double(a[i]), reference = double(rb[i]) - double(ra[i]);
    error += std::abs(change - reference);
    own += std::abs(change);
    wanted += std::abs(reference);
  }
  const double count = static_cast<double>(a.size());
  FrameChange result;
  result.error = error / count;
  result.flicker = (own - wanted) / count;
  return result;
}

std::vector<FrameChange> frame_changes(const Results& results, const fs::path& folder, const ToneMap& tone) {
  std::vector<FrameChange> changes;
  if (results.frames.size() < 2) return changes;
  for (int method = 0; method < static_cast<int>(results.methods.size()); ++method)
    for (int seed = 0; seed < results.seeds; ++seed)
      for (const Budget budget : kBudgets) add_changes(results, folder, tone, method, seed, budget, changes);
  return changes;
}

}  // namespace lumigrove
