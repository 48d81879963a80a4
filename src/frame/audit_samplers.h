// The samplers of a World as the audit asks them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frame/audit.h"
#include "frame/frame.h"

namespace lumigrove {

// What every light sends to each point; samplers over the same lights share it.
using LightCache = std::vector<std::vector<LightMoments>>;

// For trees that are to be asked for probabilities: `settings` as the world must be built with.
Settings settings_of_audited_world(Settings settings);

// The sampler of make_direct_lighting; over emitters and virtual point lights with indirect.joint. All keep references to
// `scene` and `world`.
AuditedSampler audit_of_direct(const Scene& scene, const World& world, const Settings& settings, const std::string& name,
                               const std::shared_ptr<LightCache>& cache);

// The sampler of make_indirect_lighting, over virtual point lights alone.
AuditedSampler audit_of_vpls(const Scene& scene, const World& world, const Settings& settings, const std::string& name,
                             const std::shared_ptr<LightCache>& cache);

}  // namespace lumigrove
