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
constexpr int kFewVpls = 4000;  // so few that all of them can be summed
constexpr int kBatches = 64, kBatchSpp = 32;
constexpr int kBlocks = 6;  // along each side of the image

double luminance_of(vec3 light) { return static_cast<double>(luminance(light)); }

double mean_luminance(const std::vector<vec3>& light) {
  double sum = 0;
  for (const vec3& value : light) sum += luminance_of(value);
  return sum / static_cast<double>(light.size());
}

// Means of luminance in kBlocks x kBlocks parts of the image.
std::vector<double> block_means(const std::vector<vec3>& light, const SeenImage& seen) {
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
  std::vector<double> images;  // mean of a batch
  std::vector<Mean> blocks;    // likewise, of parts of the image
};

Sampled sample_many(const Study& study, Settings settings, const SeenImage& seen) {
  settings.indirect.spp = kBatchSpp;
  Sampled sampled;
  sampled.blocks.resize(kBlocks * kBlocks);
  for (auto& half : sampled.half) half.assign(seen.surfaces.size(), vec3(0));
  for (int batch = 0; batch < kBatches; ++batch) {
    const std::vector<vec3> light = light_surfaces(make_indirect_lighting(*study.world, settings, batch), seen);
    auto& half = sampled.half[batch % 2];
    for (std::size_t i = 0; i < light.size(); ++i) half[i] += light[i] * (2.0f / kBatches);
    sampled.images.push_back(mean_luminance(light));
    const std::vector<double> blocks = block_means(light, seen);
    for (std::size_t b = 0; b < blocks.size(); ++b) sampled.blocks[b].add(blocks[b]);
  }
  return sampled;
}

// Mean square of a difference at a surface, of which there are two independent estimates: noise is all that these do not
// have in common. In units of `unit` squared.
Estimate common_square(const std::vector<vec3>& a, const std::vector<vec3>& b, double unit) {
  Mean product;
  for (std::size_t i = 0; i < a.size(); ++i) product.add(luminance_of(a[i]) * luminance_of(b[i]) / (unit * unit));
  return product.estimate();
}

// 0 where there is nothing but noise, which is then the error.
Estimate root_above_noise(const Estimate& square) {
  return square.value > square.error ? root(square) : Estimate{0, std::sqrt(square.error)};
}

