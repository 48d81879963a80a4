// Checks 3, 4, 5 and 9 of the reproduction of stochastic substitute trees: light at fixed surfaces and mean light of
// images.
#include <algorithm>
#include <cmath>

#include "bench.h"
#include "scene/builtin/scene_parts.h"
#include "sst_checks.h"
#include "sst_study.h"

namespace lumigrove::bench {
namespace {

// --- 3: selection at fixed lights ------------------------------------------------------------------------------

constexpr int kSurfacesWidth = 96, kSurfacesHeight = 54;
constexpr int kFewVpls = 4000;   // so few that all of them can be summed
constexpr int kBatches = 64, kBatchSpp = 16;
constexpr int kBlocks = 6;       // along each side of the image

double luminance_of(vec3 light) { return static_cast<double>(luminance(light)); }

double mean_luminance(const std::vector<vec3>& light) {
  double sum = 0;
  for (const vec3& value : light) sum += luminance_of(value);
  return sum / static_cast<double>(light.size());
}

// Means of luminance in kBlocks x kBlocks parts of the image.
std::vector<double> block_means(const std::vector<vec3>& light, const SeenSurfaces& seen) {
  std::vector<double> sums(kBlocks * kBlocks);
  for (std::size_t i = 0; i < light.size(); ++i) {
    const auto number = static_cast<int>(seen.pixels[i]);
    const int x = number % seen.width * kBlocks / seen.width, y = number / seen.width * kBlocks / seen.height;
    sums[static_cast<std::size_t>(y * kBlocks + x)] += luminance_of(light[i]);
  }
  for (double& sum : sums) sum *= kBlocks * kBlocks / static_cast<double>(light.size());
  return sums;
}

// Many samples of every surface, in two independent halves.
struct Sampled {
  std::vector<vec3> half[2];
  Mean image;                // one value a batch
  std::vector<Mean> blocks;  // likewise
};

Sampled sample_many(const Study& study, Settings settings, const SeenSurfaces& seen) {
  settings.indirect.spp = kBatchSpp;
  Sampled sampled;
  sampled.blocks.resize(kBlocks * kBlocks);
  for (auto& half : sampled.half) half.assign(seen.surfaces.size(), vec3(0));
  for (int batch = 0; batch < kBatches; ++batch) {
    const std::vector<vec3> light = light_surfaces(make_indirect_lighting(*study.world, settings, batch), seen);
    auto& half = sampled.half[batch % 2];
    for (std::size_t i = 0; i < light.size(); ++i) half[i] += light[i] * (2.0f / kBatches);
    sampled.image.add(mean_luminance(light));
    const std::vector<double> blocks = block_means(light, seen);
    for (std::size_t b = 0; b < blocks.size(); ++b) sampled.blocks[b].add(blocks[b]);
  }
  return sampled;
}

// Mean square of the bias at a surface: errors of the two halves have only that in common.
Estimate squared_bias(const Sampled& sampled, const std::vector<vec3>& exact) {
  Mean product;
  for (std::size_t i = 0; i < exact.size(); ++i)
    product.add(luminance_of(sampled.half[0][i] - exact[i]) * luminance_of(sampled.half[1][i] - exact[i]));
  return product.estimate();
}

// Its root over the mean light; 0 where there is no bias but noise, which is then the error.
Estimate relative_bias(const Sampled& sampled, const std::vector<vec3>& exact) {
  const Estimate square = squared_bias(sampled, exact);
  const double mean = mean_luminance(exact);
  if (square.value < square.error) return {std::sqrt(std::max(0.0, square.value)) / mean, std::sqrt(square.error) / mean};
  const Estimate bias = root(square);
  return {bias.value / mean, bias.error / mean};
}

// The largest difference of a block, in standard errors.
double worst_z(const Sampled& sampled, const std::vector<double>& exact) {
  double worst = 0;
  for (std::size_t b = 0; b < exact.size(); ++b) {
    const Estimate block = sampled.blocks[b].estimate();
    if (block.error > 0) worst = std::max(worst, std::abs(block.value - exact[b]) / block.error);
  }
  return worst;
}

struct Bounds {
  float min_nu, sigma_scale;  // sigma_max in units of its default
};
constexpr Bounds kNuRows[] = {{0.25f, 1}, {0.5f, 1}, {0.7f, 1}, {0.9f, 1}};
constexpr Bounds kSigmaRows[] = {{0.5f, 0.5f}, {0.5f, 2}, {0.5f, 4}};

class SelectionCheck {
 public:
  SelectionCheck(const char* scene, const Report& report)
      : name_(scene), report_(report), settings_(make_settings()), study_(scene, settings_),
        seen_(*study_.world, settings_) {
    study_.trace(settings_);
    Settings all = settings_;
    all.indirect.selection = Selection::kAll;
    exact_ = light_surfaces(make_indirect_lighting(*study_.world, all, 0), seen_);
  }

