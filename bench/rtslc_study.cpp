#include "rtslc_study.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "base/stopwatch.h"
#include "bench.h"
#include "device/device.h"

namespace lumigrove::bench {
namespace {

constexpr int kTilesAlongSide = 4;
constexpr int kTileSize = 64;
constexpr int kTileAlign = 32;     // so that blocks of any size lie in one tile
constexpr int kManyVpls = 200000;  // paths of colonnade's sun leave half as many VPLs
constexpr int kFewVpls = 20000;
constexpr int kReferenceSpp = 32, kReferenceImages = 32;
constexpr int kReferenceNumber = 1 << 20;  // beyond the numbers of the images that are compared with it

// Cuts of virtual point lights are looked up as those of emitters are.
template <class Lighting>
void set_window(Lighting& lighting, const PixelWindow& window) {
  if constexpr (requires { lighting.light_tree; })
    lighting.light_tree.set_window(window);
  else
    lighting.set_window(window);
}

// What buffers have counted since they were made.
struct Counters {
  double cut_ms = 0, ms = 0;
  std::uint64_t rays = 0;

  Counters& operator+=(const Counters& other) {
    cut_ms += other.cut_ms;
    ms += other.ms;
    rays += other.rays;
    return *this;
  }
};

template <class Buffers>
Counters counters_of(const Buffers& b) {
  Counters counters{0, b.select_ms + b.trace_ms, b.rays};
  if constexpr (requires { b.cut_ms; }) counters += {b.cut_ms, b.cut_ms + b.pool_ms + b.split_ms, 0};
  if constexpr (requires { b.light_tree.cut_ms; }) counters += counters_of(b.light_tree);
  return counters;
}

bool is_setting(const std::string& key) {
  const auto& table = settings_table();
  return std::any_of(table.begin(), table.end(), [&](const SettingInfo& info) { return info.key == key; });
}

RgbImage means_of(const std::vector<Mean>& values, RgbImage like) {
  for (std::size_t i = 0; i < values.size(); ++i) like.rgb[i] = static_cast<float>(values[i].mean());
  return like;
}

// Means of squares of 2x2 pixels.
RgbImage halved(const RgbImage& image) {
  RgbImage result{image.width / 2, image.height / 2, {}, image.name};
  result.rgb.reserve(image.rgb.size() / 4);
  const auto at = [&](int x, int y, int channel) {
    return image.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(x)) +
                     static_cast<std::size_t>(channel)];
  };
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x)
      for (int c = 0; c < 3; ++c)
        result.rgb.push_back(0.25f * (at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) +
                                      at(2 * x, 2 * y + 1, c) + at(2 * x + 1, 2 * y + 1, c)));
  return result;
}

double squared_error(const RgbImage& reference, double reference_variance, const RgbImage& test) {
  const double error = rmse(reference, test);
  return error * error - reference_variance;
}

// The last value given for a key; empty where there is none.
std::string value_of(const Method& method, const std::string& key) {
  std::string found;
  for (const auto& [name, value] : method.values)
    if (name == key) found = value;
  return found;
}

}  // namespace

// --- methods ---------------------------------------------------------------------------------------------------

const char* variant_name(Variant variant) { return variant == Variant::kPaper ? "as the paper" : "ours"; }

Method with(Method method, const std::string& name,
            const std::vector<std::pair<std::string, std::string>>& values) {
  method.name = name;
  method.values.insert(method.values.end(), values.begin(), values.end());
  return method;
}

Method uniform_method() { return {"uniform", {{"selection", "uniform"}, {"hierarchy", "none"}}}; }

Method perfect_root(Variant variant, bool two_level) {
  const bool paper = variant == Variant::kPaper;
  return {"perfect tree",
          {{"selection", "root"},
           {"hierarchy", two_level ? "two-level" : "perfect"},
           {"weights", "min-max"},
           {"width", paper ? "2" : "16"},
           {"cones", paper ? "false" : "true"}}};
}

