// What the measurements of real-time stochastic lightcuts share: the scenes with the lights that their trees hold, ways to
// sample these lights, and light at fixed surfaces. The surfaces are those of a few squares of an image of 1280x720
// pixels, so that blocks of pixels that share a cut see as much of a scene as they do in a whole image; camera rays are
// traced once. Errors and times are taken from the same samples.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "frame/explain.h"
#include "frame/frame.h"
#include "metrics/metrics.h"
#include "reproduce.h"
#include "study.h"

namespace lumigrove::bench {

inline constexpr int kImageWidth = 1280, kImageHeight = 720;

// A scene for one of the paper's.
struct Subject {
  const char* scene;
  const char* few_lights;  // the same with so few lights that all can be summed
  bool vpls;               // what the trees hold: virtual point lights of the sun, else the emitters
  bool two_level;          // the paper's trees have two levels here
  float exposure_ev;       // before SSIM
};
inline constexpr Subject kSubjects[] = {{"colonnade", "colonnade", true, false, 2},
                                        {"cornell-lights", "cornell-lights", false, false, 0},
                                        {"towers", "towers", false, false, 0},
                                        {"night-city", "night-city?lights=10000", false, true, 0}};

// A way to choose lights: settings by the part of their keys that follows "direct." or "indirect.".
struct Method {
  std::string name;
  std::vector<std::pair<std::string, std::string>> values;
};

// Of the paper's settings: binary trees without cones, cuts by the nearest point's cosine. Else the program's defaults.
enum class Variant { kPaper, kOurs };
inline constexpr Variant kVariants[] = {Variant::kPaper, Variant::kOurs};
const char* variant_name(Variant variant);

Method uniform_method();
// Perfect trees: with `two_level`, of meshes and over them.
Method perfect_root(Variant variant, bool two_level);
Method perfect_cut(Variant variant, bool two_level);
// Merged from nearest pairs, with cones, as the paper's unbalanced trees.
Method unbalanced_root();
Method unbalanced_cut(Variant variant);
// Adaptive tree splitting. `splits`: every surface into as many parts as the threshold asks for; else samples of the whole
// tree, as the paper counts them.
Method ats(bool splits);

// `method` with other values.
Method with(Method method, const std::string& name,
            const std::vector<std::pair<std::string, std::string>>& values);

// Settings of a subject: pixel centres, an image of kImageWidth x kImageHeight. Throws Error when the program has no such
// setting, or refuses the combination.
Settings subject_settings(const Subject& subject, const Method& method, int spp);
// What the program says against it; empty when all is well.
std::string why_missing(const Subject& subject, const Method& method, int spp);

// A method with its number of samples. One light sample each: nodes of a cut, or walks; with splitting, for each part.
struct Entry {
  Method method;
  int spp = 8;

  bool uses_cuts() const;
};

// What was found of an entry, one value an image.
struct Measured {
  Entry entry;
  std::string missing;                // why there is nothing
  std::vector<double> squared;        // mean squared error, linear RGB
  std::vector<double> squared_block;  // of the means of 2x2 pixels
  std::vector<double> ssim;           // tone-mapped
  std::vector<double> ms;             // choosing lights, tracing shadow rays, shading; scaled to all pixels
  std::vector<double> cut_share;      // of that time, selection of cuts
  double rays = 0;                    // shadow rays a pixel

  bool ok() const { return missing.empty(); }
  // Light samples a pixel; with splitting, as their number varies, shadow rays.
  double samples() const;
  double ms_median() const;
  // Mean squared error times time: ratios of it are those of errors at equal time, as the error of independent samples
  // falls with their number.
  std::vector<double> cost() const;
};

struct Tile {
  PixelWindow window;
  SeenSurfaces seen;
};

// Light at the surfaces of all tiles: one square below the other, row by row.
struct TileLight {
  RgbImage light;
  double wall_ms = 0, cut_share = 0;
  std::uint64_t rays = 0;
};

// A subject's scene, its worlds, one for every tree, and its surfaces.
class SubjectStudy {
 public:
  // `tile_size`: edge of each of 16 squares.
  SubjectStudy(const Subject& subject, bool few_lights, int tile_size);

  // Loaded once, with all lights and squares of 64x64 pixels; checks share it.
  static SubjectStudy& of(const Subject& subject);

  const Subject& subject() const { return subject_; }
  const std::vector<Tile>& tiles() const { return tiles_; }
  const World& world(const Settings& settings);
  World& mutable_world(const Settings& settings);
  std::size_t lights(const World& world) const;
  int vpls_asked() const;  // of indirect.vpls
  const Scene& scene() const { return scene_; }

  // Image number `image`, the key of its random numbers.
  TileLight sample(const Settings& settings, int image);
  // The mean of `images` images, made of tiles, and the variance of a value of it.
  struct Converged {
    RgbImage light;
    double variance = 0, block_variance = 0;
  };
  Converged converge(const Settings& settings, int first, int images);

  // Entries take turns, image by image; the first image of each is not timed.
  std::vector<Measured> measure(const std::vector<Entry>& entries, int images);

 private:
  void make_tiles(int size);
  const Converged& reference();
  RgbImage tone_mapped_tile(const RgbImage& light, std::size_t tile) const;
  double mean_ssim(const RgbImage& light) const;

  Subject subject_;
  bool few_lights_;
  int tile_size_;
  Scene scene_;
  std::map<std::string, std::unique_ptr<World>> worlds_;
  std::vector<Tile> tiles_;
  std::unique_ptr<Converged> reference_;
};

// Ratio of mean squared errors, at equal samples or at equal time; of images of equal numbers.
Estimate mse_ratio(const Measured& a, const Measured& b);
Estimate equal_time_ratio(const Measured& a, const Measured& b);

// A relation that is not measured yet, with the reason.
Relation missing_relation(int check, const std::string& scene, const std::string& what,
                          const std::string& published, const std::string& reason);

// "8 spp, MSE 0.0123, SSIM 0.456, 78.9 ms; a sample: variance 0.098, 12.3 ns"
std::string measured_text(const Measured& measured);

}  // namespace lumigrove::bench