  void leaves() {
    Settings leaves = settings_;
    leaves.indirect.stop = Stop::kLeaf;
    const Sampled sampled = sample_many(study_, leaves, seen_);
    const Estimate mean = sampled.image.estimate();
    const double exact = mean_luminance(exact_);
    const std::string note =
        fmt::format("{} VPLs, {}x{} surfaces, {} samples each; RMS bias {} of mean light",
                    study_.world->vpls.view().vpls.size(), seen_.width, seen_.height, kBatches * kBatchSpp,
                    text(relative_bias(sampled, exact_)));
    report_({3, name_, "leaves only: mean / sum over all VPLs", "1", mean.value / exact, mean.error / exact, 1, 1, note});
    report_({3, name_, "leaves only: worst |z| of 36 parts of the image", "", worst_z(sampled, block_means(exact_, seen_)),
             0, {}, 4});
  }

  void substitutes() {
    std::vector<Estimate> nu, sigma;
    for (const Bounds& row : kNuRows) nu.push_back(bias_of(row));
    for (const Bounds& row : kSigmaRows) sigma.push_back(bias_of(row));
    growth("RMS bias at nu_min 0.25 / at 0.9", nu.front(), nu.back());
    growth("RMS bias at sigma_max 4x / at 0.5x", sigma.back(), sigma.front());
  }

 private:
  static Settings make_settings() {
    Settings settings = sized(sst_settings(true), kSurfacesWidth, kSurfacesHeight);
    settings.indirect.vpls = kFewVpls;
    return settings;
  }

  static std::string text(const Estimate& e) { return fmt::format("{:.3g} +- {:.1g}", e.value, e.error); }

  Estimate bias_of(const Bounds& bounds) {
    study_.build_substitutes(bounds.min_nu, bounds.sigma_scale * settings_.indirect.max_sigma);
    const Sampled sampled = sample_many(study_, settings_, seen_);
    const Estimate bias = relative_bias(sampled, exact_), mean = sampled.image.estimate();
    const double exact = mean_luminance(exact_);
    const std::vector<VplTrace> traces = trace_walks(make_indirect_lighting(*study_.world, settings_, 0), seen_);
    double substitutes = 0, walks = 0, boxed = 0;
    for (const VplTrace& trace : traces) {
      walks += trace.steps > 0 ? 1 : 0;
      substitutes += trace.substitute ? 1 : 0;
      boxed += trace.boxed ? 1 : 0;
    }
    report_({3, name_, fmt::format("RMS bias / mean light: nu_min {}, sigma_max {}x", bounds.min_nu, bounds.sigma_scale),
             "small", bias.value, bias.error, {}, {},
             fmt::format("mean {:+.2f} +- {:.2f} %; {:.0f} % of samples are substitutes, {:.0f} % of these moved to "
                         "their box; {:.1f} steps",
                         100 * (mean.value / exact - 1), 100 * mean.error / exact, 100 * substitutes / walks,
                         100 * boxed / substitutes, mean_steps(traces))});
    return bias;
  }

  void growth(const char* what, const Estimate& more, const Estimate& less) {
    const double ratio = more.value / less.value;
    const double error = ratio * std::hypot(more.error / more.value, less.error / less.value);
    report_({3, name_, what, "above 1", ratio, error, 1, {}});
  }

