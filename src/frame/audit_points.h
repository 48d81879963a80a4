// Where samplers are audited: what the camera sees, and points strewn over all surfaces.
#pragma once

#include <vector>

#include "frame/audit.h"
#include "frame/frame.h"

namespace lumigrove {

// Half of them are what rays through random places of the image meet, as far as they meet anything; of the others half are
// uniform by area, half uniform among the instances of meshes. Those are seen from a random direction, on either side.
// None if the scene has no surface. `settings.seed` and nothing else chooses them.
std::vector<AuditPoint> make_audit_points(const World& world, const Settings& settings, int count);

}  // namespace lumigrove