Method perfect_cut(Variant variant, bool two_level) {
  return with(perfect_root(variant, two_level), "perfect tree, cuts",
              {{"selection", "cut"},
               {"cut_share", "8"},
               {"cut_bound", variant == Variant::kPaper ? "nearest" : "children"}});
}

Method unbalanced_root() {
  return {"unbalanced tree",
          {{"selection", "root"}, {"hierarchy", "agglomerative"}, {"weights", "min-max"}, {"cones", "true"}}};
}

Method unbalanced_cut(Variant variant) {
  return with(unbalanced_root(), "unbalanced tree, cuts",
              {{"selection", "cut"},
               {"cut_share", "8"},
               {"cut_bound", variant == Variant::kPaper ? "nearest" : "children"}});
}

Method ats(bool splits) {
  return {splits ? "ats" : "SAOH tree",
          {{"selection", "root"},
           {"hierarchy", "saoh"},
           {"weights", "saoh"},
           {"split", splits ? "0.75" : "0"},
           {"split_cap", "16"}}};
}

Settings subject_settings(const Subject& subject, const Method& method, int spp) {
  Settings settings = make_preset("uniform");
  settings.width = kImageWidth;
  settings.height = kImageHeight;
  settings.jitter = false;
  if (subject.vpls) {
    settings.force_diffuse = true;
    settings.indirect.transport = Transport::kVpl;
    settings.indirect.keep_vpls = true;
    settings.indirect.stop = Stop::kLeaf;
  }
  const std::string group = subject.vpls ? "indirect." : "direct.";
  // One sample below each node, as in the paper.
  const bool paper = std::any_of(method.values.begin(), method.values.end(),
                                 [](const auto& value) { return value.second == "nearest"; });
  if (paper && is_setting(group + "cut_nodes")) set_value(settings, group + "cut_nodes", "0");
  for (const auto& [key, value] : method.values) set_value(settings, group + key, value);
  set_value(settings, group + "spp", std::to_string(spp));
  check(settings);
  return settings;
}