  const char* name_;
  const Report& report_;
  Settings settings_;
  Study study_;
  SeenSurfaces seen_;
  std::vector<vec3> exact_;
};

// Bias as a viewer meets it: many sets of as many lights as the method uses, with substitutes and without.
void report_default_bias(const char* scene, const Report& report) {
  constexpr int kSets = 64;
  Settings settings = sized(sst_settings(true), kSurfacesWidth, kSurfacesHeight);
  settings.indirect.spp = 8;
  Settings leaves = settings;
  leaves.indirect.stop = Stop::kLeaf;
  Study study(scene, settings);
  const SeenSurfaces seen(*study.world, settings);
  Sampled difference;
  for (auto& half : difference.half) half.assign(seen.surfaces.size(), vec3(0));
  Mean exact;
  for (int set = 0; set < kSets; ++set) {
    settings.seed = leaves.seed = static_cast<std::uint32_t>(set);
    study.trace(settings);
    const std::vector<vec3> a = light_surfaces(make_indirect_lighting(*study.world, settings, 0), seen);
    const std::vector<vec3> b = light_surfaces(make_indirect_lighting(*study.world, leaves, 0), seen);
    for (std::size_t i = 0; i < a.size(); ++i) difference.half[set % 2][i] += (a[i] - b[i]) * (2.0f / kSets);
    difference.image.add(mean_luminance(a) - mean_luminance(b));
    exact.add(mean_luminance(b));
  }
  const Estimate square = squared_bias(difference, std::vector<vec3>(seen.surfaces.size(), vec3(0)));
  const Estimate rms = square.value > square.error ? root(square) : Estimate{0, std::sqrt(square.error)};
  const Estimate mean = difference.image.estimate();
  report({3, scene, "RMS bias / mean light: defaults, many sets of 100 k VPLs", "small", rms.value / exact.mean(),
          rms.error / exact.mean(), {}, {},
          fmt::format("mean {:+.2f} +- {:.2f} %", 100 * mean.value / exact.mean(), 100 * mean.error / exact.mean())});
}

// --- 4: closed boxes -------------------------------------------------------------------------------------------

// A cube around the origin, its opposite walls of equal albedo, seen from inside.
Scene closed_box(float albedo_x, float albedo_y, float albedo_z, LightType* punctual) {
  using namespace builtin;
  Scene scene;
  const auto walls = [&](vec3 corner, vec3 u, vec3 v, const char* name, float albedo) {
    MeshBuilder builder;
    builder.quad(corner, u, v);
    builder.quad(-corner, -u, -v);
    add_static(scene, builder, name, add_surface(scene, name, vec3(albedo)));
  };
  walls(vec3(-1, -1, -1), vec3(0, 2, 0), vec3(0, 0, 2), "x", albedo_x);
  walls(vec3(-1, -1, -1), vec3(0, 0, 2), vec3(2, 0, 0), "y", albedo_y);
  walls(vec3(-1, -1, -1), vec3(2, 0, 0), vec3(0, 2, 0), "z", albedo_z);
  if (punctual) {
    PunctualLight light;
    light.type = *punctual;
    add_light_node(scene, light, vec3(0));
  } else {
    MeshBuilder lamp;
    lamp.quad(vec3(-0.3f, 0.9f, -0.3f), vec3(0.6f, 0, 0), vec3(0, 0, 0.6f));
    add_static(scene, lamp, "lamp", add_emitter(scene, "lamp", vec3(10), vec3(albedo_y)));
  }
  add_camera(scene, "camera", vec3(0.5f, 0.2f, 0.95f), vec3(-0.3f, -0.2f, -1), 70);
  return scene;
}

// Flux of each bounce over that of the one before.
std::vector<double> bounce_ratios(Scene scene) {
  Settings settings = sst_settings(true);
  settings.indirect.roulette_start = 1000;
  Study study(std::move(scene), settings);
  study.trace(settings);
  std::vector<double> ratios;
  double before = study.world->vpls.emitted_flux();
  for (const double flux : study.world->vpls.bounce_flux()) {
    ratios.push_back(flux / before);
    before = flux;
  }
  return ratios;
}

double worst_deviation(const std::vector<double>& ratios, double expected) {
  double worst = 0;
  for (const double ratio : ratios) worst = std::max(worst, std::abs(ratio / expected - 1));
  return worst;
}

// --- 5: depths -------------------------------------------------------------------------------------------------

constexpr int kDepthSamples = 48;

// Mean indirect light of the image by camera samples of their own VPLs or paths.
Estimate mean_indirect(Study& study, Settings settings) {
  Mean mean;
  for (int sample = 0; sample < kDepthSamples; ++sample) {
    settings.seed = static_cast<std::uint32_t>(sample) + 1;
    study.trace(settings);
    mean.add(mean_value(render_one(study, settings).indirect));
  }
  return mean.estimate();
}

Estimate ratio_of(const Estimate& a, const Estimate& b) {
  const double ratio = a.value / b.value;
  return {ratio, ratio * std::hypot(a.error / a.value, b.error / b.value)};
}

// Mean of leaf-only VPL light over the mean of paths of as many bounces.
Estimate vpls_over_paths(const Scene& scene, int bounces, bool clamped) {
  constexpr int kWidth = 128, kHeight = 72;
  const Settings paths = sized(path_settings(true, bounces), kWidth, kHeight);
  Settings vpls = sized(sst_settings(true), kWidth, kHeight);
  vpls.indirect.bounces = bounces;
  vpls.indirect.stop = Stop::kLeaf;
  if (!clamped) vpls.indirect.clamp = 0;
  Study path_study(scene, paths), vpl_study(scene, vpls);
  return ratio_of(mean_indirect(vpl_study, vpls), mean_indirect(path_study, paths));
}

void report_depth(int check, const std::string& scene_name, const std::string& subject, const Scene& scene, int bounces,
                  const Report& report) {
  const Estimate clamped = vpls_over_paths(scene, bounces, true), free = vpls_over_paths(scene, bounces, false);
  report({check, scene_name, fmt::format("{}: VPLs / paths, mean, clamped", subject), "below 1", clamped.value,
          clamped.error, {}, 1});
  report({check, scene_name, fmt::format("{}: VPLs / paths, mean, no clamp", subject), "1", free.value, free.error, 1, 1});
}

// --- 9: weights ------------------------------------------------------------------------------------------------

// Mean variance of a sample of one of the VPLs (leaves only) at the surfaces seen, one value a set of VPLs.
std::vector<double> variances(Study& study, const SeenSurfaces& seen, Settings settings, IndirectWeights weights) {
  constexpr int kSets = 8, kSamples = 48;
  settings.indirect.stop = Stop::kLeaf;
  settings.indirect.weights = weights;
  std::vector<double> result;
  for (int set = 0; set < kSets; ++set) {
    settings.seed = static_cast<std::uint32_t>(set) + 1;
    study.trace(settings);
    std::vector<Mean> means(seen.surfaces.size());
    for (int sample = 0; sample < kSamples; ++sample) {
      const std::vector<vec3> light = light_surfaces(make_indirect_lighting(*study.world, settings, sample), seen);
      for (std::size_t i = 0; i < light.size(); ++i) means[i].add(luminance_of(light[i]));
    }
    double sum = 0;
    for (const Mean& mean : means) sum += mean.variance();
    result.push_back(sum / static_cast<double>(means.size()));
  }
  return result;
}

}  // namespace

void check_selection(const Report& report) {
  for (const char* scene : kStudyScenes) {
    SelectionCheck check(scene, report);
    check.leaves();
    check.substitutes();
    report_default_bias(scene, report);
  }
}

void check_energy(const Report& report) {
  constexpr float kAlbedo = 0.5f, kDark = 0.2f, kBright = 0.8f;
  LightType point = LightType::kPoint;
  const Scene with_point = closed_box(kAlbedo, kAlbedo, kAlbedo, &point);
  const Scene with_lamp = closed_box(kAlbedo, kAlbedo, kAlbedo, nullptr);
  report({4, "box", "flux of a bounce / albedo of the one before - 1, point light", "0",
          worst_deviation(bounce_ratios(with_point), double(kAlbedo)), 0, {}, 1e-3, "worst of 3 bounces"});
  report({4, "box", "the same, area light", "0", worst_deviation(bounce_ratios(with_lamp), double(kAlbedo)), 0, {}, 1e-3});
  const double mean = (2 * double(kDark) + double(kBright)) / 3;
  report({4, "box", "the same, unequal walls, over their mean albedo", "0",
          worst_deviation(bounce_ratios(closed_box(kDark, kBright, kDark, &point)), mean), 0, {}, 0.1,
          "albedo 0.2, 0.8, 0.2 of x, y, z walls"});
  report_depth(4, "box", "point light, 3 bounces", with_point, 3, report);
  report_depth(4, "box", "area light, 3 bounces", with_lamp, 3, report);
}

void check_depths(const Report& report) {
  for (const char* name : kStudyScenes) {
    const Scene scene = load_scene(name);
    for (int bounces = 1; bounces <= 3; ++bounces)
      report_depth(5, name, fmt::format("{} bounce{}", bounces, bounces > 1 ? "s" : ""), scene, bounces, report);
  }
}

void check_weights(const Report& report) {
  const Settings settings = sized(sst_settings(true), kSurfacesWidth, kSurfacesHeight);
  for (const char* scene : kStudyScenes) {
    Study study(scene, settings);
    const SeenSurfaces seen(*study.world, settings);
    const std::vector<double> bounded = variances(study, seen, settings, IndirectWeights::kDistanceBounded);
    const Estimate in_box = ratio_of_means(variances(study, seen, settings, IndirectWeights::kInBox), bounded);
    const Estimate yuksel = ratio_of_means(variances(study, seen, settings, IndirectWeights::kYuksel), bounded);
    report({9, scene, "variance to leaves: in-box rule / distance-bounded", "above 1", in_box.value, in_box.error, 1, {}});
    report({9, scene, "variance to leaves: Yuksel's rule / distance-bounded", "above 1", yuksel.value, yuksel.error, 1, {}});
  }
}

}  // namespace lumigrove::bench
