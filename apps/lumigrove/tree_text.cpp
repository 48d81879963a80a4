#include "tree_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "json_text.h"

namespace lumigrove {
namespace {

double share_of(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

std::string percent(std::uint64_t part, std::uint64_t whole) {
  return fmt::format("{:.2f} %", 100 * share_of(part, whole));
}

std::string row(const std::string& name, const std::string& value) { return fmt::format("  {:<22}{}\n", name, value); }

std::string quantile_row(const std::string& name, const Quantiles& values) {
  std::string text = fmt::format("  {:<22}", name);
  for (const float value : values) text += fmt::format("{:>11.4g}", value);
  return text + '\n';
}

std::string quantile_heading(const std::string& name) {
  std::string text = fmt::format("  {:<22}", name);
  for (const float share : kQuantileShares) text += fmt::format("{:>11}", fmt::format("{:.0f} %", 100 * share));
  return text + '\n';
}

Json quantile_json(const Quantiles& values) {
  Json json = Json::object();
  for (std::size_t k = 0; k < values.size(); ++k) json[fmt::format("{:.0f}%", 100 * kQuantileShares[k])] = values[k];
  return json;
}

const char* name_of(Lobes lobe) { return lobe == Lobes::kGloss ? "gloss" : "diffuse"; }

const char* name_of(WalkEnd end) {
  return end == WalkEnd::kDead ? "dead" : end == WalkEnd::kLeaf ? "light" : "substitute";
}

std::string point_text(vec3 v) { return fmt::format("({:.5g}, {:.5g}, {:.5g})", v.x, v.y, v.z); }

// --- one pixel, as text ------------------------------------------------------------------------------------

std::string child_line(const WalkStep& step, int number, int side, bool visibility) {
  const WeighedChild& child = step.child[side];
  const std::string start =
      side == 0 ? fmt::format("{:>4}{:>8}{:>8.4f}", number, step.node, step.random) : fmt::format("{:>20}", "");
  const std::string name =
      fmt::format("{} {}{}", child.leaf ? "light" : "node", child.number, child.usable ? " S" : "");
  const std::string weight = std::isnan(child.weight) ? "-" : fmt::format("{:.4g}", child.weight);
  std::string line = fmt::format("{} {} {:<14}{:>7}{:>11.4g}{:>10.4g}{:>9.3g}{:>11}{:>9.4f}{:>9.4f}", start,
                                 step.taken == side ? '>' : ' ', name, child.last - child.first + 1, child.intensity,
                                 child.distance, child.bound, weight, child.probability, child.true_share);
  if (visibility) line += fmt::format("{:>9.4f}", child.visible_share);
  return line + '\n';
}

std::string steps_table(const PixelReport& report) {
  const auto& steps = report.walk.steps;
  if (steps.empty()) return "the walk ends at the root\n";
  const bool visibility = report.truth.has_visibility();
  std::string text =
      fmt::format("{:>4}{:>8}{:>8}   {:<14}{:>7}{:>11}{:>10}{:>9}{:>11}{:>9}{:>9}", "step", "node", "random", "child",
                  "lights", "Y W/sr", "to mean m", "bound", "weight", "prob.", "true");
  text += visibility ? fmt::format("{:>9}\n", "visible") : "\n";
  for (std::size_t s = 0; s < steps.size(); ++s)
    for (const int side : {0, 1}) text += child_line(steps[s], static_cast<int>(s) + 1, side, visibility);
  text += "  > taken, S usable as a substitute; true: share of the light that all VPLs below send here unoccluded";
  text += visibility ? ",\n  visible: of what arrives\n" : "\n";
  return text;
}

std::string light_text(vec3 light) { return fmt::format("Y {:.5g}  {}", luminance(light), point_text(light)); }

std::string drawn_text(const PixelReport& report) {
  const ExplainedWalk& walk = report.walk;
  const DrawnLight& drawn = walk.drawn;
  if (drawn.walk.end == WalkEnd::kDead)
    return "dead branch: no box below lies above the surface's horizon; the sample is black\n";
  std::string text = drawn.walk.end == WalkEnd::kLeaf
                         ? fmt::format("drawn: light {}", drawn.walk.node)
                         : fmt::format("drawn: a point of substitute {} (box {:.4g} m across)", drawn.walk.node,
                                       drawn.walk.box.diagonal());
  text += fmt::format(" at {}, normal {}\n", point_text(drawn.light.position), point_text(drawn.light.normal));
  text += row("intensity", light_text(drawn.light.intensity * drawn.walk.pdf) + " W/sr");
  text += row("probability", fmt::format("{:.6g} after {} steps", drawn.walk.pdf, drawn.walk.steps));
  text += row("unoccluded", light_text(walk.unoccluded) + (drawn.clamped ? "  (clamped by G_max)" : "") +
                                (drawn.boxed ? "  (moved to the box)" : ""));
  const bool black = !(length_squared(walk.unoccluded) > 0);
  text += row("visibility", black           ? "not asked: the light or the surface faces away"
                            : walk.occluded ? "occluded"
                                            : "visible");
  return text + row("contribution", light_text(walk.contribution()));
}

std::string truth_text(const PixelReport& report) {
  const TrueLight& truth = report.truth;
  std::string text = fmt::format("truth: the {} light of all {} VPLs, cos / d^2 clamped by G_max\n",
                                 name_of(report.lobe), truth.unoccluded.size() - 1);
  text += row("unoccluded", light_text(truth.unoccluded_sum));
  if (!truth.has_visibility()) return text + row("arriving", "not traced: too many VPLs");
  return text + row("arriving", light_text(truth.visible_sum));
}

std::string against(double mean, double error, vec3 truth) {
  const auto y = static_cast<double>(luminance(truth));
  const std::string distance = error > 0 ? fmt::format(", {:+.2f} standard errors", (mean - y) / error) : "";
  return fmt::format("Y {:.5g} +- {:.2g}, truth {:.5g}{}", mean, error, y, distance);
}

std::string samples_text(const PixelReport& report) {
  const SampleSummary& s = *report.samples;
  std::string text = fmt::format("{} walks: {} end at substitutes, {} dead, {} occluded\n", s.samples, s.substitutes,
                                 s.dead, s.occluded);
  text += row("unoccluded", against(s.unoccluded_y, s.unoccluded_error, report.truth.unoccluded_sum));
  if (report.truth.has_visibility())
    text += row("arriving", against(s.mean_y, s.standard_error, report.truth.visible_sum));
  else
    text += row("arriving", fmt::format("Y {:.5g} +- {:.2g}", s.mean_y, s.standard_error));
  text += row("of one walk", fmt::format("standard deviation {:.4g}", s.standard_error * std::sqrt(s.samples)));
  if (s.substitutes > 0) text += "  substitutes are biased: only walks that end at lights have the truth for a mean\n";
  return text;
}

// --- one pixel, as JSON ------------------------------------------------------------------------------------

Json child_json(const WeighedChild& child, bool visibility) {
  Json json = {{child.leaf ? "light" : "node", child.number},
               {"usable", child.usable},
               {"lights", child.last - child.first + 1},
               {"intensity_y", child.intensity},
               {"distance_m", child.distance},
               {"bound", child.bound},
               {"weight", child.weight},
               {"probability", child.probability},
               {"true_share", child.true_share}};
  if (visibility) json["visible_share"] = child.visible_share;
  return json;
}

Json drawn_json(const ExplainedWalk& walk) {
  const DrawnLight& drawn = walk.drawn;
  Json json = {{"end", name_of(drawn.walk.end)}};
  if (drawn.walk.end == WalkEnd::kDead) return json;
  json["number"] = drawn.walk.node;
  json["position"] = json_list(drawn.light.position);
  json["normal"] = json_list(drawn.light.normal);
  json["intensity"] = json_list(drawn.light.intensity * drawn.walk.pdf);
  json["probability"] = drawn.walk.pdf;
  json["unoccluded"] = json_list(walk.unoccluded);
  json["occluded"] = walk.occluded;
  json["contribution"] = json_list(walk.contribution());
  json["moved_to_box"] = drawn.boxed;
  json["clamped"] = drawn.clamped;
  if (drawn.walk.end == WalkEnd::kSubstitute) json["diagonal_m"] = drawn.walk.box.diagonal();
  return json;
}

Json samples_json(const SampleSummary& s) {
  return {{"samples", s.samples},
          {"substitutes", s.substitutes},
          {"dead", s.dead},
          {"occluded", s.occluded},
          {"mean", json_list(s.mean)},
          {"mean_y", s.mean_y},
          {"standard_error_y", s.standard_error},
          {"unoccluded_y", s.unoccluded_y},
          {"unoccluded_standard_error_y", s.unoccluded_error}};
}

}  // namespace

std::string tree_report_text(const TreeReport& report) {
  const SubstituteTreeStatistics& tree = report.tree;
  const WalkStatistics& walks = report.walks;
  const auto per_light = [&](std::size_t bytes) { return static_cast<double>(bytes) / std::max(1u, tree.lights); };
  std::string text = fmt::format("{}, {}\n", report.scene, report.preset);
  text += row("VPLs", fmt::format("{}, traced in {:.2f} ms", tree.lights, report.trace_ms));
  text += row("tree", fmt::format("{} inner nodes, built in {:.2f} ms", tree.inner_nodes, report.build_ms));
  text += row("bytes a VPL", fmt::format("{:.1f} of the tree, {:.1f} of the VPL", per_light(report.tree_bytes),
                                         per_light(report.vpl_bytes)));
  text += row("depth", fmt::format("mean {:.2f}, most {}", tree.mean_depth, tree.max_depth));
  text += row("usable nodes", percent(tree.usable_nodes, tree.inner_nodes));
  text += row("substitutes", fmt::format("{} usable nodes nearest the root, with {} of the VPLs below them",
                                         tree.substitutes, percent(tree.substituted_lights, tree.lights)));
  text += '\n' + quantile_heading("quantiles");
  text += quantile_row("nu of inner nodes", tree.nu);
  text += quantile_row("their sigma_z, m", tree.sigma);
  text += quantile_row("substitutes' size, m", tree.substitute_diagonal);
  text += quantile_row("VPLs below them", tree.substitute_lights);

  text += fmt::format("\nwalks: one for each of the {} surfaces of {}x{} pixels\n", walks.walks, report.width,
                      report.height);
  const std::uint64_t ended = walks.leaves + walks.substitutes;
  text += row("end at",
              fmt::format("lights {}, substitutes {}, nowhere (dead branch) {}", percent(walks.leaves, walks.walks),
                          percent(walks.substitutes, walks.walks), percent(walks.dead, walks.walks)));
  text += row("steps", fmt::format("mean {:.2f}, most {}", walks.mean_steps, walks.max_steps));
  text += row("gloss lobe", percent(walks.gloss, walks.walks));
  text += row("moved to the box", percent(walks.boxed, walks.substitutes) + " of the substitutes' points");
  text += row("inside geometry",
              fmt::format("{} of the substitutes' points; {} farther than the {:.3g} m that shadow "
                          "rays skip",
                          percent(walks.inside, walks.substitutes),
                          percent(walks.inside_beyond_offset, walks.substitutes), report.substitute_offset));
  text += row("clamped by G_max", percent(walks.clamped, ended) + " of the lights drawn");
  text += row("facing away", percent(walks.dark, ended) + " of the lights drawn");
  text += row("occluded", percent(walks.occluded, ended - walks.dark) + " of the rest");
  text +=
      "  inside: a ray from the point along the substitute's normal, as long as its box's diagonal, first meets the\n"
      "  back of a triangle\n";
  return text;
}

std::string tree_report_json(const TreeReport& report) {
  const SubstituteTreeStatistics& tree = report.tree;
  const WalkStatistics& walks = report.walks;
  const std::uint64_t ended = walks.leaves + walks.substitutes;
  Json json = {{"scene", report.scene},
               {"preset", report.preset},
               {"diagonal_m", report.diagonal},
               {"vpls", tree.lights},
               {"vpl_trace_ms", report.trace_ms},
               {"tree",
                {{"inner_nodes", tree.inner_nodes},
                 {"build_ms", report.build_ms},
                 {"bytes_per_vpl", static_cast<double>(report.tree_bytes) / std::max(1u, tree.lights)},
                 {"depth_mean", tree.mean_depth},
                 {"depth_max", tree.max_depth},
                 {"usable_share", share_of(tree.usable_nodes, tree.inner_nodes)},
                 {"substitutes", tree.substitutes},
                 {"substituted_vpl_share", share_of(tree.substituted_lights, tree.lights)},
                 {"nu", quantile_json(tree.nu)},
                 {"sigma_normal_m", quantile_json(tree.sigma)},
                 {"substitute_diagonal_m", quantile_json(tree.substitute_diagonal)},
                 {"substitute_vpls", quantile_json(tree.substitute_lights)}}},
               {"walks",
                {{"width", report.width},
                 {"height", report.height},
                 {"count", walks.walks},
                 {"leaf_share", share_of(walks.leaves, walks.walks)},
                 {"substitute_share", share_of(walks.substitutes, walks.walks)},
                 {"dead_share", share_of(walks.dead, walks.walks)},
                 {"gloss_share", share_of(walks.gloss, walks.walks)},
                 {"steps_mean", walks.mean_steps},
                 {"steps_max", walks.max_steps},
                 {"boxed_share", share_of(walks.boxed, walks.substitutes)},
                 {"inside_share", share_of(walks.inside, walks.substitutes)},
                 {"inside_beyond_offset_share", share_of(walks.inside_beyond_offset, walks.substitutes)},
                 {"substitute_offset_m", report.substitute_offset},
                 {"clamped_share", share_of(walks.clamped, ended)},
                 {"facing_away_share", share_of(walks.dark, ended)},
                 {"occluded_share", share_of(walks.occluded, ended - walks.dark)}}}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string pixel_report_text(const PixelReport& report) {
  const Surface& surface = report.surface;
  std::string text = fmt::format("pixel {},{}\n", report.x, report.y);
  text += row("position", point_text(surface.position) + fmt::format(" m, {:.4g} m from the eye", surface.t));
  text += row("normal", point_text(surface.normal));
  text += row("albedo", fmt::format("diffuse {}, specular {}", point_text(surface.diffuse), point_text(surface.specular)));
  text += row("roughness", fmt::format("{:.4g}", surface.roughness));
  text += row("lobe", fmt::format("{}; an image lights it here with probability {:.4g} and divides by that",
                                  name_of(report.lobe), report.lobe_probability));
  if (!report.left_out.empty()) text += row("left out below", fmt::format("{}", fmt::join(report.left_out, ", ")));
  text += '\n' + steps_table(report) + '\n' + drawn_text(report) + '\n' + truth_text(report);
  if (report.samples) text += '\n' + samples_text(report);
  return text;
}

std::string pixel_report_json(const PixelReport& report) {
  const Surface& surface = report.surface;
  const TrueLight& truth = report.truth;
  Json steps = Json::array();
  for (const WalkStep& step : report.walk.steps)
    steps.push_back({{"node", step.node},
                     {"random", step.random},
                     {"taken", step.taken},
                     {"children", Json::array({child_json(step.child[0], truth.has_visibility()),
                                               child_json(step.child[1], truth.has_visibility())})}});
  Json json = {{"pixel", Json::array({report.x, report.y})},
               {"surface",
                {{"position", json_list(surface.position)},
                 {"normal", json_list(surface.normal)},
                 {"diffuse", json_list(surface.diffuse)},
                 {"specular", json_list(surface.specular)},
                 {"roughness", surface.roughness}}},
               {"lobe", name_of(report.lobe)},
               {"lobe_probability", report.lobe_probability},
               {"steps", steps},
               {"drawn", drawn_json(report.walk)},
               {"truth", {{"vpls", truth.unoccluded.size() - 1}, {"unoccluded", json_list(truth.unoccluded_sum)}}}};
  if (truth.has_visibility()) json["truth"]["arriving"] = json_list(truth.visible_sum);
  if (report.samples) json["samples"] = samples_json(*report.samples);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace lumigrove
