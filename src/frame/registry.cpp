// The two visible tables of the program: what can be set, and which sets of values have a name.
// Nothing else in the program knows a preset's name.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "base/nearest.h"
#include "frame/value_text.h"
#include "lumigrove/settings.h"
#include "methods/light_bvh/light_bvh_kernel.h"
#include "methods/light_sampling/light_pool_kernel.h"
#include "methods/lightcuts/cut_kernel.h"

namespace lumigrove {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr double kLargestInt = std::numeric_limits<int>::max();
constexpr int kLargestSide = 65536;              // pixels
constexpr std::int64_t kLargestImage = 1 << 28;  // pixels; every layer needs 4 to 16 bytes for each
constexpr const char* kUnset = "none";           // text of an optional setting without value

// One row: what is told about a setting, and how it is read and written.
struct Setting {
  SettingInfo info;
  std::function<std::string(const Settings&)> get;
  std::function<void(Settings&, const std::string&)> set;
};

// Each row builder below takes `member`, a generic lambda from (const) Settings& to a reference of the field.

template <class Member>
Setting integer(const std::string& key, Member member, Range range, const std::string& unit,
                const std::string& description) {
  return {{key, "int", "", unit, description, {}, describe(range)},
          [=](const Settings& s) { return std::to_string(member(s)); },
          [=](Settings& s, const std::string& text) {
            member(s) = static_cast<std::decay_t<decltype(member(s))>>(parse_integer(key, text, range));
          }};
}

template <class Member>
Setting real(const std::string& key, Member member, Range range, const std::string& unit,
             const std::string& description) {
  return {{key, "float", "", unit, description, {}, describe(range)},
          [=](const Settings& s) { return print(member(s)); },
          [=](Settings& s, const std::string& text) {
            if constexpr (std::is_same_v<std::decay_t<decltype(member(s))>, float>)
              member(s) = parse_float(key, text, range);
            else
              member(s) = parse_double(key, text, range);
          }};
}

template <class Member>
Setting flag(const std::string& key, Member member, const std::string& description) {
  return {{key, "bool", "", "", description, {"true", "false"}, ""},
          [=](const Settings& s) { return print(member(s)); },
          [=](Settings& s, const std::string& text) { member(s) = parse_bool(key, text); }};
}

template <class Member>
Setting text(const std::string& key, Member member, const std::string& description) {
  return {{key, "text", "", "", description, {}, ""},
          [=](const Settings& s) { return member(s); },
          [=](Settings& s, const std::string& value) { member(s) = value; }};
}

// An enumeration (or a small set of numbers): `names` and `values` in the same order.
template <class Member, class Value>
Setting choice(const std::string& key, Member member,
               const std::vector<std::pair<std::string, Value>>& values, const std::string& description) {
  SettingInfo info{key, "choice", "", "", description, {}, ""};
  for (const auto& [name, value] : values) info.choices.push_back(name);
  return {info,
          [=](const Settings& s) {
            for (const auto& [name, value] : values)
              if (value == member(s)) return name;
            return fmt::format("#{}", static_cast<int>(member(s)));  // not a valid value: `check` refuses it
          },
          [=, names = info.choices](Settings& s, const std::string& text) {
            const auto found = std::find(names.begin(), names.end(), text);
            if (found == names.end())
              refuse_value(key, text, fmt::format("one of {}", fmt::join(names, ", ")));
            member(s) = values[static_cast<std::size_t>(found - names.begin())].second;
          }};
}

// Part of Settings::view: giving one of its vectors creates the view, "none" removes the view.
template <class Member>
Setting view_vector(const std::string& key, Member member, const std::string& unit,
                    const std::string& description) {
  return {{key, "vec3", "", unit, description, {}, "three numbers 'x,y,z', or none"},
          [=](const Settings& s) { return s.view ? print(member(*s.view)) : std::string(kUnset); },
          [=](Settings& s, const std::string& value) {
            if (value == kUnset) {
              s.view.reset();
              return;
            }
            const vec3 parsed = parse_vec3(key, value);
            if (!s.view) s.view.emplace();
            member(*s.view) = parsed;
          }};
}

Setting preset_row() {
  std::vector<std::string> names;
  for (const PresetInfo& preset : presets()) names.push_back(preset.name);
  return {
      {"preset", "choice", "", "", "Method: sets direct.* and indirect.* as `list methods` shows", names, ""},
      [](const Settings& s) { return s.preset; },
      [](Settings& s, const std::string& value) {
        const Settings row = make_preset(value);
        s.preset = row.preset;
        s.direct = row.direct;
        s.indirect = row.indirect;
      }};
}

Setting pixel_bounds_row() {
  const std::string key = "pixel_bounds";
  return {{key,
           "int4",
           "",
           "pixels",
           "Render only x0 <= x < x1, y0 <= y < y1; other pixels stay black",
           {},
           "four whole numbers 'x0,x1,y0,y1', or none"},
          [](const Settings& s) { return s.pixel_bounds ? print(*s.pixel_bounds) : std::string(kUnset); },
          [=](Settings& s, const std::string& value) {
            if (value == kUnset)
              s.pixel_bounds.reset();
            else
              s.pixel_bounds = parse_int4(key, value);
          }};
}

Setting fov_row() {
  const std::string key = "fov";
  const Range range{0, 180, true};
  return {{key,
           "float",
           "",
           "degrees",
           "Vertical field of view; none = the camera's own",
           {},
           describe(range) + ", or none"},
          [](const Settings& s) { return s.fov ? print(*s.fov) : std::string(kUnset); },
          [=](Settings& s, const std::string& value) {
            if (value == kUnset)
              s.fov.reset();
            else
              s.fov = parse_float(key, value, range);
          }};
}

std::vector<Setting> image_rows() {
  const Range side{1, kLargestSide};
  return {
      integer(
          "width", [](auto& s) -> auto& { return s.width; }, side, "pixels", "Image width"),
      integer(
          "height", [](auto& s) -> auto& { return s.height; }, side, "pixels", "Image height"),
      pixel_bounds_row(),
      integer(
          "spp", [](auto& s) -> auto& { return s.spp; }, {1, 1 << 24}, "samples", "Camera samples a pixel"),
      integer(
          "seed", [](auto& s) -> auto& { return s.seed; }, {0, 4294967295.0}, "",
          "First key of the random numbers"),
      integer(
          "frame", [](auto& s) -> auto& { return s.frame; }, {0, kLargestInt}, "",
          "Frame number, second key of the random numbers"),
      real(
          "time", [](auto& s) -> auto& { return s.time; }, {-kNoLimit, kNoLimit}, "s",
          "Moment of the animation; beyond its ends the first or last pose holds"),
      integer(
          "threads", [](auto& s) -> auto& { return s.threads; }, {0, 1024}, "",
          "Worker threads, 0 = all cores; the image does not depend on it"),
      flag(
          "jitter", [](auto& s) -> auto& { return s.jitter; },
          "Camera samples are spread over the pixel; otherwise all go through its centre"),
  };
}

std::vector<Setting> scene_rows() {
  return {
      text(
          "camera", [](auto& s) -> auto& { return s.camera; },
          "Camera by name; empty = the scene's first, or a view of the whole scene when it has none"),
      view_vector(
          "view.position", [](auto& v) -> auto& { return v.position; }, "m",
          "Eye; a view replaces the scene's camera"),
      view_vector(
          "view.look_at", [](auto& v) -> auto& { return v.look_at; }, "m",
          "Point in the centre of the image"),
      view_vector(
          "view.up", [](auto& v) -> auto& { return v.up; }, "", "Direction that is up in the image"),
      fov_row(),
      real(
          "light_scale", [](auto& s) -> auto& { return s.light_scale; }, {0, kNoLimit}, "",
          "Multiplies the radiance of every emitter"),
      flag(
          "force_diffuse", [](auto& s) -> auto& { return s.force_diffuse; }, "Drop every specular lobe"),
      flag(
          "ignore_range", [](auto& s) -> auto& { return s.ignore_range; },
          "Point and spot lights reach infinitely far"),
  };
}

// What direct.* and indirect.* have in common of walks, cuts and splitting. `of`: generic lambda from (const) Settings& to
// the group.
template <class Group>
std::vector<Setting> selection_rows(const std::string& prefix, Group of) {
  using std::pair;
  using std::string;
  using std::vector;
  return {
      choice(
          prefix + ".width", [=](auto& s) -> auto& { return of(s).width; },
          vector<pair<string, int>>{{"2", 2}, {"4", 4}, {"8", 8}, {"16", 16}},
          "Children of a node of the hierarchies perfect and two-level"),
      flag(
          prefix + ".cones", [=](auto& s) -> auto& { return of(s).cones; },
          "Weights also bound the cosine at the lights, so that those facing away are left out"),
      integer(
          prefix + ".spp", [=](auto& s) -> auto& { return of(s).spp; }, {1, 4096}, "samples",
          "Light samples for each camera sample"),
      choice(
          prefix + ".pool", [=](auto& s) -> auto& { return of(s).pool; },
          std::vector<std::pair<std::string, int>>{{"16", 16}, {"32", 32}, {"48", 48}, {"64", 64}},
          fmt::format("Lights of a pool, drawn below the nodes of an area's cut; every pixel takes {0}.spp of them. Areas are "
                      "cut_share x cut_interleave pixels wide and have cut_interleave^2 / 2 pools",
                      prefix)),
      integer(
          prefix + ".cut_share", [=](auto& s) -> auto& { return of(s).cut_share; }, {1, 64}, "pixels",
          fmt::format("Edge of the blocks of pixels that share a cut; {}.spp is the number of the cut's nodes", prefix)),
      integer(
          prefix + ".cut_interleave", [=](auto& s) -> auto& { return of(s).cut_interleave; }, {1, 8}, "pixels",
          "Edge of the blocks of pixels that share out a cut's nodes among them; 1 = every pixel samples all"),
      real(
          prefix + ".cut_floor", [=](auto& s) -> auto& { return of(s).cut_floor; }, {0, 1, true}, "R",
          "Least distance in the error bound of cuts; R = diagonal of the lights' box"),
      choice(
          prefix + ".cut_bound", [=](auto& s) -> auto& { return of(s).cut_bound; },
          vector<pair<string, CutBound>>{{"nearest", CutBound::kNearest},
                                         {"exact", CutBound::kExact},
                                         {"children", CutBound::kChildren}},
          "Error of a cut's node: by one box around its lights, with the cosine of the box's nearest point or an exact "
          "bound of it; or the sum over the boxes inside it"),
      real(
          prefix + ".split", [=](auto& s) -> auto& { return of(s).split; }, {0, 1}, "",
          "Threshold of adaptive tree splitting: a light sample below each part of the tree; larger = more parts, 0 = no "
          "splitting (hierarchies saoh and agglomerative)"),
      integer(
          prefix + ".split_cap", [=](auto& s) -> auto& { return of(s).split_cap; }, {1, kMaxSplit}, "samples",
          "Most parts that the tree is split into at a surface"),
  };
}

std::vector<Setting> direct_rows() {
  using std::pair;
  using std::string;
  using std::vector;
  return {
      choice(
          "direct.selection", [](auto& s) -> auto& { return s.direct.selection; },
          vector<pair<string, Selection>>{{"uniform", Selection::kUniform},
                                          {"power", Selection::kPower},
                                          {"root", Selection::kRoot},
                                          {"all", Selection::kAll},
                                          {"cut", Selection::kCut},
                                          {"pool", Selection::kPool}},
          "How emitters are chosen: each alike, by flux, walking the hierarchy from its root, all of them, walking it "
          "from every node of a cut, or among lights that were drawn for an area of pixels"),
      choice(
          "direct.hierarchy", [](auto& s) -> auto& { return s.direct.hierarchy; },
          vector<pair<string, Hierarchy>>{{"none", Hierarchy::kNone},
                                          {"perfect", Hierarchy::kPerfect},
                                          {"two-level", Hierarchy::kTwoLevel},
                                          {"saoh", Hierarchy::kSaoh},
                                          {"agglomerative", Hierarchy::kAgglomerative}},
          "Hierarchy over the emitters: halves of their Morton order; the same for every mesh, shared by its instances, and "
          "over these; split by the surface-area-orientation heuristic; merged from nearest pairs (slow to build). The last "
          "two are binary"),
      choice(
          "direct.weights", [](auto& s) -> auto& { return s.direct.weights; },
          vector<pair<string, Weights>>{
              {"min-max", Weights::kMinMax}, {"yuksel", Weights::kYuksel}, {"saoh", Weights::kSaoh}},
          "Weights of a node's children: mean of those at least and at greatest distance; at the least, left out for all "
          "of them when a box is wider than far; or at the centre with bounds of the angles (hierarchies saoh and "
          "agglomerative)"),
      flag(
          "direct.mis", [](auto& s) -> auto& { return s.direct.mis; },
          "Combine light samples with BSDF samples (balance heuristic)"),
  };
}

std::vector<Setting> indirect_rows() {
  using Names = std::vector<std::pair<std::string, Transport>>;
  return {
      choice(
          "indirect.transport", [](auto& s) -> auto& { return s.indirect.transport; },
          Names{{"none", Transport::kNone}, {"path", Transport::kPath}, {"vpl", Transport::kVpl}},
          "How light from other surfaces is found: not at all, by paths, or by virtual point lights (VPLs)"),
      integer(
          "indirect.max_bounces", [](auto& s) -> auto& { return s.indirect.max_bounces; }, {0, 1024},
          "bounces", "Most indirect bounces of a path, 0 = direct light only"),
      integer(
          "indirect.roulette_start", [](auto& s) -> auto& { return s.indirect.roulette_start; }, {0, 1024},
          "bounces", "First bounce that Russian roulette may end"),
  };
}

// Virtual point lights: how they are traced and chosen.
std::vector<Setting> vpl_rows() {
  using std::pair;
  using std::string;
  using std::vector;
  return {
      integer(
          "indirect.vpls", [](auto& s) -> auto& { return s.indirect.vpls; }, {1, 1 << 24}, "VPLs",
          "Most VPLs: as many paths are traced from the emitters as this over indirect.bounces"),
      integer(
          "indirect.bounces", [](auto& s) -> auto& { return s.indirect.bounces; }, {1, 64}, "bounces",
          "VPLs that one path leaves at most; 1 = light of one indirect bounce"),
      flag(
          "indirect.keep_vpls", [](auto& s) -> auto& { return s.indirect.keep_vpls; },
          "The same VPLs serve every camera sample; otherwise new ones are traced for each"),
      real(
          "indirect.clamp", [](auto& s) -> auto& { return s.indirect.clamp; }, {0, kNoLimit}, "1/D^2",
          "Most of cos/d^2 at a VPL, against bright spots around it; 0 = no clamp"),
      choice(
          "indirect.selection", [](auto& s) -> auto& { return s.indirect.selection; },
          vector<pair<string, Selection>>{{"uniform", Selection::kUniform},
                                          {"power", Selection::kPower},
                                          {"root", Selection::kRoot},
                                          {"all", Selection::kAll},
                                          {"cut", Selection::kCut},
                                          {"pool", Selection::kPool}},
          "How VPLs are chosen: each alike, by power, walking the hierarchy from its root, all of them, walking it from "
          "every node of a cut, or among lights that were drawn for an area of pixels"),
      choice(
          "indirect.hierarchy", [](auto& s) -> auto& { return s.indirect.hierarchy; },
          vector<pair<string, Hierarchy>>{{"none", Hierarchy::kNone},
                                          {"substitute", Hierarchy::kSubstitute},
                                          {"perfect", Hierarchy::kPerfect},
                                          {"saoh", Hierarchy::kSaoh},
                                          {"agglomerative", Hierarchy::kAgglomerative}},
          "Hierarchy over the VPLs: the substitute tree, or one of the light trees of direct.hierarchy"),
      choice(
          "indirect.topology", [](auto& s) -> auto& { return s.indirect.topology; },
          vector<pair<string, Topology>>{{"radix", Topology::kRadix}, {"perfect", Topology::kPerfect}},
          "Where the substitute tree splits the sorted VPLs: where their codes differ, or in the middle"),
      choice(
          "indirect.weights", [](auto& s) -> auto& { return s.indirect.weights; },
          vector<pair<string, Weights>>{{"distance-bounded", Weights::kDistanceBounded},
                                        {"in-box", Weights::kInBox},
                                        {"yuksel", Weights::kYuksel},
                                        {"min-max", Weights::kMinMax},
                                        {"saoh", Weights::kSaoh}},
          "Weights of a node's children. Substitute tree: by the distance to the mean, bounded from below; the same, left "
          "out inside the box; to the box, left out for both children when one is wider than far. Light trees: as "
          "direct.weights"),
      real(
          "indirect.distance_floor", [](auto& s) -> auto& { return s.indirect.distance_floor; }, {0, 1}, "D",
          "Least distance in the weights of trees over VPLs; 0 = none"),
      flag(
          "indirect.gloss", [](auto& s) -> auto& { return s.indirect.gloss; },
          "VPLs light gloss lobes too (the substitute tree by walks of their own); otherwise only diffuse reflection"),
      flag(
          "indirect.joint", [](auto& s) -> auto& { return s.indirect.joint; },
          "Emitters and VPLs are one set of lights: direct.* then says how lights are chosen from it, and "
          "indirect.selection is not used"),
      choice(
          "indirect.stop", [](auto& s) -> auto& { return s.indirect.stop; },
          vector<pair<string, Stop>>{{"leaf", Stop::kLeaf}, {"substitute", Stop::kSubstitute}},
          "Where walks of the substitute tree end: at one VPL, or at the first node whose Gaussian may stand for its VPLs"),
      real(
          "indirect.min_nu", [](auto& s) -> auto& { return s.indirect.min_nu; }, {0, 1}, "",
          "Least agreement of the normals below a substitute"),
      real(
          "indirect.max_sigma", [](auto& s) -> auto& { return s.indirect.max_sigma; }, {0, kNoLimit}, "D",
          "Most standard deviation along the normal of a substitute"),
      real(
          "indirect.max_diagonal", [](auto& s) -> auto& { return s.indirect.max_diagonal; }, {0, kNoLimit}, "D",
          "Most diagonal of a substitute's box; 0 = any"),
      real(
          "indirect.correction", [](auto& s) -> auto& { return s.indirect.correction; }, {0, 1}, "",
          "Probability of correcting a substitute by one of its VPLs, at the cost of a second shadow ray; above 0 the "
          "substitutes leave no bias"),
      real(
          "indirect.mirror_roughness", [](auto& s) -> auto& { return s.indirect.mirror_roughness; }, {0, 1}, "",
          "Gloss of surfaces at most this rough follows one ray and is lit where that arrives; 0 = none"),
      flag(
          "indirect.compensate", [](auto& s) -> auto& { return s.indirect.compensate; },
          "Light lost to the clamp is found by one short ray"),
      flag(
          "indirect.show", [](auto& s) -> auto& { return s.indirect.show; },
          "More layers: steps of the walks, sizes of the substitutes, what was clamped"),
  };
}

const std::vector<Setting>& settings() {
  static const std::vector<Setting> rows = [] {
    std::vector<Setting> all{preset_row()};
    const auto direct = selection_rows("direct", [](auto& s) -> auto& { return s.direct; });
    const auto indirect = selection_rows("indirect", [](auto& s) -> auto& { return s.indirect; });
    for (const auto& group :
         {image_rows(), scene_rows(), direct_rows(), direct, indirect_rows(), vpl_rows(), indirect})
      all.insert(all.end(), group.begin(), group.end());
    for (Setting& row : all) row.info.default_value = row.get(Settings{});
    return all;
  }();
  return rows;
}

const Setting& find_setting(const std::string& key) {
  std::vector<std::string> keys;
  for (const Setting& row : settings()) {
    if (row.info.key == key) return row;
    keys.push_back(row.info.key);
  }
  throw Error(
      fmt::format("unknown setting '{}'; the nearest one is '{}' (`lumigrove list settings` shows all)", key,
                  nearest(key, keys)));
}

// Fields may have been written without set_value: reading each back through its row checks its range.
void check_ranges(const Settings& settings_to_check) {
  Settings copy = settings_to_check;
  for (const Setting& row : settings())
    if (row.info.key != "preset") row.set(copy, row.get(settings_to_check));
}

void check_image(const Settings& s) {
  if (static_cast<std::int64_t>(s.width) * s.height > kLargestImage)
    throw Error(fmt::format("an image of {}x{} pixels is too large; at most {} pixels are possible", s.width,
                            s.height, kLargestImage));
  if (!s.pixel_bounds) return;
  const auto [x0, x1, y0, y1] = *s.pixel_bounds;
  if (x0 < 0 || x1 > s.width || y0 < 0 || y1 > s.height || x0 >= x1 || y0 >= y1)
    throw Error(
        fmt::format("pixel_bounds {},{},{},{} (x0,x1,y0,y1) is empty or leaves the image of {}x{} pixels", x0,
                    x1, y0, y1, s.width, s.height));
}

void check_view(const ViewSettings& view) {
  const vec3 forward = view.look_at - view.position;
  if (!(glm::length(forward) > 0)) throw Error("view.position and view.look_at are the same point");
  if (!(glm::length(view.up) > 0)) throw Error("view.up has no direction");
  const float sine = glm::length(glm::cross(glm::normalize(forward), glm::normalize(view.up)));
  constexpr float kLeastSine = 1e-4f;
  if (!(sine > kLeastSine)) throw Error("view.up is parallel to the viewing direction");
}

bool is_bvh(Hierarchy h) { return h == Hierarchy::kSaoh || h == Hierarchy::kAgglomerative; }

// The checks of a group are given its prefix, "direct" or "indirect".

void check_hierarchy(const std::string& prefix, const SelectionSettings& s) {
  if (s.hierarchy != Hierarchy::kNone) return;
  if (s.selection == Selection::kRoot)
    throw Error(
        fmt::format("{0}.selection 'root' walks a hierarchy, but {0}.hierarchy is 'none'; use 'perfect'", prefix));
  if (s.selection == Selection::kCut)
    throw Error(fmt::format("{0}.selection 'cut' cuts a hierarchy, but {0}.hierarchy is 'none'; use 'perfect'", prefix));
}

void check_cuts(const std::string& prefix, const SelectionSettings& s) {
  if (s.selection != Selection::kCut) return;
  if (s.hierarchy == Hierarchy::kSubstitute)
    throw Error(fmt::format("{0}.selection 'cut' cuts light trees, but {0}.hierarchy is 'substitute'; use 'perfect', 'saoh' "
                            "or 'agglomerative'",
                            prefix));
  if (s.spp > kMaxCut)
    throw Error(fmt::format("a cut has at most {} nodes, but {}.spp is {}", kMaxCut, prefix, s.spp));
}

void check_pools(const std::string& prefix, const SelectionSettings& s) {
  if (s.selection != Selection::kPool) return;
  if (s.hierarchy != Hierarchy::kPerfect)
    throw Error(fmt::format("{0}.selection 'pool' draws its lights from the perfect tree only; set {0}.hierarchy 'perfect'",
                            prefix));
  if (s.cut_interleave > kMaxPoolInterleave)
    throw Error(fmt::format("{0}.selection 'pool' interleaves at most {1} x {1} pixels, but {0}.cut_interleave is {2}",
                            prefix, kMaxPoolInterleave, s.cut_interleave));
}

// Weights that a hierarchy can have, in the words of the rows.
std::vector<std::string> weights_of(Hierarchy h) {
  if (h == Hierarchy::kSubstitute) return {"distance-bounded", "in-box", "yuksel"};
  if (is_bvh(h)) return {"min-max", "yuksel", "saoh"};
  return {"min-max", "yuksel"};
}

void check_weights(const std::string& prefix, const Settings& all, const SelectionSettings& s) {
  const std::string weights = get_value(all, prefix + ".weights"), hierarchy = get_value(all, prefix + ".hierarchy");
  const auto has = [&](Hierarchy h) {
    const std::vector<std::string> valid = weights_of(h);
    return std::find(valid.begin(), valid.end(), weights) != valid.end();
  };
  if (has(s.hierarchy)) return;
  std::string needed = "'perfect', 'saoh' or 'agglomerative'";
  if (has(Hierarchy::kSubstitute)) needed = "'substitute'";
  if (weights == "saoh") needed = "'saoh' or 'agglomerative'";
  throw Error(fmt::format("{0}.weights '{1}' needs {0}.hierarchy {2}; with {0}.hierarchy '{3}' use '{4}'", prefix, weights,
                          needed, hierarchy, fmt::join(weights_of(s.hierarchy), "' or '")));
}

void check_selection(const std::string& prefix, const Settings& all, const SelectionSettings& s) {
  check_hierarchy(prefix, s);
  check_cuts(prefix, s);
  check_pools(prefix, s);
  if (s.selection != Selection::kRoot && s.selection != Selection::kCut && s.selection != Selection::kPool) return;
  check_weights(prefix, all, s);
  if (s.split > 0 && !is_bvh(s.hierarchy))
    throw Error(
        fmt::format("{0}.split needs {0}.hierarchy 'saoh' or 'agglomerative'; for others use 0", prefix));
  if (s.split > 0 && s.selection == Selection::kCut)
    throw Error(fmt::format("{0}.split does not combine with cuts; set {0}.split 0 or {0}.selection 'root'", prefix));
}

void check_joint(const Settings& s) {
  if (s.indirect.transport != Transport::kVpl)
    throw Error(fmt::format("indirect.joint puts VPLs among the lights, but indirect.transport is '{}'; use 'vpl'",
                            get_value(s, "indirect.transport")));
  const bool walks = s.direct.selection == Selection::kRoot || s.direct.selection == Selection::kCut;
  if (s.direct.hierarchy == Hierarchy::kTwoLevel && walks)
    throw Error("indirect.joint needs one tree over all lights, but direct.hierarchy is 'two-level'; use 'perfect', 'saoh' "
                "or 'agglomerative'");
}

void check_vpls(const Settings& all) {
  const IndirectSettings& s = all.indirect;
  if (s.joint) check_joint(all);
  if (s.transport != Transport::kVpl) return;
  if (!s.joint) check_selection("indirect", all, s);
  const bool walks = !s.joint && (s.selection == Selection::kRoot || s.selection == Selection::kCut ||
                                  s.selection == Selection::kPool);
  const bool substitute_tree = walks && s.hierarchy == Hierarchy::kSubstitute;
  if (s.correction > 0 && !(substitute_tree && s.stop == Stop::kSubstitute))
    throw Error("indirect.correction corrects substitutes, but none are used; set indirect.joint false, indirect.selection "
                "'root', indirect.hierarchy 'substitute' and indirect.stop 'substitute', or indirect.correction 0");
  if (s.show && (s.joint || (walks && !substitute_tree)))
    throw Error("indirect.show shows walks of the substitute tree, but none is used; set indirect.joint false and "
                "indirect.hierarchy 'substitute', or indirect.show false");
}

}  // namespace

