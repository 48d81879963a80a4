#include "image_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.h"
#include "image/difference.h"
#include "metrics/metrics.h"
#include "output.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

constexpr int kLimitExceeded = 3;

struct Limit {
  MetricInfo info;
  double value = 0;
};

struct ComparedImage {
  std::string file;
  Comparison comparison;
  std::vector<std::string> pictures;  // difference pictures that were written
  std::vector<std::string> failures;  // one sentence for each limit that it does not keep
};

// --- limits
// -------------------------------------------------------------------------------------------------------

std::string metric_keys() {
  std::string keys;
  for (const MetricInfo& info : metrics()) keys += (keys.empty() ? "" : ", ") + std::string(info.key);
  return keys;
}

const MetricInfo& find_metric(const std::string& option, const std::string& key) {
  for (const MetricInfo& info : metrics())
    if (key == info.key) return info;
  throw CLI::ValidationError(option, fmt::format("unknown metric '{}'; valid are {}", key, metric_keys()));
}

double parse_limit(const std::string& option, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw CLI::ValidationError(option, fmt::format("'{}' is not a number", text));
  return value;
}

// "flip=0.1"
std::vector<Limit> parse_limits(const std::string& option, const std::vector<std::string>& texts) {
  const bool above = option == "--fail-above";
  std::vector<Limit> limits;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos)
      throw CLI::ValidationError(option, fmt::format("'{}' is not of the form METRIC=VALUE", text));
    const MetricInfo& info = find_metric(option, text.substr(0, equals));
    if (info.lower_is_better != above)
      throw CLI::ValidationError(
          option, fmt::format("{} is better when it is {}; use {} {}", info.label, above ? "higher" : "lower",
                              above ? "--fail-below" : "--fail-above", text));
    limits.push_back({info, parse_limit(option, text.substr(equals + 1))});
  }
  return limits;
}

std::vector<Limit> all_limits(const ImageComparison& options) {
  std::vector<Limit> limits = parse_limits("--fail-above", options.fail_above);
  const std::vector<Limit> below = parse_limits("--fail-below", options.fail_below);
  limits.insert(limits.end(), below.begin(), below.end());
  return limits;
}

// A metric that is not a number keeps no limit.
std::vector<std::string> broken_limits(const ComparedImage& image, const std::vector<Limit>& limits) {
  std::vector<std::string> failures;
  for (const Limit& limit : limits) {
    const double value = image.comparison.value(limit.info.metric);
    const bool keeps = limit.info.lower_is_better ? value <= limit.value : value >= limit.value;
    if (!keeps)
      failures.push_back(fmt::format("{}: {} {:.6g} is {} the limit {:.6g}", image.file, limit.info.label,
                                     value, limit.info.lower_is_better ? "above" : "below", limit.value));
  }
  return failures;
}

// --- pictures
// -----------------------------------------------------------------------------------------------------

// File names without folder and extension; repeated ones get a number.
std::vector<std::string> unique_stems(const std::vector<std::string>& files) {
  std::map<std::string, int> uses;
  std::vector<std::string> stems;
  for (const std::string& file : files) {
    const std::string stem = fs::path(file).stem().string();
    const int use = ++uses[stem];
    stems.push_back(use == 1 ? stem : fmt::format("{}-{}", stem, use));
  }
  return stems;
}

std::vector<std::string> write_pictures(const RgbImage& reference, const RgbImage& test,
                                        const Comparison& comparison, const ToneMap& tone,
                                        const fs::path& base) {
  std::vector<std::string> files;
  const auto write = [&](const char* kind, const std::vector<float>& picture) {
    files.push_back(fmt::format("{}-{}.png", base.string(), kind));
    write_picture(picture, test.width, test.height, files.back());
  };
  write("signed", signed_difference(reference, test));
  write("absolute", absolute_difference(reference, test, tone));
  write("flip", heat_map(comparison.flip_map));
  return files;
}

// --- report
// -------------------------------------------------------------------------------------------------------

std::string layer_name(const ImageComparison& options) {
  return options.layer.empty() ? "beauty" : options.layer;
}

