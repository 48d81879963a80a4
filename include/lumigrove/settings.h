// What a render is asked for. Every field has a dotted key ("direct.spp") in the table of src/frame/registry.cpp,
// which is what --set, --settings FILE.toml, `lumigrove list settings` and receipts go through.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lumigrove/error.h"
#include "lumigrove/vec.h"

namespace lumigrove {

// The axes of the space of methods (docs/papers.md); the table in registry.cpp holds their names.
enum class Hierarchy : std::uint8_t { kNone, kPerfect, kTwoLevel, kSaoh, kAgglomerative, kSubstitute };
enum class Weights : std::uint8_t { kMinMax, kSaoh, kYuksel, kDistanceBounded, kInBox };
enum class Selection : std::uint8_t { kUniform, kPower, kRoot, kAll, kCut, kPool };
enum class CutBound : std::uint8_t { kNearest, kExact, kChildren };
enum class Transport : std::uint8_t { kNone, kPath, kVpl };
enum class Topology : std::uint8_t { kRadix, kPerfect };
enum class Stop : std::uint8_t { kLeaf, kSubstitute };

// How lights are chosen, and what they are chosen from.
struct SelectionSettings {
  Selection selection = Selection::kRoot;
  Hierarchy hierarchy = Hierarchy::kPerfect;  // needed by kRoot and kCut
  Weights weights = Weights::kMinMax;
  int width = 16;               // kPerfect, kTwoLevel: children a node: 2 (as the paper), 4, 8, 16
  bool cones = true;            // weights bound the lights' own cosine (the paper's do not)
  int spp = 1;                  // light samples for each camera sample
  // Cuts (kCut): spp is the number of a cut's nodes, at most 32, each sampled once
  int cut_share = 8;            // k: blocks of k x k pixels share a cut; 1 = a cut for every pixel
  int cut_interleave = 1;       // m: the pixels of m x m share out a cut's nodes
  float cut_floor = 0.001f;     // least distance in the bound, in units of the diagonal of the lights' box
  CutBound cut_bound = CutBound::kChildren;
  // Pools (kPool): areas of (cut_share * cut_interleave)^2 pixels share cut_interleave^2 / 2 pools
  int pool = 64;                // lights of a pool, of which every pixel takes spp: 16, 32, 48, 64
  // Adaptive tree splitting (kSaoh, kAgglomerative)
  float split = 0;              // threshold: one sample below each part of a split tree; 0 = no splitting
  int split_cap = 16;           // most parts, at most 64
};

// Light that reaches a surface straight from an emitter.
struct DirectSettings : SelectionSettings {
  bool mis = false;             // combine with BSDF sampling (balance heuristic)
};

// Light that reaches a surface from other surfaces. Lengths are in units of the scene's diagonal D. The selection is among
// virtual point lights (kVpl).
struct IndirectSettings : SelectionSettings {
  IndirectSettings() {
    hierarchy = Hierarchy::kSubstitute;
    weights = Weights::kDistanceBounded;
    cones = false;
  }

  Transport transport = Transport::kNone;
  int max_bounces = 4;          // kPath: indirect bounces; 0 = none
  int roulette_start = 3;       // first bounce that Russian roulette may end
  // Virtual point lights (kVpl)
  int vpls = 100000;            // most lights: paths times bounces
  int bounces = 3;              // lights that one path leaves at most; 1 = first bounce only
  bool keep_vpls = false;       // the same lights for every camera sample; otherwise new ones for each
  float clamp = 215;            // G_max: most of cos / d^2, in units of 1 / D^2; 0 = no clamp
  bool gloss = true;            // gloss lobes are lit too
  bool joint = false;           // emitters and virtual point lights are one set, chosen from as DirectSettings say
  // The substitute tree (kSubstitute)
  Topology topology = Topology::kRadix;
  float distance_floor = 0.048f;  // epsilon: least distance in the weights, kDistanceBounded
  Stop stop = Stop::kSubstitute;
  float min_nu = 0.5f;          // nu_min: least agreement of normals
  float max_sigma = 0.0216f;    // sigma_max: most deviation along the normal
  float max_diagonal = 0;       // tau_max: most diagonal of the lights' box; 0 = any
  float correction = 0;         // probability of correcting a substitute by a leaf; above 0: no bias
  bool show = false;            // layers that show the walks
  // Beyond the trees
  float mirror_roughness = 0;   // gloss of surfaces at most this rough goes on by one ray; 0 = none
  bool compensate = false;      // light lost to the clamp is found by one short ray
};

struct ViewSettings {           // replaces the scene's camera when set (Embree's names)
  vec3 position = vec3(0), look_at = vec3(0, 0, -1), up = vec3(0, 1, 0);
};

struct Settings {
  std::string preset = "tree";  // the row these settings started from
  int width = 1280, height = 720;
  std::optional<std::array<int, 4>> pixel_bounds;  // x0,x1,y0,y1 half-open, as pbrt; others stay black
  int spp = 1;                  // camera samples a pixel
  std::uint32_t seed = 0;
  int frame = 0;                // second key of the random numbers; animation frame number
  double time = 0;              // seconds
  int threads = 0;              // 0 = all cores
  std::string camera;           // name, empty = the scene's first
  std::optional<ViewSettings> view;
  std::optional<float> fov;     // vertical, degrees
  float light_scale = 1;        // multiplies every emitter
  bool force_diffuse = false;   // drop every specular lobe
  bool ignore_range = false;    // punctual lights reach infinitely far
  bool jitter = true;           // uniform position inside the pixel; otherwise its centre
  DirectSettings direct;
  IndirectSettings indirect;
};

struct PresetInfo {
  std::string name, description, citation;
  std::vector<std::pair<std::string, std::string>> values;  // key, value applied over the defaults
  bool reference = false;  // the one that all others are measured against; one row is
};
struct SettingInfo {
  std::string key, type, default_value, unit, description;
  std::vector<std::string> choices;  // of an enumeration
  std::string range;                 // of a number, in words: "from 1 to 65536"
};
const std::vector<PresetInfo>& presets();
const std::vector<SettingInfo>& settings_table();

// Throws Error that names the nearest valid key or the valid values.
void set_value(Settings& settings, const std::string& key, const std::string& value);
std::string get_value(const Settings& settings, const std::string& key);
Settings make_preset(const std::string& name);

// Throws Error for combinations that make no sense, in one sentence.
void check(const Settings& settings);

}  // namespace lumigrove