const std::vector<PresetInfo>& presets() {
  static const std::vector<PresetInfo> table = {
      {"tree",
       "Perfect light tree walked from its root with min/max-distance weights and cones of normals; direct light only",
       "D. Lin, C. Yuksel: Real-Time Stochastic Lightcuts. Proc. ACM Comput. Graph. Interact. Tech. 3(1), "
       "2020, "
       "sections 3.1 and 3.2",
       {{"direct.selection", "root"},
        {"direct.hierarchy", "perfect"},
        {"direct.weights", "min-max"},
        {"indirect.transport", "none"}}},
      {"rtslc",
       "Real-time stochastic lightcuts: a cut of the perfect light tree for every 8x8 pixels, a sample below each of its 8 "
       "nodes; direct light only",
       "D. Lin, C. Yuksel: Real-Time Stochastic Lightcuts. Proc. ACM Comput. Graph. Interact. Tech. 3(1), 2020",
       {{"direct.selection", "cut"},
        {"direct.hierarchy", "perfect"},
        {"direct.weights", "min-max"},
        {"direct.spp", "8"},
        {"direct.cut_share", "8"},
        {"indirect.transport", "none"}}},
      {"pool",
       "Lights drawn for every 16x16 pixels below a cut of the perfect light tree, 8 of them taken by each pixel by what they "
       "would send unoccluded; direct light only",
       "of this project, from D. Lin, C. Yuksel: Real-Time Stochastic Lightcuts, 2020, and J. Talbot, D. Cline, P. Egbert: "
       "Importance Resampling for Global Illumination. EGSR 2005",
       {{"direct.selection", "pool"},
        {"direct.hierarchy", "perfect"},
        {"direct.weights", "min-max"},
        {"direct.spp", "8"},
        {"direct.cut_share", "4"},
        {"direct.cut_interleave", "4"},
        {"indirect.transport", "none"}}},
      {"ats",
       "Adaptive tree splitting: a light BVH built by the surface-area-orientation heuristic, split near each surface, a "
       "sample below each part; direct light only",
       "A. Conty Estevez, C. Kulla: Importance Sampling of Many Lights with Adaptive Tree Splitting. Proc. ACM Comput. "
       "Graph. Interact. Tech. 1(2), 2018; P. Moreau, M. Pharr, P. Clarberg: Dynamic Many-Light Sampling for Real-Time Ray "
       "Tracing. HPG 2019",
       {{"direct.selection", "root"},
        {"direct.hierarchy", "saoh"},
        {"direct.weights", "saoh"},
        {"direct.split", "0.75"},
        {"direct.split_cap", "16"},
        {"indirect.transport", "none"}}},
      {"power",
       "Emitters by flux, from an alias table; direct light only",
       "A. J. Walker: An Efficient Method for Generating Discrete Random Variables with General "
       "Distributions. "
       "ACM Trans. Math. Softw. 3(3), 1977",
       {{"direct.selection", "power"}, {"direct.hierarchy", "none"}, {"indirect.transport", "none"}}},
      {"uniform",
       "Every emitter equally likely; direct light only",
       "P. Shirley, C. Wang, K. Zimmerman: Monte Carlo Techniques for Direct Lighting Calculations. "
       "ACM Trans. Graph. 15(1), 1996",
       {{"direct.selection", "uniform"}, {"direct.hierarchy", "none"}, {"indirect.transport", "none"}}},
      {"exhaustive",
       "A sample of every emitter at every point: the oracle of light selection; direct light only",
       "P. Shirley, C. Wang, K. Zimmerman: Monte Carlo Techniques for Direct Lighting Calculations. "
       "ACM Trans. Graph. 15(1), 1996",
       {{"direct.selection", "all"}, {"direct.hierarchy", "none"}, {"indirect.transport", "none"}}},
      {"path",
       "Path tracer, the reference: light samples by the tree, BSDF samples, MIS, Russian roulette",
       "J. T. Kajiya: The Rendering Equation. SIGGRAPH 1986; E. Veach, L. J. Guibas: Optimally Combining "
       "Sampling "
       "Techniques for Monte Carlo Rendering. SIGGRAPH 1995",
       {{"direct.selection", "root"},
        {"direct.hierarchy", "perfect"},
        {"direct.mis", "true"},
        {"indirect.transport", "path"},
        {"indirect.max_bounces", "8"}},
       true},
      {"sst",
       "Stochastic substitute trees: VPLs traced for every sample, walks that stop at Gaussians standing for many VPLs; "
       "direct light by the light tree",
       "W. Tatzgern, B. Mayr, B. Kerbl, M. Steinberger: Stochastic Substitute Trees for Real-Time Global Illumination. "
       "I3D 2020",
       {{"direct.selection", "root"},
        {"direct.hierarchy", "perfect"},
        {"indirect.transport", "vpl"},
        {"indirect.selection", "root"},
        {"indirect.hierarchy", "substitute"},
        {"indirect.weights", "distance-bounded"},
        {"indirect.stop", "substitute"}}},
      {"slc",
       "Stochastic lightcuts: the same VPLs and the same tree, walked to its leaves with Yuksel's weights; direct light "
       "by the light tree",
       "C. Yuksel: Stochastic Lightcuts. HPG 2019",
       {{"direct.selection", "root"},
        {"direct.hierarchy", "perfect"},
        {"indirect.transport", "vpl"},
        {"indirect.selection", "root"},
        {"indirect.hierarchy", "substitute"},
        {"indirect.weights", "yuksel"},
        {"indirect.stop", "leaf"}}},
  };
  return table;
}

