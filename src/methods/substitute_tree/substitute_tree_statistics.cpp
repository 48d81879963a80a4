#include "methods/substitute_tree/substitute_tree_statistics.h"

#include <algorithm>
#include <cmath>

namespace lumigrove {

PrincipalAxes principal_axes(const Distribution& d) {
  const Frame frame = make_frame(d.normal);
  const float xx = d.variance_along(frame.x), yy = d.variance_along(frame.y);
  const float xy = glm::dot(frame.x, d.times_covariance(frame.y));
  const float angle = 0.5f * std::atan2(2 * xy, xx - yy);
  const vec3 major = frame.x * std::cos(angle) + frame.y * std::sin(angle);
  const vec3 minor = glm::cross(d.normal, major);
  PrincipalAxes axes{{major, minor, d.normal}, {}};
  for (int k = 0; k < 3; ++k) axes.sigma[k] = std::sqrt(std::max(0.0f, d.variance_along(axes.axis[k])));
  return axes;
}

Quantiles quantiles_of(std::vector<float> population) {
  Quantiles result{};
  if (population.empty()) return result;
  std::sort(population.begin(), population.end());
  const double last = static_cast<double>(population.size() - 1);
  for (std::size_t k = 0; k < result.size(); ++k)
    result[k] = population[static_cast<std::size_t>(std::lround(static_cast<double>(kQuantileShares[k]) * last))];
  return result;
}

SubstituteTreeStatistics describe(const SubstituteTreeView& tree) {
  SubstituteTreeStatistics result;
  result.lights = tree.count;
  std::vector<float> nu, sigma, diagonals, lights;
  double depths = 0;
  for_each_inner_node(tree, [&](const VisitedNode& node) {
    const Distribution& d = tree.distributions[node.number];
    ++result.inner_nodes;
    nu.push_back(d.nu);
    sigma.push_back(std::sqrt(std::max(0.0f, d.variance_along(d.normal))));
    for (const ChildRecord& child : tree.nodes[node.number].child) {
      if ((child.mean & ChildRecord::kLeaf) == 0) continue;
      depths += node.level + 1;
      result.max_depth = std::max(result.max_depth, node.level + 1);
    }
    if (node.usable) ++result.usable_nodes;
    if (!node.is_substitute()) return;
    ++result.substitutes;
    result.substituted_lights += node.lights();
    diagonals.push_back(node.box.diagonal());
    lights.push_back(static_cast<float>(node.lights()));
  });
  if (tree.count > 0) result.mean_depth = depths / tree.count;
  result.nu = quantiles_of(std::move(nu));
  result.sigma = quantiles_of(std::move(sigma));
  result.substitute_diagonal = quantiles_of(std::move(diagonals));
  result.substitute_lights = quantiles_of(std::move(lights));
  return result;
}

}  // namespace lumigrove
