#include "bare_embree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <limits>

#include "bench.h"
#include "trace/embree_api.h"
#include "trace/ray.h"

namespace lumigrove::bench {

// The same rays in the three layouts that Embree takes.
struct RaySet {
  std::size_t count = 0;
  std::vector<RTCRay> single;
  std::vector<embree::Packet<8>::Ray> packets8;
  std::vector<embree::Packet<16>::Ray> packets16;
};

namespace {

constexpr std::size_t kGrain = 64;  // packets of one task

RTCRay make_ray(const Ray& ray) {
  RTCRay out;
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.tnear = ray.tmin;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.time = 0;
  out.tfar = ray.tmax;
  out.mask = embree::kMaskAll;
  out.id = 0;
  out.flags = 0;
  return out;
}

// The last packet is filled up with rays that end before they begin and are switched off.
template <int kWidth>
std::vector<typename embree::Packet<kWidth>::Ray> pack(const std::vector<RTCRay>& rays) {
  std::vector<typename embree::Packet<kWidth>::Ray> packets((rays.size() + kWidth - 1) / kWidth);
  for (std::size_t i = 0; i < packets.size() * kWidth; ++i) {
    const RTCRay& ray = rays[std::min(i, rays.size() - 1)];
    auto& packet = packets[i / kWidth];
    const std::size_t lane = i % kWidth;
    packet.org_x[lane] = ray.org_x;
    packet.org_y[lane] = ray.org_y;
    packet.org_z[lane] = ray.org_z;
    packet.tnear[lane] = ray.tnear;
    packet.dir_x[lane] = ray.dir_x;
    packet.dir_y[lane] = ray.dir_y;
    packet.dir_z[lane] = ray.dir_z;
    packet.time[lane] = 0;
    packet.tfar[lane] = i < rays.size() ? ray.tfar : -std::numeric_limits<float>::infinity();
    packet.mask[lane] = embree::kMaskAll;
    packet.id[lane] = 0;
    packet.flags[lane] = 0;
  }
  return packets;
}

RaySet make_ray_set(std::span<const Ray> rays) {
  RaySet set;
  for (const Ray& ray : rays) {
    if (ray.tmin <= ray.tmax) set.single.push_back(make_ray(ray));
  }
  set.count = set.single.size();
  set.packets8 = pack<8>(set.single);
  set.packets16 = pack<16>(set.single);
  return set;
}

template <class Function>
void for_all(std::size_t count, const Function& function) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kGrain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i != range.end(); ++i) function(i);
                    });
}

template <int kWidth, class PacketRay>
std::array<int, kWidth> valid_lanes(const PacketRay& packet) {
  std::array<int, kWidth> valid;
  for (std::size_t i = 0; i < kWidth; ++i) valid[i] = packet.tfar[i] >= 0 ? -1 : 0;
  return valid;
}

// Embree overwrites rays, so each replay works on copies.
template <int kWidth>
void closest_packets(RTCScene scene, const std::vector<typename embree::Packet<kWidth>::Ray>& packets,
                     bool coherent) {
  for_all(packets.size(), [&](std::size_t p) {
    alignas(64) typename embree::Packet<kWidth>::RayHit work;
    work.ray = packets[p];
    for (std::size_t i = 0; i < kWidth; ++i) work.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    alignas(64) const std::array<int, kWidth> valid = valid_lanes<kWidth>(work.ray);
    embree::Query(coherent).intersect(scene, valid.data(), work);
  });
}

template <int kWidth>
void occluded_packets(RTCScene scene, const std::vector<typename embree::Packet<kWidth>::Ray>& packets,
                      bool coherent) {
  for_all(packets.size(), [&](std::size_t p) {
    alignas(64) typename embree::Packet<kWidth>::Ray work = packets[p];
    alignas(64) const std::array<int, kWidth> valid = valid_lanes<kWidth>(work);
    embree::Query(coherent).occluded(scene, valid.data(), work);
  });
}

void closest_singly(RTCScene scene, const std::vector<RTCRay>& rays, bool coherent) {
  for_all(rays.size(), [&](std::size_t i) {
    RTCRayHit work;
    work.ray = rays[i];
    work.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    work.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    embree::Query(coherent).intersect(scene, work);
  });
}

