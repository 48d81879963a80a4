#include "viewer_data.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "bias_map.h"
#include "html.h"
#include "lumigrove/image.h"
#include "pictures.h"
#include "regions.h"
#include "summary_tables.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kWorstRegions = 4;

// Names of pictures, as report.js makes them: f is the position in the list of frames.
std::string reference_key(std::size_t light, std::size_t f) { return fmt::format("r/{}/{}", light, f); }
std::string image_key(int method, Budget budget, std::size_t f) {
  return fmt::format("m/{}/{}/{}", method, budget_key(budget), f);
}
std::string map_key(int method, Budget budget) { return fmt::format("{}/{}", method, budget_key(budget)); }

class ViewerBuilder {
 public:
  ViewerBuilder(const Results& results, const fs::path& folder)
      : results_(results), folder_(folder), tone_{static_cast<float>(results.exposure_ev), tone_curve_from_name(results.tone)} {}

  ViewerData build(std::size_t most_bytes);

 private:
  std::optional<RgbImage> read_beauty(const std::string& file, std::string& why) const;
  std::optional<RgbImage> load(const std::string& key, const std::string& file);
  const Reference* reference_of(const std::string& light, int frame) const;
  const Run* run_of(int method, int seed, int frame) const;
  std::string why_absent(int method) const;

  void add(const std::string& key, Picture picture, bool of_first_frame);
  void add_light(std::size_t index, const std::string& light);
  void add_method(int method, Budget budget, const std::optional<RgbImage>& reference, Json& light,
                  std::vector<std::vector<float>>& maps, std::vector<std::string>& map_names);
  std::optional<RgbImage> load_stage(int method, Budget budget, std::size_t f);
  void add_bias(int method, Budget budget, const RgbImage& reference, double rel_mse);
  void add_later_frames(std::size_t most_bytes);
  void add_json_pictures(const EncodedPictures& encoded, const std::vector<std::string>& keys, ViewerData& data);
  void scale_biases(Json& light);
  float gain() const { return std::exp2(tone_.exposure_ev); }

  const Results& results_;
  fs::path folder_;
  ToneMap tone_;
  Json lights_ = Json::array(), pictures_ = Json::object(), missing_ = Json::object(), bias_ = Json::object();
  std::vector<std::string> first_keys_, later_keys_;
  std::vector<Picture> first_, later_;
  std::map<std::string, std::vector<double>> biases_;  // of one light, before their common scale is known
};

// nullopt, and why, when there is no such image.
std::optional<RgbImage> ViewerBuilder::read_beauty(const std::string& file, std::string& why) const {
  try {
    RgbImage image = rgb_of(read_image(folder_ / file), "", file);
    if (image.width == results_.width && image.height == results_.height) return image;
    why = fmt::format("{} has {}x{} pixels, not {}x{}", file, image.width, image.height, results_.width, results_.height);
  } catch (const Error&) {
    why = file + (fs::exists(folder_ / file) ? " cannot be read" : " is missing");
  }
  return std::nullopt;
}

// As above; what is missing is listed.
std::optional<RgbImage> ViewerBuilder::load(const std::string& key, const std::string& file) {
  std::string why;
  std::optional<RgbImage> image = read_beauty(file, why);
  if (!image) missing_[key] = why;
  return image;
}

const Reference* ViewerBuilder::reference_of(const std::string& light, int frame) const {
  for (const Reference& reference : results_.references)
    if (reference.light == light && reference.frame == frame) return &reference;
  return nullptr;
}

const Run* ViewerBuilder::run_of(int method, int seed, int frame) const {
  for (const Run& run : results_.runs)
    if (run.method == method && run.seed == seed && run.frame == frame) return &run;
  return nullptr;
}

std::string ViewerBuilder::why_absent(int method) const {
  const Contender& contender = results_.methods[static_cast<std::size_t>(method)];
  return contender.failure.empty() ? "not rendered yet" : contender.failure;
}

void ViewerBuilder::add(const std::string& key, Picture picture, bool of_first_frame) {
  (of_first_frame ? first_keys_ : later_keys_).push_back(key);
  (of_first_frame ? first_ : later_).push_back(std::move(picture));
}

std::optional<RgbImage> ViewerBuilder::load_stage(int method, Budget budget, std::size_t f) {
  const std::string key = image_key(method, budget, f);
  const Run* run = run_of(method, 0, results_.frames[f]);
  if (run && !run->stage(budget).file.empty()) return load(key, run->stage(budget).file);
  missing_[key] = why_absent(method);
  return std::nullopt;
}