std::vector<vec3> difference(const std::vector<vec3>& a, const std::vector<vec3>& b) {
  std::vector<vec3> result(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) result[i] = a[i] - b[i];
  return result;
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
      : name_(scene),
        report_(report),
        settings_(make_settings()),
        study_(scene, settings_),
        seen_(*study_.world, settings_) {
    study_.trace(settings_);
    Settings all = settings_;
    all.indirect.selection = Selection::kAll;
    exact_ = light_surfaces(make_indirect_lighting(*study_.world, all, 0), seen_);
  }

  void leaves() {
    Settings leaves = settings_;
    leaves.indirect.stop = Stop::kLeaf;
    leaves_ = sample_many(study_, leaves, seen_);
    const Estimate mean = mean_of(leaves_.images);
    const double exact = mean_luminance(exact_);
    const Estimate rms = root_above_noise(
        common_square(difference(leaves_.half[0], exact_), difference(leaves_.half[1], exact_), exact));
    const std::string note = fmt::format(
        "{} VPLs, {}x{} surfaces, {} samples each; RMS bias {:.2g} +- {:.1g} of mean light",
        study_.world->vpls.view().vpls.size(), seen_.width, seen_.height, kBatches * kBatchSpp, rms.value, rms.error);
    report_(
        {3, name_, "leaves only: mean / sum over all VPLs", "1", mean.value / exact, mean.error / exact, 1, 1, note});
    report_({3,
             name_,
             "leaves only: worst |z| of 36 parts of the image",
             "",
             worst_z(leaves_, block_means(exact_, seen_)),
             0,
             {},
             4});
  }

  // After leaves().
  void substitutes() {
    std::vector<Estimate> nu, sigma;
    for (const Bounds& row : kNuRows) nu.push_back(squared_bias(row));
    for (const Bounds& row : kSigmaRows) sigma.push_back(squared_bias(row));
    growth("mean square of bias at nu_min 0.25 - at 0.9", nu.front(), nu.back());
    growth("mean square of bias at sigma_max 4x - at 0.5x", sigma.back(), sigma.front());
  }

 private:
  static Settings make_settings() {
    Settings settings = sized(sst_settings(true), kSurfacesWidth, kSurfacesHeight);
    settings.indirect.vpls = kFewVpls;
    return settings;
  }

  // Over the mean light squared. What leaves the same random numbers lead to stands for the sum: that takes most of
  // the noise away.
  Estimate squared_bias(const Bounds& bounds) {
    study_.build_substitutes(bounds.min_nu, bounds.sigma_scale * settings_.indirect.max_sigma);
    Sampled sampled = sample_many(study_, settings_, seen_);
    const double exact = mean_luminance(exact_);
    const Estimate square = common_square(difference(sampled.half[0], leaves_.half[0]),
                                          difference(sampled.half[1], leaves_.half[1]), exact);
    for (std::size_t i = 0; i < sampled.images.size(); ++i) sampled.images[i] -= leaves_.images[i];
    const Estimate rms = root_above_noise(square), mean = mean_of(sampled.images);
    report_({3,
             name_,
             fmt::format("RMS bias / mean light: nu_min {}, sigma_max {}x", bounds.min_nu, bounds.sigma_scale),
             "small",
             rms.value,
             rms.error,
             {},
             {},
             fmt::format("mean {:+.2f} +- {:.2f} %; {}", 100 * mean.value / exact, 100 * mean.error / exact,
                         walks_text())});
    return square;
  }

  std::string walks_text() const {
    const std::vector<VplTrace> traces = trace_walks(make_indirect_lighting(*study_.world, settings_, 0), seen_);
    double substitutes = 0, walks = 0, boxed = 0;
    for (const VplTrace& trace : traces) {
      walks += trace.steps > 0 ? 1 : 0;
      substitutes += trace.substitute ? 1 : 0;
      boxed += trace.boxed ? 1 : 0;
    }
    return fmt::format("{:.0f} % of walks end at substitutes, {:.0f} % of these are moved to their box; {:.1f} steps",
                       100 * substitutes / walks, 100 * boxed / substitutes, mean_steps(traces));
  }

  void growth(const char* what, const Estimate& more, const Estimate& less) {
    report_({3, name_, what, "above 0", more.value - less.value, std::hypot(more.error, less.error), 0, {}});
  }

  const char* name_;
  const Report& report_;
  Settings settings_;
  Study study_;
  SeenImage seen_;
  std::vector<vec3> exact_;
  Sampled leaves_;
};