std::string why_missing(const Subject& subject, const Method& method, int spp) {
  try {
    subject_settings(subject, method, spp);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

bool Entry::uses_cuts() const { return value_of(method, "selection") == "cut"; }

double Measured::samples() const {
  const std::string split = value_of(entry.method, "split"),
                    interleave = value_of(entry.method, "cut_interleave");
  if (!split.empty() && split != "0") return rays;
  const int m = interleave.empty() || !entry.uses_cuts() ? 1 : std::stoi(interleave);
  return static_cast<double>(entry.spp) / (m * m);
}

double Measured::ms_median() const { return median(ms); }

std::vector<double> Measured::cost() const {
  std::vector<double> result = squared;
  const double time = ms_median();
  for (double& value : result) value *= time;
  return result;
}

// --- a subject -------------------------------------------------------------------------------------------------

SubjectStudy::SubjectStudy(const Subject& subject, bool few_lights, int tile_size)
    : subject_(subject),
      few_lights_(few_lights),
      tile_size_(tile_size),
      scene_(load_scene(few_lights ? subject.few_lights : subject.scene)) {
  make_tiles(tile_size);
}

SubjectStudy& SubjectStudy::of(const Subject& subject) {
  static std::map<std::string, SubjectStudy> all;
  return all.try_emplace(subject.scene, subject, false, kTileSize).first->second;
}

World& SubjectStudy::mutable_world(const Settings& settings) {
  const std::string group = subject_.vpls ? "indirect." : "direct.";
  const bool tree = get_value(settings, group + "hierarchy") != "none";
  std::string key = tree ? "" : "no tree";
  for (const char* name : {"hierarchy", "width", "cones", "weights"})
    if (tree && is_setting(group + name)) key += get_value(settings, group + name) + ' ';
  auto& world = worlds_[key];
  if (!world) {
    RenderStats stats;
    Settings made = settings;
    made.indirect.vpls = vpls_asked();
    world = make_world(scene_, made, stats);
    trace_vpls(*world, made, 0, stats);
  }
  return *world;
}

const World& SubjectStudy::world(const Settings& settings) { return mutable_world(settings); }

std::size_t SubjectStudy::lights(const World& world) const {
  return subject_.vpls ? world.vpls.view().vpls.size() : world.lights.view().emitters.size();
}

int SubjectStudy::vpls_asked() const { return few_lights_ ? kFewVpls : kManyVpls; }

void SubjectStudy::make_tiles(int size) {
  const Settings settings = subject_settings(subject_, uniform_method(), 1);
  const World& seen = world(settings);
  const auto start = [&](int i, int length) {
    const int centre = (2 * i + 1) * length / (2 * kTilesAlongSide);
    return (centre - size / 2) / kTileAlign * kTileAlign;
  };
  for (int j = 0; j < kTilesAlongSide; ++j)
    for (int i = 0; i < kTilesAlongSide; ++i) {
      const int x = start(i, settings.width), y = start(j, settings.height);
      const PixelWindow window{x, y, x + size, y + size};
      tiles_.push_back({window, see_surfaces(seen, settings, window, false)});
    }
}

TileLight SubjectStudy::sample(const Settings& settings, int image) {
  struct Buffers {
    DirectBuffers direct;
    IndirectBuffers indirect;
    std::vector<vec3> light;
  };
  static tbb::enumerable_thread_specific<Buffers> all_buffers;  // warm from image to image
  const World& world = this->world(settings);
  const DirectLighting direct = make_direct_lighting(world, settings, image);
  const IndirectLighting indirect = make_indirect_lighting(world, settings, image);
  TileLight result;
  result.light = {tile_size_, tile_size_ * static_cast<int>(tiles_.size()), {}, subject_.scene};
  result.light.rgb.resize(3 * static_cast<std::size_t>(result.light.width) *
                          static_cast<std::size_t>(result.light.height));
  const auto count = [&] {
    Counters sum;
    for (const Buffers& b : all_buffers) (sum += counters_of(b.direct)) += counters_of(b.indirect);
    return sum;
  };
  const Counters before = count();
  const Stopwatch watch;
  launch(
      static_cast<int>(tiles_.size()),
      [&](int t) {
        tbb::this_task_arena::isolate([&] {
          const Tile& tile = tiles_[static_cast<std::size_t>(t)];
          Buffers& b = all_buffers.local();
          b.light.assign(tile.seen.surfaces.size(), vec3(0));
          if (subject_.vpls) {
            IndirectLighting of_tile = indirect;
            set_window(of_tile, tile.window);
            add_indirect_light(of_tile, tile.seen.surfaces, tile.seen.pixels, kDimIndirect, b.indirect,
                               b.light);
          } else {
            DirectLighting of_tile = direct;
            set_window(of_tile, tile.window);
            add_direct_light(of_tile, tile.seen.surfaces, tile.seen.pixels, kDimLight, b.direct, b.light);
          }
          for (std::size_t i = 0; i < b.light.size(); ++i) {
            const Pixel pixel = pixel_of_index(tile.window, static_cast<int>(i));
            const int row = t * tile_size_ + pixel.y - tile.window.y0;
            const auto at = 3 * static_cast<std::size_t>(row * tile_size_ + pixel.x - tile.window.x0);
            for (int c = 0; c < 3; ++c) result.light.rgb[at + static_cast<std::size_t>(c)] = b.light[i][c];
          }
        });
      },
      1);
  result.wall_ms = watch.ms();
  const Counters after = count();
  result.cut_share = (after.cut_ms - before.cut_ms) / (after.ms - before.ms);
  result.rays = after.rays - before.rays;
  return result;
}

SubjectStudy::Converged SubjectStudy::converge(const Settings& settings, int first, int images) {
  std::vector<Mean> values, blocks;
  RgbImage like, block;
  for (int image = 0; image < images; ++image) {
    like = sample(settings, first + image).light;
    block = halved(like);
    add_to(values, like);
    add_to(blocks, block);
  }
  return {means_of(values, like), mean_variance(values), mean_variance(blocks)};
}

const SubjectStudy::Converged& SubjectStudy::reference() {
  if (!reference_) {
    const Settings settings = subject_settings(subject_, perfect_cut(Variant::kOurs, false), kReferenceSpp);
    reference_ = std::make_unique<Converged>(converge(settings, kReferenceNumber, kReferenceImages));
    fmt::print(stderr, "  reference of {}: standard error {:.2g}\n", subject_.scene,
               std::sqrt(reference_->variance));
  }
  return *reference_;
}

RgbImage SubjectStudy::tone_mapped_tile(const RgbImage& light, std::size_t tile) const {
  const auto values = 3 * static_cast<std::ptrdiff_t>(tile_size_) * tile_size_;
  const auto first = light.rgb.begin() + static_cast<std::ptrdiff_t>(tile) * values;
  return {tile_size_, tile_size_,
          tone_map({first, first + values}, {subject_.exposure_ev, ToneCurve::kFilmic}), light.name};
}

double SubjectStudy::mean_ssim(const RgbImage& light) const {
  std::vector<double> values(tiles_.size());
  launch(
      static_cast<int>(tiles_.size()),
      [&](int tile) {
        const auto t = static_cast<std::size_t>(tile);
        values[t] = ssim(tone_mapped_tile(reference_->light, t), tone_mapped_tile(light, t));
      },
      1);
  return mean_of(values).value;
}

std::vector<Measured> SubjectStudy::measure(const std::vector<Entry>& entries, int images) {
  std::vector<Measured> results;
  for (const Entry& entry : entries) {
    Measured& result = results.emplace_back();
    result.entry = entry;
    result.missing = why_missing(subject_, entry.method, entry.spp);
  }
  const std::string no_reference = why_missing(subject_, perfect_cut(Variant::kOurs, false), kReferenceSpp);
  for (Measured& result : results)
    if (result.ok()) result.missing = no_reference;
  if (!no_reference.empty()) return results;

  const Converged& truth = reference();
  const RgbImage truth_blocks = halved(truth.light);
  const double pixels = tile_size_ * tile_size_ * static_cast<double>(tiles_.size());
  const double scale = kImageWidth * kImageHeight / pixels;
  for (int image = 0; image < images; ++image)
    for (Measured& result : results) {
      if (!result.ok()) continue;
      const TileLight drawn =
          sample(subject_settings(subject_, result.entry.method, result.entry.spp), image);
      result.squared.push_back(squared_error(truth.light, truth.variance, drawn.light));
      result.squared_block.push_back(squared_error(truth_blocks, truth.block_variance, halved(drawn.light)));
      result.ssim.push_back(mean_ssim(drawn.light));
      if (image > 0) {
        result.ms.push_back(drawn.wall_ms * scale);
        result.cut_share.push_back(drawn.cut_share);
      }
      result.rays += static_cast<double>(drawn.rays) / (pixels * images);
    }
  return results;
}

// --- relations -------------------------------------------------------------------------------------------------

Estimate mse_ratio(const Measured& a, const Measured& b) { return ratio_of_means(a.squared, b.squared); }

Estimate equal_time_ratio(const Measured& a, const Measured& b) { return ratio_of_means(a.cost(), b.cost()); }

Relation missing_relation(int check, const std::string& scene, const std::string& what,
                          const std::string& published, const std::string& reason) {
  return {check, scene, what, published, std::nan(""), 0, {}, {}, "not measured: " + reason};
}

std::string measured_text(const Measured& m) {
  const double samples = m.samples(), mse = mean_of(m.squared).value;
  return fmt::format("{} spp, MSE {:.4g}, SSIM {:.3f}, {:.0f} ms; a {}: variance {:.3g}, {:.0f} ns",
                     m.entry.spp, mse, mean_of(m.ssim).value, m.ms_median(),
                     samples == m.rays ? "shadow ray" : "sample", mse * samples,
                     m.ms_median() * 1e6 / (samples * kImageWidth * kImageHeight));
}

}  // namespace lumigrove::bench
