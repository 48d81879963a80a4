#include "reference_image.h"

#include <fmt/format.h>

#include <cmath>

namespace lumigrove {
namespace {

// Far from the seeds that methods are given.
constexpr std::uint32_t kFirstHalfSeed = 0x52454631u, kSecondHalfSeed = 0x52454632u;

RgbImage mean_of(const RgbImage& a, const RgbImage& b) {
  RgbImage mean = a;
  for (std::size_t i = 0; i < mean.rgb.size(); ++i) mean.rgb[i] = 0.5f * (a.rgb[i] + b.rgb[i]);
  return mean;
}

// The difference of a half from the mean of both has the variance of that mean itself.
Errors errors_of_halves(const RgbImage& mean, const RgbImage& half, const MetricSettings& settings) {
  const Comparison comparison = compare_images(mean, half, settings);
  return {comparison.rmse, comparison.rel_mse, 1 - comparison.ssim, comparison.flip};
}

bool goes_on(const BudgetSpec& budget, const Contestant& a, const Contestant& b) {
  const bool time_left = budget.seconds > 0 && a.seconds() + b.seconds() < budget.seconds;
  const bool samples_left = budget.spp > 0 && a.spp() + b.spp() < budget.spp;
  // Both given: whichever is reached last.
  return time_left || samples_left || b.spp() == 0;
}

// Of the variance of the pixels' means that `render` stores.
Errors errors_of_variance(const Image& image, const RgbImage& beauty) {
  Errors errors = kNoErrors;
  const Layer* variance = image.find("variance");
  if (!variance || variance->values.size() != beauty.rgb.size()) return errors;
  double sum = 0, relative = 0;
  for (std::size_t i = 0; i < beauty.rgb.size(); ++i) {
    const double v = variance->values[i], r = beauty.rgb[i];
    sum += v;
    relative += v / (r * r + kRelMseEpsilon);
  }
  const double count = static_cast<double>(beauty.rgb.size());
  errors[static_cast<std::size_t>(Metric::kRmse)] = std::sqrt(sum / count);
  errors[static_cast<std::size_t>(Metric::kRelMse)] = relative / count;
  return errors;
}

// A file from elsewhere has a beauty only, made for this purpose.
RgbImage light_in_file(const Image& image, const std::string& light, const std::string& file) {
  if (!shows_emission(light)) return rgb_of(image, light, file);
  if (light == kAllLight || !image.find("direct")) return rgb_of(image, "", file);
  return with_emission(rgb_of(image, "direct", file), rgb_of(image, "emission", file));
}

}  // namespace

bool shows_emission(const std::string& light) { return light == kAllLight || light == kDirectLight; }

RgbImage with_emission(RgbImage image, const RgbImage& emission) {
  for (std::size_t i = 0; i < emission.rgb.size(); ++i) image.rgb[i] += emission.rgb[i];
  return image;
}

ReferenceImages render_reference(const Scene& scene, const std::shared_ptr<Geometry>& geometry, const Settings& settings,
                                 const BudgetSpec& budget, const std::vector<std::string>& lights,
                                 const MetricSettings& metrics, const KeepGoing& keep_going) {
  Contestant first(scene, geometry, settings), second(scene, geometry, settings);
  first.begin(settings.seed ^ kFirstHalfSeed);
  second.begin(settings.seed ^ kSecondHalfSeed);
  while (goes_on(budget, first, second)) {
    (first.spp() <= second.spp() ? first : second).sample();
    if (!keep_going(first.seconds() + second.seconds())) break;
  }
  ReferenceImages images;
  if (second.spp() == 0) return images;
  if (first.spp() > second.spp()) second.sample();  // halves of equal weight
  const RgbImage emission = mean_of(first.part(&FilmPixel::emission), second.part(&FilmPixel::emission));
  for (const std::string& light : lights) {
    ReferenceImage reference;
    if (shows_emission(light)) reference.emission = emission;
    const RgbImage half = with_emission(first.image(light), reference.emission);
    reference.image = mean_of(half, with_emission(second.image(light), reference.emission));
    reference.errors = errors_of_halves(reference.image, half, metrics);
    reference.origin = fmt::format("{}, {} spp in two halves, {:.1f} s", settings.preset, first.spp() + second.spp(),
                                   first.seconds() + second.seconds());
    images[light] = std::move(reference);
  }
  return images;
}

ReferenceImages read_reference(const std::string& file, int width, int height, const std::vector<std::string>& lights) {
  const Image image = read_image(file);
  if (image.width != width || image.height != height)
    throw Error(fmt::format("{}: the reference has {}x{} pixels, but {}x{} are compared", file, image.width, image.height,
                            width, height));
  ReferenceImages images;
  for (const std::string& light : lights) {
    ReferenceImage reference;
    reference.image = light_in_file(image, light, file);
    if (shows_emission(light) && image.find("emission")) reference.emission = rgb_of(image, "emission", file);
    if (light == kAllLight) reference.errors = errors_of_variance(image, reference.image);
    reference.origin = file;
    images[light] = std::move(reference);
  }
  return images;
}

}  // namespace lumigrove