// Bias as a viewer meets it: many sets of as many lights as the method uses, with substitutes and without.
void report_default_bias(const char* scene, const Report& report) {
  constexpr int kSets = 64;
  Settings settings = sized(sst_settings(true), kSurfacesWidth, kSurfacesHeight);
  settings.indirect.spp = 8;
  Settings leaves = settings;
  leaves.indirect.stop = Stop::kLeaf;
  Study study(scene, settings);
  const SeenImage seen(*study.world, settings);
  std::vector<vec3> bias[2];
  for (auto& half : bias) half.assign(seen.surfaces.size(), vec3(0));
  std::vector<double> differences, exact;
  for (int set = 0; set < kSets; ++set) {
    settings.seed = leaves.seed = static_cast<std::uint32_t>(set);
    study.trace(settings);
    const std::vector<vec3> a = light_surfaces(make_indirect_lighting(*study.world, settings, 0), seen);
    const std::vector<vec3> b = light_surfaces(make_indirect_lighting(*study.world, leaves, 0), seen);
    for (std::size_t i = 0; i < a.size(); ++i) bias[set % 2][i] += (a[i] - b[i]) * (2.0f / kSets);
    exact.push_back(mean_luminance(b));
    differences.push_back(mean_luminance(a) - exact.back());
  }
  const double light = mean_of(exact).value;
  const Estimate rms = root_above_noise(common_square(bias[0], bias[1], light)), mean = mean_of(differences);
  report({3,
          scene,
          "RMS bias / mean light: defaults, many sets of 100 k VPLs",
          "small",
          rms.value,
          rms.error,
          {},
          {},
          fmt::format("mean {:+.2f} +- {:.2f} %", 100 * mean.value / light, 100 * mean.error / light)});
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

// Without a clamp single samples are arbitrarily bright, though rarely: many are needed. Few lights do: the mean does not
// depend on their number.
constexpr int kDepthSets = 64, kDepthSpp = 4, kDepthVpls = 30000, kDepthPaths = 6;

struct DepthMeans {
  Mean paths, clamped, free;  // of the indirect light of an image, one an image
};

// Leaves only against paths of as many bounces.
DepthMeans measure_depth(const Scene& scene, int bounces) {
  constexpr int kWidth = 128, kHeight = 72;
  Settings paths = sized(path_settings(true, bounces), kWidth, kHeight);
  Settings clamped = sized(sst_settings(true), kWidth, kHeight);
  clamped.indirect.vpls = kDepthVpls;
  clamped.indirect.spp = kDepthSpp;
  clamped.indirect.bounces = bounces;
  clamped.indirect.stop = Stop::kLeaf;
  Settings free = clamped;
  free.indirect.clamp = 0;
  Study path_study(scene, paths), vpl_study(scene, clamped);
  DepthMeans means;
  for (int set = 0; set < kDepthSets; ++set) {
    clamped.seed = free.seed = static_cast<std::uint32_t>(set) + 1;
    vpl_study.trace(clamped);
    for (int k = 0; k < kDepthPaths; ++k) {
      ++paths.seed;
      means.paths.add(mean_value(render_one(path_study, paths).indirect));
    }
    means.clamped.add(mean_value(render_one(vpl_study, clamped).indirect));
    means.free.add(mean_value(render_one(vpl_study, free).indirect));
  }
  return means;
}

Estimate ratio_of(const Estimate& a, const Estimate& b) {
  const double ratio = a.value / b.value;
  return {ratio, std::abs(ratio) * std::hypot(a.error / a.value, b.error / b.value)};
}

void report_depth(int check, const std::string& scene_name, const std::string& subject, const Scene& scene, int bounces,
                  const Report& report) {
  const DepthMeans means = measure_depth(scene, bounces);
  const Estimate clamped = ratio_of(means.clamped.estimate(), means.paths.estimate());
  const Estimate free = ratio_of(means.free.estimate(), means.paths.estimate());
  report({check,
          scene_name,
          fmt::format("{}: VPLs / paths, mean, clamped", subject),
          "below 1",
          clamped.value,
          clamped.error,
          {},
          1});
  report(
      {check, scene_name, fmt::format("{}: VPLs / paths, mean, no clamp", subject), "1", free.value, free.error, 1, 1});
}

// --- 9: weights ------------------------------------------------------------------------------------------------

// Mean variance of a sample of one of the VPLs (leaves only) at the surfaces seen, one value a set of VPLs.
std::vector<double> variances(Study& study, const SeenImage& seen, Settings settings, Weights weights) {
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
  report({4,
          "box",
          "flux of a bounce / albedo of the one before - 1, point light",
          "0",
          worst_deviation(bounce_ratios(with_point), double(kAlbedo)),
          0,
          {},
          1e-3,
          "worst of 3 bounces"});
  report(
      {4, "box", "the same, area light", "0", worst_deviation(bounce_ratios(with_lamp), double(kAlbedo)), 0, {}, 1e-3});
  const double mean = (2 * double(kDark) + double(kBright)) / 3;
  report({4,
          "box",
          "the same, unequal walls, over their mean albedo",
          "0",
          worst_deviation(bounce_ratios(closed_box(kDark, kBright, kDark, &point)), mean),
          0,
          {},
          0.1,
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
    const SeenImage seen(*study.world, settings);
    const std::vector<double> bounded = variances(study, seen, settings, Weights::kDistanceBounded);
    const Estimate in_box = ratio_of_means(variances(study, seen, settings, Weights::kInBox), bounded);
    const Estimate yuksel = ratio_of_means(variances(study, seen, settings, Weights::kYuksel), bounded);
    report(
        {9, scene, "variance to leaves: in-box rule / distance-bounded", "above 1", in_box.value, in_box.error, 1, {}});
    report({9,
            scene,
            "variance to leaves: Yuksel's rule / distance-bounded",
            "above 1",
            yuksel.value,
            yuksel.error,
            1,
            {}});
  }
}

}  // namespace lumigrove::bench
