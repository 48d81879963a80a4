// The build of light trees, table 1 of the paper of real-time stochastic lightcuts.
#include <tbb/global_control.h>

#include <cmath>

#include "base/morton.h"
#include "bench.h"
#include "device/sort.h"
#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kRuns = 9, kSlowRuns = 3;

struct Published {
  const char* ms;
  const char* sort_share;
  const char* agglomerative;
};
constexpr Published kPublished[] = {{"0.43, GPU", "0.63", "251/0.43 = 584"},
                                    {"0.15, GPU", "0.45", "22/0.15 = 147"}};

Method agglomerative() { return unbalanced_root(); }

// Of the tree alone, as the program times it: not of gathering lights or of tracing virtual ones.
double build_ms(World& world, const Settings& settings) {
  RenderStats stats;
  if (settings.indirect.transport == Transport::kVpl) {
    trace_vpls(world, settings, 0, stats);
    for (const StructureStats& s : stats.structures)
      if (s.of_vpls && s.name != "VPLs") return s.build_ms;
  } else {
    build_lights(world, settings, stats);
    for (const StructureStats& s : stats.structures)
      if (s.name != "light set") return s.build_ms;
  }
  return std::nan("");
}

// The keys that the perfect tree sorts.
LargeArray<KeyIndex> morton_keys(const World& world, bool vpls) {
  std::vector<vec3> positions;
  if (vpls)
    for (const Vpl& vpl : world.vpls.view().vpls) positions.push_back(vpl.position);
  else
    for (const Emitter& e : world.lights.view().emitters)
      positions.push_back(e.punctual() ? e.p0 : e.p0 + (e.e1 + e.e2) * (1.0f / 3));
  Box3 box;
  for (const vec3 p : positions) box = unite(box, p);
  const vec3 scale = inverse_extent(box);
  LargeArray<KeyIndex> keys;
  for (const vec3 p : positions)
    keys.push_back({morton30((p - box.lo) * scale), static_cast<std::uint32_t>(keys.size())});
  return keys;
}

struct BuildTimes {
  double perfect_ms = 0, sort_ms = 0, agglomerative_ms = 0;  // medians of times taken in turns
  std::size_t lights = 0;
};

BuildTimes time_builds(SubjectStudy& study, const Settings& perfect, const Settings& slow) {
  World &tree = study.mutable_world(perfect), &other = study.mutable_world(slow);
  const LargeArray<KeyIndex> input = morton_keys(tree, study.subject().vpls);
  LargeArray<KeyIndex> keys, scratch;
  std::vector<double> perfect_ms, sort_ms, slow_ms;
  build_ms(tree, perfect);
  for (int run = 0; run < kRuns; ++run) {
    perfect_ms.push_back(build_ms(tree, perfect));
    keys = input;
    sort_ms.push_back(time_ms([&] { radix_sort(keys, 30, scratch); }));
    if (run < kSlowRuns) slow_ms.push_back(build_ms(other, slow));
  }
  return {median(perfect_ms), median(sort_ms), median(slow_ms), input.size()};
}

// Times with all threads and with one.
void report_builds(const Subject& subject, const Published& published, Variant variant,
                   const Report& report) {
  const auto title = [&](const char* what) { return fmt::format("{} ({})", what, variant_name(variant)); };
  for (const Method& method : {perfect_root(variant, false), agglomerative()})
    if (const std::string missing = why_missing(subject, method, 1); !missing.empty()) {
      report(missing_relation(0, subject.scene, title("build of light trees"), published.ms, missing));
      return;
    }
  SubjectStudy& study = SubjectStudy::of(subject);
  Settings perfect = subject_settings(subject, perfect_root(variant, false), 1);
  Settings slow = subject_settings(subject, agglomerative(), 1);
  if (subject.vpls) perfect.indirect.vpls = slow.indirect.vpls = study.vpls_asked();
  const BuildTimes all = time_builds(study, perfect, slow);
  const BuildTimes one = [&] {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    return time_builds(study, perfect, slow);
  }();
  const std::string lights = fmt::format("{} lights", all.lights);
  report({0,
          subject.scene,
          title("build of the perfect tree, all threads: ms"),
          published.ms,
          all.perfect_ms,
          0,
          {},
          {},
          fmt::format("{}; {:.2f} times as fast as one thread", lights, one.perfect_ms / all.perfect_ms)});
  report({0, subject.scene, title("the same, one thread: ms"), "", one.perfect_ms, 0, {}, {}, lights});
  report({0,
          subject.scene,
          title("sorting alone / build, all threads"),
          published.sort_share,
          all.sort_ms / all.perfect_ms,
          0,
          {},
          {},
          fmt::format("sorting {:.3f} ms, keys and levels {:.3f} ms", all.sort_ms,
                      all.perfect_ms - all.sort_ms)});
  report({0,
          subject.scene,
          title("the same, one thread"),
          "",
          one.sort_ms / one.perfect_ms,
          0,
          {},
          {},
          fmt::format("sorting {:.3f} ms, keys and levels {:.3f} ms", one.sort_ms,
                      one.perfect_ms - one.sort_ms)});
  for (const BuildTimes* times : {&all, &one})
    report({0,
            subject.scene,
            title(times == &all ? "build agglomerative / perfect, all threads" : "the same, one thread"),
            times == &all ? published.agglomerative : "",
            times->agglomerative_ms / times->perfect_ms,
            0,
            20,
            {},
            fmt::format("agglomerative {:.1f} ms, perfect {:.3f} ms", times->agglomerative_ms,
                        times->perfect_ms)});
}

}  // namespace

void check_light_tree_builds(const Report& report) {
  for (std::size_t s = 0; s < std::size(kPublished); ++s)
    for (const Variant variant : kVariants) report_builds(kSubjects[s], kPublished[s], variant, report);
}

}  // namespace lumigrove::bench