void print_table(const ImageComparison& options, const RgbImage& reference,
                 const std::vector<ComparedImage>& images) {
  fmt::print("reference {} ({}x{}, {}); tone curve {}, exposure {:+g} EV, {:.4g} pixels per degree\n\n",
             options.reference, reference.width, reference.height, layer_name(options), options.curve,
             options.metrics.tone.exposure_ev, options.metrics.pixels_per_degree);
  std::size_t width = 5;
  for (const ComparedImage& image : images) width = std::max(width, image.file.size());
  fmt::print("{:<{}}", "image", width);
  for (const MetricInfo& info : metrics()) fmt::print("  {:>10}", info.label);
  fmt::print("\n");
  for (const ComparedImage& image : images) {
    fmt::print("{:<{}}", image.file, width);
    for (const MetricInfo& info : metrics()) {
      const double value = image.comparison.value(info.metric);
      fmt::print("  {:>10}", std::isnan(value) ? "undefined" : fmt::format("{:.5g}", value));
    }
    fmt::print("\n");
  }
  fmt::print("\n");
  for (const MetricInfo& info : metrics()) fmt::print("{:<6}  {}\n", info.label, info.formula);
  for (const ComparedImage& image : images)
    for (const std::string& picture : image.pictures) fmt::print("wrote {}\n", picture);
}

nlohmann::ordered_json to_json(const ComparedImage& image) {
  nlohmann::ordered_json json = {{"file", image.file}};
  for (const MetricInfo& info : metrics())
    json[info.key] = image.comparison.value(info.metric);  // NaN becomes null
  json["pictures"] = image.pictures;
  json["failures"] = image.failures;
  return json;
}

void print_json(const ImageComparison& options, const RgbImage& reference,
                const std::vector<ComparedImage>& images) {
  nlohmann::ordered_json json = {{"reference", options.reference},
                                 {"width", reference.width},
                                 {"height", reference.height},
                                 {"layer", layer_name(options)},
                                 {"tone", options.curve},
                                 {"exposure_ev", options.metrics.tone.exposure_ev},
                                 {"pixels_per_degree", options.metrics.pixels_per_degree}};
  for (const MetricInfo& info : metrics()) json["formulas"][info.key] = info.formula;
  json["images"] = nlohmann::ordered_json::array();
  for (const ComparedImage& image : images) json["images"].push_back(to_json(image));
  // File names need not be UTF-8, JSON strings must be.
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

// --- the command
// --------------------------------------------------------------------------------------------------

RgbImage load(const ImageComparison& options, const std::string& file) {
  return rgb_of(read_image(file), options.layer, file);
}

std::vector<ComparedImage> compare_all(const ImageComparison& options, const RgbImage& reference,
                                       const std::vector<Limit>& limits) {
  const std::vector<std::string> stems = unique_stems(options.images);
  std::vector<ComparedImage> images;
  for (std::size_t i = 0; i < options.images.size(); ++i) {
    const RgbImage test = load(options, options.images[i]);
    ComparedImage image{options.images[i], compare_images(reference, test, options.metrics), {}, {}};
    if (!options.folder.empty())
      image.pictures = write_pictures(reference, test, image.comparison, options.metrics.tone,
                                      fs::path(options.folder) / stems[i]);
    image.comparison.flip_map.clear();
    image.failures = broken_limits(image, limits);
    images.push_back(std::move(image));
  }
  return images;
}

}  // namespace

void compare_image_files(ImageComparison& options) {
  const std::vector<Limit> limits = all_limits(options);
  options.metrics.tone.curve = tone_curve_from_name(options.curve);
  if (!options.folder.empty()) make_folder(options.folder);
  const RgbImage reference = load(options, options.reference);
  const std::vector<ComparedImage> images = compare_all(options, reference, limits);
  options.json ? print_json(options, reference, images) : print_table(options, reference, images);
  std::fflush(stdout);
  bool failed = false;
  for (const ComparedImage& image : images)
    for (const std::string& failure : image.failures) {
      fmt::print(stderr, "lumigrove: {}\n", failure);
      failed = true;
    }
  if (failed) throw ExitCode{kLimitExceeded};
}

}  // namespace lumigrove