void ViewerBuilder::add_bias(int method, Budget budget, const RgbImage& reference, double rel_mse) {
  const std::string key = map_key(method, budget);
  std::vector<std::string> files;
  for (const Run& run : results_.runs)
    if (run.method == method && run.frame == results_.frames.front() && !run.stage(budget).file.empty())
      files.push_back(run.stage(budget).file);
  std::vector<BlockMeans> seeds(files.size());
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    std::string ignored;
    if (const auto image = read_beauty(files[i], ignored)) seeds[i] = block_means(*image);
  });
  std::erase_if(seeds, [](const BlockMeans& means) { return means.values.empty(); });
  if (seeds.size() < 2)
    missing_["b/" + key] = "a bias map needs pictures of at least two seeds";
  else
    biases_[key] = bias_of(seeds, block_means(reference), rel_mse);
}

void ViewerBuilder::add_method(int method, Budget budget, const std::optional<RgbImage>& reference, Json& light,
                               std::vector<std::vector<float>>& maps, std::vector<std::string>& map_names) {
  const std::optional<RgbImage> image = load_stage(method, budget, 0);
  if (!image) return;
  add(image_key(method, budget, 0), companded(*image, gain()), true);
  const std::string key = map_key(method, budget);
  if (!reference) {
    missing_["f/" + key] = missing_["b/" + key] = "there is no reference";
    return;
  }
  try {
    maps.push_back(flip_map({image->width, image->height, tone_map(reference->rgb, tone_), "reference"},
                            {image->width, image->height, tone_map(image->rgb, tone_), "image"},
                            static_cast<float>(results_.pixels_per_degree)));
    map_names.push_back(key);
    add("f/" + key, gray_picture(maps.back(), image->width, image->height), true);
  } catch (const Error& error) {
    missing_["f/" + key] = error.what();
  }
  add_bias(method, budget, *reference, light["referenceRelMse"].is_null() ? kNotMeasured : light["referenceRelMse"].get<double>());
}

Json to_json(const Region& region, const std::vector<std::string>& map_names) {
  Json json = {{"x", region.x}, {"y", region.y}, {"w", region.width}, {"h", region.height}, {"why", region.why},
               {"flip", Json::object()}};
  for (std::size_t i = 0; i < map_names.size(); ++i) json["flip"][map_names[i]] = region.flip[i];
  return json;
}

// All bias maps of a light share a scale, so that they can be compared.
void ViewerBuilder::scale_biases(Json& light) {
  std::vector<double> values;
  for (const auto& [key, bias] : biases_) values.insert(values.end(), bias.begin(), bias.end());
  const double scale = bias_scale(std::move(values));
  light["biasScale"] = scale;
  for (const auto& [key, bias] : biases_)
    bias_[key] = {{"columns", (results_.width + kBiasBlock - 1) / kBiasBlock},
                  {"rows", (results_.height + kBiasBlock - 1) / kBiasBlock},
                  {"codes", base64(bias_codes(bias, scale))}};
  biases_.clear();
}

void ViewerBuilder::add_light(std::size_t index, const std::string& name) {
  const Reference* reference = reference_of(name, results_.frames.front());
  const double rel_mse = reference ? reference->errors[1] : kNotMeasured;
  Json light = {{"name", name}, {"methods", Json::array()}, {"regions", Json::array()},
                {"referenceRelMse", rel_mse - rel_mse == 0 ? Json(rel_mse) : Json(nullptr)}};
  std::optional<RgbImage> image;
  const std::string key = reference_key(index, 0);
  if (reference)
    image = load(key, reference->file);
  else
    missing_[key] = "not rendered yet";
  if (image) add(key, companded(*image, gain()), true);
  std::vector<std::vector<float>> maps;
  std::vector<std::string> map_names;
  for (std::size_t m = 0; m < results_.methods.size(); ++m) {
    if (results_.methods[m].light != name) continue;
    light["methods"].push_back(m);
    for (const Budget budget : kBudgets) add_method(static_cast<int>(m), budget, image, light, maps, map_names);
  }
  for (const Region& region : find_regions(maps, results_.width, results_.height, kWorstRegions))
    light["regions"].push_back(to_json(region, map_names));
  scale_biases(light);
  lights_.push_back(std::move(light));
}