void occluded_singly(RTCScene scene, const std::vector<RTCRay>& rays, bool coherent) {
  for_all(rays.size(), [&](std::size_t i) {
    RTCRay work = rays[i];
    embree::Query(coherent).occluded(scene, work);
  });
}

template <class Trace>
int fastest_mode(int tries, const Trace& trace) {
  int best = 0;
  double best_ms = std::numeric_limits<double>::infinity();
  for (int t = 0; t < tries; ++t) {
    for (int mode = 0; mode < BareEmbree::kModes; ++mode) {
      const double ms = time_ms([&] { trace(mode); });
      if (ms < best_ms) best = mode, best_ms = ms;
    }
  }
  return best;
}

void refuse_masks(const Scene& scene, const SceneState& state) {
  for (const MeshInstance& instance : state.instances) {
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
    if (scene.materials[static_cast<std::size_t>(mesh.material)].alpha_mode == AlphaMode::kMask) {
      throw Error("The ray floor needs a scene without alpha masks, and '" + scene.name + "' has some.");
    }
  }
}

}  // namespace

struct BareEmbree::Impl {
  RTCDevice device = rtcNewDevice("ignore_config_files=1");
  RTCScene scene = rtcNewScene(device);
  RaySet closest, occluded;

  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

BareEmbree::BareEmbree(const Scene& scene, const SceneState& state) : impl_(std::make_unique<Impl>()) {
  refuse_masks(scene, state);
  std::vector<vec3> vertices;
  std::vector<uvec3> triangles;
  for (const MeshInstance& instance : state.instances) {
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const vec3& p : mesh.positions) vertices.push_back(transform_point(instance.to_world, p));
    for (const uvec3& t : mesh.triangles) triangles.push_back(t + first);
  }
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryMask(geometry, embree::kMaskAll);
  std::copy(vertices.begin(), vertices.end(),
            static_cast<vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                       sizeof(vec3), vertices.size())));
  std::copy(triangles.begin(), triangles.end(),
            static_cast<uvec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                        sizeof(uvec3), triangles.size())));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->scene);
}

BareEmbree::~BareEmbree() = default;

void BareEmbree::set_rays(std::span<const Ray> closest, std::span<const Ray> occluded) {
  impl_->closest = make_ray_set(closest);
  impl_->occluded = make_ray_set(occluded);
}

std::string BareEmbree::mode_name(int mode) {
  static constexpr std::array<const char*, kModes> kNames = {
      "single", "single coherent", "packet 8", "packet 8 coherent", "packet 16", "packet 16 coherent"};
  return kNames[static_cast<std::size_t>(mode)];
}

void BareEmbree::trace_closest(int mode) const {
  const bool coherent = mode % 2 == 1;
  if (mode / 2 == 0) closest_singly(impl_->scene, impl_->closest.single, coherent);
  if (mode / 2 == 1) closest_packets<8>(impl_->scene, impl_->closest.packets8, coherent);
  if (mode / 2 == 2) closest_packets<16>(impl_->scene, impl_->closest.packets16, coherent);
}

void BareEmbree::trace_occluded(int mode) const {
  const bool coherent = mode % 2 == 1;
  if (mode / 2 == 0) occluded_singly(impl_->scene, impl_->occluded.single, coherent);
  if (mode / 2 == 1) occluded_packets<8>(impl_->scene, impl_->occluded.packets8, coherent);
  if (mode / 2 == 2) occluded_packets<16>(impl_->scene, impl_->occluded.packets16, coherent);
}

int BareEmbree::best_closest_mode(int tries) const {
  return fastest_mode(tries, [&](int mode) { trace_closest(mode); });
}

int BareEmbree::best_occluded_mode(int tries) const {
  return fastest_mode(tries, [&](int mode) { trace_occluded(mode); });
}

std::size_t BareEmbree::closest_count() const { return impl_->closest.count; }
std::size_t BareEmbree::occluded_count() const { return impl_->occluded.count; }

}  // namespace lumigrove::bench