const std::vector<SettingInfo>& settings_table() {
  static const std::vector<SettingInfo> table = [] {
    std::vector<SettingInfo> infos;
    for (const Setting& row : settings()) infos.push_back(row.info);
    return infos;
  }();
  return table;
}

void set_value(Settings& settings_to_change, const std::string& key, const std::string& value) {
  find_setting(key).set(settings_to_change, value);
}

std::string get_value(const Settings& settings_to_read, const std::string& key) {
  return find_setting(key).get(settings_to_read);
}

Settings make_preset(const std::string& name) {
  std::vector<std::string> names;
  for (const PresetInfo& preset : presets()) {
    names.push_back(preset.name);
    if (preset.name != name) continue;
    Settings result;
    result.preset = name;
    for (const auto& [key, value] : preset.values) set_value(result, key, value);
    return result;
  }
  throw Error(fmt::format("unknown method '{}'; the nearest one is '{}', all are {}", name,
                          nearest(name, names), fmt::join(names, ", ")));
}

void check(const Settings& s) {
  check_ranges(s);
  check_image(s);
  if (s.view) check_view(*s.view);
  check_selection("direct", s, s.direct);
  if (s.direct.selection == Selection::kPool && s.direct.mis)
    throw Error("direct.mis does not combine with pools; set direct.selection 'root' or 'cut', or direct.mis false");
  check_vpls(s);
}

}  // namespace lumigrove