// Of a sequence. So many pictures are made smaller before they are kept.
void ViewerBuilder::add_later_frames(std::size_t most_bytes) {
  const std::vector<std::string> lights = lights_of(results_);
  const std::size_t count = (results_.frames.size() - 1) * (lights.size() + kBudgets.size() * results_.methods.size());
  const double pixels = static_cast<double>(count) * results_.width * results_.height;
  int reduction = 1;
  while (0.12 * pixels / (reduction * reduction) > static_cast<double>(most_bytes)) ++reduction;
  const auto keep = [&](const std::string& key, const std::optional<RgbImage>& image) {
    if (image) add(key, reduced(companded(*image, gain()), reduction), false);
  };
  for (std::size_t f = 1; f < results_.frames.size(); ++f) {
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const Reference* reference = reference_of(lights[l], results_.frames[f]);
      if (reference)
        keep(reference_key(l, f), load(reference_key(l, f), reference->file));
      else
        missing_[reference_key(l, f)] = "not rendered yet";
    }
    for (std::size_t m = 0; m < results_.methods.size(); ++m)
      for (const Budget budget : kBudgets)
        keep(image_key(static_cast<int>(m), budget, f), load_stage(static_cast<int>(m), budget, f));
  }
}

void ViewerBuilder::add_json_pictures(const EncodedPictures& encoded, const std::vector<std::string>& keys,
                                      ViewerData& data) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i >= encoded.pictures.size()) {
      missing_[keys[i]] = "too large for this report";
      continue;
    }
    const EncodedPicture& picture = encoded.pictures[i];
    pictures_[keys[i]] = {{"id", fmt::format("picture-{}", data.pictures.size())},
                          {"w", picture.width},
                          {"h", picture.height},
                          {"type", picture.type}};
    data.pictures.push_back(base64(picture.bytes));
  }
}

ViewerData ViewerBuilder::build(std::size_t most_bytes) {
  const std::vector<std::string> lights = lights_of(results_);
  for (std::size_t l = 0; l < lights.size(); ++l) add_light(l, lights[l]);
  const bool sequence = results_.frames.size() > 1;
  const std::size_t limit = most_bytes / 4 * 3;  // base64 has four bytes for three
  const EncodedPictures first = encode_within(first_, sequence ? limit / 5 * 2 : limit);
  ViewerData data;
  data.embedded = fmt::format("Pictures are embedded as {}", first.encoding.text());
  add_json_pictures(first, first_keys_, data);
  if (sequence) {
    add_later_frames(limit - first.bytes);
    const EncodedPictures later = encode_within(later_, limit - first.bytes);
    if (!later.pictures.empty())
      data.embedded += fmt::format(", those of later frames as {} with {} pixels a row", later.encoding.text(),
                                   later.pictures.front().width);
    add_json_pictures(later, later_keys_, data);
  }
  data.embedded +=
      ", linear RGB x companded to 8 bits by x s / (1 + x s) and the sRGB curve, with s = 2^EV of the comparison. Pixel "
      "values and differences in this page are decoded from them and rounded accordingly; exact values are in the EXR files, "
      "from which all metrics, FLIP maps and bias maps were computed.";
  Json json = {{"width", results_.width},   {"height", results_.height}, {"exposure", results_.exposure_ev},
               {"tone", results_.tone},     {"fps", results_.fps},       {"frames", results_.frames},
               {"seeds", results_.seeds},   {"block", kBiasBlock},       {"budgets", Json::array()},
               {"methods", Json::array()}};
  for (const Budget budget : kBudgets)
    json["budgets"].push_back({{"key", budget_key(budget)}, {"label", budget_label(budget)}});
  for (const Contender& method : results_.methods) json["methods"].push_back({{"name", method.name}});
  json["lights"] = std::move(lights_);
  json["pictures"] = std::move(pictures_);
  json["missing"] = std::move(missing_);
  json["bias"] = std::move(bias_);
  data.json = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  for (std::size_t at = data.json.find('<'); at != std::string::npos; at = data.json.find('<', at))
    data.json.replace(at, 1, "\\u003c");  // it stands inside <script>
  return data;
}

}  // namespace

ViewerData make_viewer_data(const Results& results, const fs::path& folder, std::size_t most_bytes) {
  return ViewerBuilder(results, folder).build(most_bytes);
}

}  // namespace lumigrove
