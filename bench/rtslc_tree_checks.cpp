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

constexpr int kRuns = 15;

struct Published {
  const char* ms;
  const char* sort_share;
  const char* agglomerative;
};
constexpr Published kPublished[] = {{"0.43, GPU", "0.63", "251/0.43 = 584"},
                                    {"0.15, GPU", "0.45", "22/0.15 = 147"}};

// Of the tree alone, as the program times it: not of gathering lights or of tracing virtual ones.
double build_ms(World& world, const Settings& settings) {
  RenderStats stats;
  if (settings.indirect.transport == Transport::kVpl)
    trace_vpls(world, settings, 0, stats);
  else
    build_lights(world, settings, stats);
  for (const StructureStats& s : stats.structures)
    if (s.name.ends_with("tree")) return s.build_ms;
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
  double perfect_ms = 0, sort_ms = 0;  // medians of times taken in turns
  std::size_t lights = 0;
};

BuildTimes time_builds(const Subject& subject, World& world, const Settings& settings) {
  const LargeArray<KeyIndex> input = morton_keys(world, subject.vpls);
  LargeArray<KeyIndex> keys, scratch;
  std::vector<double> perfect_ms, sort_ms;
  for (int run = 0; run <= kRuns; ++run) {
    const double ms = build_ms(world, settings);
    keys = input;
    const double sort = time_ms([&] { radix_sort(keys, 30, scratch); });
    if (run == 0) continue;
    perfect_ms.push_back(ms);
    sort_ms.push_back(sort);
  }
  return {median(perfect_ms), median(sort_ms), input.size()};
}

template <class Function>
auto with_one_thread(const Function& function) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  return function();
}

Settings build_settings(const Subject& subject, const Method& method) {
  Settings settings = subject_settings(subject, method, 1);
  settings.indirect.vpls = SubjectStudy::of(subject).vpls_asked();
  return settings;
}

// Seconds, so that they are measured once: with all threads and with one.
struct SlowTimes {
  double all_ms, one_ms;
};
SlowTimes time_agglomerative(const Subject& subject) {
  const Settings settings = build_settings(subject, unbalanced_root());
  World& world = SubjectStudy::of(subject).mutable_world(settings);
  const double all_ms = build_ms(world, settings);
  return {all_ms, with_one_thread([&] { return build_ms(world, settings); })};
}

void report_builds(const Subject& subject, const Published& published, Variant variant, const SlowTimes& slow,
                   const Report& report) {
  const auto title = [&](const char* what) { return fmt::format("{} ({})", what, variant_name(variant)); };
  const Settings settings = build_settings(subject, perfect_root(variant, false));
  World& world = SubjectStudy::of(subject).mutable_world(settings);
  const BuildTimes all = time_builds(subject, world, settings);
  const BuildTimes one = with_one_thread([&] { return time_builds(subject, world, settings); });
  const auto parts = [](const BuildTimes& t) {
    return fmt::format("sorting {:.3f} ms, keys and levels {:.3f} ms", t.sort_ms, t.perfect_ms - t.sort_ms);
  };
  report({0,
          subject.scene,
          title("build of the perfect tree, all threads: ms"),
          published.ms,
          all.perfect_ms,
          0,
          {},
          {},
          fmt::format("{} lights; {:.2f} times as fast as one thread", all.lights,
                      one.perfect_ms / all.perfect_ms)});
  report({0, subject.scene, title("the same, one thread: ms"), "", one.perfect_ms});
  report({0,
          subject.scene,
          title("sorting alone / build, all threads"),
          published.sort_share,
          all.sort_ms / all.perfect_ms,
          0,
          {},
          {},
          parts(all)});
  report({0,
          subject.scene,
          title("the same, one thread"),
          "",
          one.sort_ms / one.perfect_ms,
          0,
          {},
          {},
          parts(one)});
  const auto ratio = [&](const char* what, const char* number, double slow_ms, double ms) {
    report({0,
            subject.scene,
            title(what),
            number,
            slow_ms / ms,
            0,
            20,
            {},
            fmt::format("agglomerative {:.1f} ms, perfect {:.3f} ms", slow_ms, ms)});
  };
  ratio("build agglomerative / perfect, all threads", published.agglomerative, slow.all_ms, all.perfect_ms);
  ratio("the same, one thread", "", slow.one_ms, one.perfect_ms);
}

}  // namespace

void check_light_tree_builds(const Report& report) {
  for (std::size_t s = 0; s < std::size(kPublished); ++s) {
    const Subject& subject = kSubjects[s];
    if (const std::string missing = why_missing(subject, unbalanced_root(), 1); !missing.empty()) {
      report(missing_relation(0, subject.scene, "build of light trees", kPublished[s].ms, missing));
      continue;
    }
    const SlowTimes slow = time_agglomerative(subject);
    for (const Variant variant : kVariants) report_builds(subject, kPublished[s], variant, slow, report);
  }
}

}  // namespace lumigrove::bench
