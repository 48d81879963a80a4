// Check 11 of the reproduction of real-time stochastic lightcuts: every estimator has the mean of the sum over all lights.
#include <algorithm>
#include <cmath>

#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kMeanTileSize = 8;  // 1024 surfaces: the sum over all lights is taken at each
constexpr int kSumImages = 8;
constexpr int kBatches = 64;
constexpr double kWorstZ = 4.5;  // of some thousand

struct Estimator {
  Method method;
  int spp;
  int interleave = 1;  // as many images squared make a batch: their mean is what is unbiased
};

std::vector<Estimator> estimators() {
  std::vector<Estimator> all = {{uniform_method(), 64}};
  for (const Variant v : kVariants) {
    const std::string of = fmt::format(", {}", variant_name(v));
    const Method root = perfect_root(v, false), cut = perfect_cut(v, false);
    all.push_back({with(root, "perfect tree" + of, {}), 32});
    all.push_back({with(cut, "cuts for 8x8 pixels" + of, {}), 32});
    all.push_back({with(cut, "cuts for each pixel" + of, {{"cut_share", "1"}}), 8});
    all.push_back({with(cut, "cuts, interleaved 2x2" + of, {{"cut_interleave", "2"}}), 32, 2});
    all.push_back({with(cut, "cuts, interleaved 4x4" + of, {{"cut_interleave", "4"}}), 32, 4});
    all.push_back({with(root, "perfect tree, Yuksel's weights" + of, {{"weights", "yuksel"}}), 32});
    all.push_back({with(cut, "cuts, Yuksel's weights" + of, {{"weights", "yuksel"}}), 32});
    all.push_back({with(perfect_root(v, true), "two levels" + of, {}), 32});
    all.push_back({with(perfect_cut(v, true), "two levels, cuts" + of, {}), 32});
    all.push_back({with(unbalanced_cut(v), "unbalanced tree, cuts" + of, {}), 32});
  }
  all.push_back({with(perfect_root(Variant::kOurs, false), "pools",
                      {{"selection", "pool"}, {"cut_share", "4"}, {"cut_interleave", "4"}}),
                 8});
  all.push_back({unbalanced_root(), 32});
  all.push_back({ats(false), 32});
  all.push_back({ats(true), 4});
  return all;
}

// Means of luminance of the squares, and of all of them.
std::vector<double> means_of(const RgbImage& light) {
  const std::size_t values = 3 * kMeanTileSize * kMeanTileSize, tiles = light.rgb.size() / values;
  std::vector<double> means(tiles + 1);
  for (std::size_t i = 0; i < light.rgb.size(); i += 3)
    means[i / values] +=
        static_cast<double>(luminance(vec3(light.rgb[i], light.rgb[i + 1], light.rgb[i + 2])));
  for (std::size_t t = 0; t < tiles; ++t) {
    means[tiles] += means[t] / static_cast<double>(tiles);
    means[t] /= kMeanTileSize * kMeanTileSize;
  }
  means[tiles] /= kMeanTileSize * kMeanTileSize;
  return means;
}

std::vector<Estimate> sample_means(SubjectStudy& study, const Settings& settings, int batches,
                                   int images_a_batch) {
  std::vector<Mean> means;
  for (int batch = 0; batch < batches; ++batch) {
    std::vector<double> sum;
    for (int i = 0; i < images_a_batch; ++i) {
      const std::vector<double> image = means_of(study.sample(settings, batch * images_a_batch + i).light);
      sum.resize(image.size());
      for (std::size_t t = 0; t < image.size(); ++t) sum[t] += image[t] / images_a_batch;
    }
    means.resize(sum.size());
    for (std::size_t t = 0; t < sum.size(); ++t) means[t].add(sum[t]);
  }
  std::vector<Estimate> estimates;
  for (const Mean& mean : means) estimates.push_back(mean.estimate());
  return estimates;
}

double worst_z(const std::vector<Estimate>& a, const std::vector<Estimate>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double error = std::hypot(a[i].error, b[i].error);
    if (error > 0) worst = std::max(worst, std::abs(a[i].value - b[i].value) / error);
  }
  return worst;
}

// Virtual point lights are points: their sum is exact.
std::vector<Estimate> sum_over_lights(SubjectStudy& study, const Subject& subject) {
  const Method all{"all", {{"selection", "all"}, {"hierarchy", "none"}}};
  return sample_means(study, subject_settings(subject, all, 1), subject.vpls ? 1 : kSumImages, 1);
}

void report_means(const Subject& subject, const Report& report) {
  SubjectStudy study(subject, true, kMeanTileSize);
  const std::vector<Estimate> exact = sum_over_lights(study, subject);
  for (const Estimator& estimator : estimators()) {
    const std::string what = "worst |z| of 17 means: " + estimator.method.name;
    const bool two_level = estimator.method.name.starts_with("two levels");
    if (two_level && subject.vpls) continue;
    const std::string missing = why_missing(subject, estimator.method, estimator.spp);
    if (!missing.empty()) {
      report(missing_relation(11, subject.scene, what, "unbiased", missing));
      continue;
    }
    const Settings settings = subject_settings(subject, estimator.method, estimator.spp);
    const std::vector<Estimate> means =
        sample_means(study, settings, kBatches, estimator.interleave * estimator.interleave);
    const Estimate all = means.back(), truth = exact.back();
    report({11,
            subject.scene,
            what,
            "unbiased",
            worst_z(means, exact),
            0,
            {},
            kWorstZ,
            fmt::format("mean / sum over {} lights {:.5f} +- {:.5f}", study.lights(study.world(settings)),
                        all.value / truth.value, std::hypot(all.error, truth.error) / truth.value)});
  }
}

}  // namespace

void check_means(const Report& report) {
  for (const Subject& subject : kSubjects) report_means(subject, report);
}

}  // namespace lumigrove::bench
