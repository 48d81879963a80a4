#include "frame/estimator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <numeric>
#include <vector>

namespace lumigrove {
namespace {

using Sentences = std::vector<std::string>;

bool draws_from_substitutes(const IndirectSettings& s) {
  return !s.joint && s.selection == Selection::kRoot && s.hierarchy == Hierarchy::kSubstitute &&
         s.stop == Stop::kSubstitute;
}

// Samples of a pixel that take turns at the nodes of cuts (cut_kernel.h); 1: each takes all.
int turns(const SelectionSettings& s) {
  return s.selection == Selection::kCut ? s.cut_interleave * s.cut_interleave : 1;
}
int turns(const Settings& s) {
  const bool vpl_cuts = s.indirect.transport == Transport::kVpl && !s.indirect.joint;
  return std::lcm(turns(s.direct), vpl_cuts ? turns(s.indirect) : 1);
}

// What of the light from virtual point lights is lost or wrong (vpl_kernel.h, vpl_sampler_kernel.h, gather_kernel.h).
Sentences vpl_biases(const Settings& settings) {
  const IndirectSettings& s = settings.indirect;
  Sentences biases;
  if (!settings.force_diffuse) biases.push_back("VPLs send on no gloss");
  if (!settings.force_diffuse && !s.gloss) biases.push_back("surfaces show no gloss of indirect light");
  if (s.clamp > 0)
    biases.push_back(
        s.compensate ? "light that the clamp leaves out near VPLs is found by one short ray, but not exactly"
                     : "the clamp leaves out light near VPLs");
  if (draws_from_substitutes(s) && s.correction == 0)
    biases.push_back("substitutes are not where their VPLs are");
  return biases;
}

// Light that is not asked for.
std::string limit(const IndirectSettings& s) {
  const int bounces = s.transport == Transport::kPath ? s.max_bounces : s.bounces;
  if (s.transport == Transport::kNone || bounces == 0) return "direct light only";
  return fmt::format("without light of more than {} bounce{}", bounces, bounces == 1 ? "" : "s");
}

}  // namespace

EstimatorLabel estimator_label(const Settings& settings) {
  EstimatorLabel label;
  Sentences reasons;
  if (const int samples = turns(settings); samples > 1) {
    label.kind = Bias::kConsistent;
    reasons.push_back(
        fmt::format("unbiased after every {} samples a pixel, which take turns at the cuts", samples));
  }
  const bool vpls = settings.indirect.transport == Transport::kVpl;
  const Sentences biases = vpls ? vpl_biases(settings) : Sentences{};
  if (!biases.empty()) label.kind = Bias::kBiased;
  reasons.insert(reasons.end(), biases.begin(), biases.end());
  if (vpls && biases.empty()) reasons.push_back("except for grazing light on smoothly shaded meshes");
  if (vpls && settings.indirect.keep_vpls)
    reasons.push_back("more samples converge to the image of one set of VPLs");
  reasons.push_back(limit(settings.indirect));
  label.reason = fmt::format("{}", fmt::join(reasons, "; "));
  return label;
}

const char* bias_name(Bias kind) {
  return kind == Bias::kUnbiased ? "unbiased" : kind == Bias::kConsistent ? "consistent" : "biased";
}

std::string estimator_text(const EstimatorLabel& label) {
  const char* kind = bias_name(label.kind);
  return label.reason.empty() ? kind : fmt::format("{}: {}", kind, label.reason);
}

}  // namespace lumigrove
