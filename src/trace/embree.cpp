// Embree behind the tracing seam. Up to two Embree scenes answer every ray one after the other: a soup of
// baked world-space triangles, and one level of instances for what moves in large scenes and for large meshes
// used several times.
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <string>
#include <unordered_map>

#include "scene/interpolate.h"
#include "trace/embree_api.h"
#include "trace/flatten.h"
#include "trace/trace.h"

namespace lumigrove {
namespace {

// Rays of one task.
constexpr std::size_t kBlock = 1024;

// A batch up to this size, such as a tile of an image, is traced by the calling thread: whoever asks for so few has
// other batches for the other threads.
constexpr std::size_t kSerialBatch = 8 * kBlock;

// Embree's own bound on coordinates (FLT_LARGE); its filtering of rays beyond it may be compiled out.
constexpr float kMaxCoordinate = 1.8e18f;

bool in_range(vec3 v) {
  return std::abs(v.x) < kMaxCoordinate && std::abs(v.y) < kMaxCoordinate && std::abs(v.z) < kMaxCoordinate;
}

// Where Embree may start; NaN stays NaN.
float start(const Ray& ray) { return ray.tmin < 0 ? 0 : ray.tmin; }

// False also for NaN anywhere.
bool is_traceable(const Ray& ray) {
  return start(ray) <= ray.tmax && in_range(ray.origin) && in_range(ray.direction);
}

struct DeviceDeleter {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneDeleter {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct GeometryDeleter {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using DevicePointer = std::unique_ptr<RTCDeviceTy, DeviceDeleter>;
using ScenePointer = std::unique_ptr<RTCSceneTy, SceneDeleter>;
using GeometryPointer = std::unique_ptr<RTCGeometryTy, GeometryDeleter>;

bool count_bytes(void* counter, ssize_t bytes, bool /*post*/) {
  static_cast<std::atomic<ssize_t>*>(counter)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

// Embree reports failures (in practice: out of memory) by a code that must be asked for.
void throw_on_error(RTCDevice device) {
  const RTCError code = rtcGetDeviceError(device);
  if (code == RTC_ERROR_NONE) return;
  if (code == RTC_ERROR_OUT_OF_MEMORY) throw Error("Embree ran out of memory while building the scene.");
  throw Error("Embree failed to build the scene (error code " + std::to_string(static_cast<int>(code)) +
              ").");
}

DevicePointer make_device() {
  // Without "threads=" Embree's builders obey the limit that the application has set with
  // tbb::global_control.
  DevicePointer device(rtcNewDevice("ignore_config_files=1"));
  if (!device) throw_on_error(nullptr);
  return device;
}

ScenePointer make_scene(RTCDevice device) {
  ScenePointer scene(rtcNewScene(device));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  // Not robust: in 15 million primary rays of the built-in city that changes nine hits, but every shadow ray
  // would take 10 to 15 percent longer.
  return scene;
}

GeometryPointer make_triangles(RTCDevice device) {
  GeometryPointer geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  rtcSetGeometryMask(geometry.get(), embree::kMaskAll);
  return geometry;
}

template <class T>
T* new_buffer(RTCDevice device, RTCGeometry geometry, RTCBufferType type, RTCFormat format,
              std::size_t count) {
  auto* data = static_cast<T*>(rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), count));
  throw_on_error(device);
  return data;
}

// What a filter function needs to know to cut holes.
struct MaskedMesh {
  const SceneView* scene;
  const MeshView* mesh;
};

void cut_holes(const RTCFilterFunctionNArguments* args) {
  const auto* masked = static_cast<const MaskedMesh*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    const unsigned triangle = RTCHitN_primID(args->hit, args->N, i);
    const float u = RTCHitN_u(args->hit, args->N, i), v = RTCHitN_v(args->hit, args->N, i);
    if (is_cut_out(*masked->scene, *masked->mesh, triangle, u, v)) args->valid[i] = 0;
  }
}

bool is_invertible(const mat4x3& m) {
  const float determinant = glm::dot(m[0], glm::cross(m[1], m[2]));
  return determinant != 0 && is_finite(1 / determinant) && is_finite(m[3]);
}

// The rays of one block that are to be traced. Packing just those keeps packets full where many samples are
// dead.
class TraceableRays {
 public:
  explicit TraceableRays(std::span<const Ray> rays) {
    for (std::uint32_t i = 0; i < rays.size(); ++i) {
      indices_[count_] = i;
      count_ += is_traceable(rays[i]) ? 1u : 0u;
    }
  }
  std::size_t count() const { return count_; }
  std::size_t operator[](std::size_t i) const { return indices_[i]; }

 private:
  std::array<std::uint32_t, kBlock + 1> indices_;
  std::size_t count_ = 0;
};

// Packets keep what does not change from one packet to the next: time, mask, flags.
template <int kWidth, class PacketRay>
void prepare(PacketRay& packet) {
  for (std::size_t i = 0; i < kWidth; ++i) {
    packet.time[i] = 0;
    packet.mask[i] = embree::kMaskAll;
    packet.id[i] = 0;
    packet.flags[i] = 0;
  }
}

// Rays number `first` and following; lanes beyond the last ray repeat it and are switched off.
template <int kWidth, class PacketRay>
void load(std::span<const Ray> rays, const TraceableRays& traceable, std::size_t first, PacketRay& packet,
          std::array<int, kWidth>& valid) {
  for (std::size_t i = 0; i < kWidth; ++i) {
    const Ray& ray = rays[traceable[std::min(first + i, traceable.count() - 1)]];
    valid[i] = first + i < traceable.count() ? -1 : 0;
    packet.org_x[i] = ray.origin.x;
    packet.org_y[i] = ray.origin.y;
    packet.org_z[i] = ray.origin.z;
    packet.tnear[i] = start(ray);
    packet.dir_x[i] = ray.direction.x;
    packet.dir_y[i] = ray.direction.y;
    packet.dir_z[i] = ray.direction.z;
    packet.tfar[i] = ray.tmax;
  }
}

}  // namespace

struct Tracer::Impl {
  Impl(const Scene& traced_scene, const SceneState& state);

  void build_baked(const SceneState& state);
  void attach_opaque(const SceneState& state);
  void attach_masked(const SceneState& state, std::uint32_t instance);
  void build_instanced(const SceneState& state);
  RTCScene shared_scene(int mesh);
  void place_instances(const SceneState& state);
  void update(const SceneState& state);
  void let_filter_cut(RTCGeometry geometry, int mesh);

  void keep(std::span<const Ray> rays, std::vector<Ray>& record) {
    const std::lock_guard lock(recorder_mutex);
    record.insert(record.end(), rays.begin(), rays.end());
  }

  TriangleId name_hit(unsigned geometry, unsigned primitive, unsigned embree_instance) const;

  template <int kWidth>
  void closest_packets(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const;
  template <int kWidth>
  void occluded_packets(std::span<const Ray> rays, std::span<std::uint8_t> occluded, bool coherent) const;

  const Scene& scene;
  TracePlan plan;
  std::atomic<ssize_t> embree_bytes = 0;
  DevicePointer device;
  bool wide = false;  // packets of 16 are native, otherwise 8
  SceneArrays arrays;
  SceneView view;
  std::vector<MaskedMesh> masked_meshes;  // by mesh: user data of filter functions

  ScenePointer baked, instanced;               // null when empty
  std::vector<TriangleId> soup;                // geometry 0 of `baked`, when there is opaque geometry
  std::vector<std::uint32_t> baked_instances;  // by geometry id of `baked`; unused for the soup
  std::unordered_map<int, ScenePointer> shared;
  std::vector<GeometryPointer> instance_geometries;
  std::vector<int> mesh_of_instance;  // of the first state, to check later ones

  RayRecorder* recorder = nullptr;
  std::mutex recorder_mutex;
};

Tracer::Impl::Impl(const Scene& traced_scene, const SceneState& state)
    : scene(traced_scene), plan(plan_trace(scene, state)), device(make_device()), arrays(scene) {
  rtcSetDeviceMemoryMonitorFunction(device.get(), count_bytes, &embree_bytes);
  wide = rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
  view = arrays.view();
  for (const MeshView& mesh : arrays.meshes) masked_meshes.push_back({&view, &mesh});
  for (const MeshInstance& instance : state.instances) mesh_of_instance.push_back(instance.mesh);
  build_baked(state);
  build_instanced(state);
  throw_on_error(device.get());
}

void Tracer::Impl::build_baked(const SceneState& state) {
  if (plan.baked.empty() && plan.masked.empty()) return;
  baked = make_scene(device.get());
  baked_instances.clear();
  if (!plan.baked.empty()) attach_opaque(state);
  for (const std::uint32_t instance : plan.masked) attach_masked(state, instance);
  rtcCommitScene(baked.get());
}

// All opaque baked instances as one geometry: Embree's cost per geometry would show with tens of thousands of
// them.
void Tracer::Impl::attach_opaque(const SceneState& state) {
  const std::vector<std::uint32_t>& ids = plan.baked;
  std::vector<std::size_t> first_vertex(ids.size() + 1, 0), first_triangle(ids.size() + 1, 0);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(state.instances[ids[i]].mesh)];
    first_vertex[i + 1] = first_vertex[i] + mesh.positions.size();
    first_triangle[i + 1] = first_triangle[i] + mesh.triangles.size();
  }
  if (first_vertex.back() >= kNoId || first_triangle.back() >= kNoId) {
    throw Error("The scene has more than 4 billion vertices or triangles.");
  }
  const GeometryPointer geometry = make_triangles(device.get());
  auto* vertices = new_buffer<vec3>(device.get(), geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                                    first_vertex.back());
  auto* indices = new_buffer<uvec3>(device.get(), geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
                                    first_triangle.back());
  soup.resize(first_triangle.back());
  tbb::parallel_for(std::size_t{0}, ids.size(), [&](std::size_t i) {
    const MeshInstance& instance = state.instances[ids[i]];
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
    vec3* out = vertices + first_vertex[i];
    for (const vec3& p : mesh.positions) *out++ = transform_point(instance.to_world, p);
    const auto offset = static_cast<std::uint32_t>(first_vertex[i]);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      indices[first_triangle[i] + t] = mesh.triangles[t] + offset;
      soup[first_triangle[i] + t] = {ids[i], static_cast<std::uint32_t>(t)};
    }
  });
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(baked.get(), geometry.get());
  baked_instances.push_back(kNoId);
}

void Tracer::Impl::attach_masked(const SceneState& state, std::uint32_t id) {
  const MeshInstance& instance = state.instances[id];
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
  const GeometryPointer geometry = make_triangles(device.get());
  auto* vertices = new_buffer<vec3>(device.get(), geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                                    mesh.positions.size());
  for (const vec3& p : mesh.positions) *vertices++ = transform_point(instance.to_world, p);
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             mesh.triangles.data(), 0, sizeof(uvec3), mesh.triangles.size());
  let_filter_cut(geometry.get(), instance.mesh);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(baked.get(), geometry.get());
  baked_instances.push_back(id);
}

void Tracer::Impl::let_filter_cut(RTCGeometry geometry, int mesh) {
  rtcSetGeometryUserData(geometry, &masked_meshes[static_cast<std::size_t>(mesh)]);
  rtcSetGeometryIntersectFilterFunction(geometry, cut_holes);
  rtcSetGeometryOccludedFilterFunction(geometry, cut_holes);
}

// The structure that all instances of a mesh share, in the mesh's own space.
RTCScene Tracer::Impl::shared_scene(int mesh_index) {
  ScenePointer& shared_mesh = shared[mesh_index];
  if (shared_mesh) return shared_mesh.get();
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(mesh_index)];
  shared_mesh = make_scene(device.get());
  const GeometryPointer geometry = make_triangles(device.get());
  // Embree reads 16 bytes a vertex, so it may not read the last one out of our own array.
  auto* vertices = new_buffer<vec3>(device.get(), geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                                    mesh.positions.size());
  std::copy(mesh.positions.begin(), mesh.positions.end(), vertices);
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             mesh.triangles.data(), 0, sizeof(uvec3), mesh.triangles.size());
  if (arrays.materials[static_cast<std::size_t>(mesh.material)].masked)
    let_filter_cut(geometry.get(), mesh_index);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(shared_mesh.get(), geometry.get());
  rtcCommitScene(shared_mesh.get());
  return shared_mesh.get();
}

void Tracer::Impl::build_instanced(const SceneState& state) {
  if (plan.instanced.empty()) return;
  instanced = make_scene(device.get());
  for (const std::uint32_t id : plan.instanced) {
    GeometryPointer geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryMask(geometry.get(), embree::kMaskAll);
    rtcSetGeometryInstancedScene(geometry.get(), shared_scene(state.instances[id].mesh));
    rtcSetGeometryTimeStepCount(geometry.get(), 1);
    rtcAttachGeometry(instanced.get(), geometry.get());
    instance_geometries.push_back(std::move(geometry));
  }
  place_instances(state);
}

void Tracer::Impl::place_instances(const SceneState& state) {
  for (std::size_t i = 0; i < plan.instanced.size(); ++i) {
    const mat4x3& to_world = state.instances[plan.instanced[i]].to_world;
    RTCGeometry geometry = instance_geometries[i].get();
    if (is_invertible(to_world)) {
      rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &to_world[0][0]);
      rtcEnableGeometry(geometry);
    } else {
      rtcDisableGeometry(geometry);
    }
    rtcCommitGeometry(geometry);
  }
  rtcCommitScene(instanced.get());
}

TriangleId Tracer::Impl::name_hit(unsigned geometry, unsigned primitive, unsigned embree_instance) const {
  if (embree_instance != RTC_INVALID_GEOMETRY_ID) return {plan.instanced[embree_instance], primitive};
  if (geometry == 0 && !soup.empty()) return soup[primitive];
  return {baked_instances[geometry], primitive};
}

template <int kWidth>
void Tracer::Impl::closest_packets(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const {
  std::fill(hits.begin(), hits.end(), Hit{});
  const TraceableRays traceable(rays);
  alignas(64) typename embree::Packet<kWidth>::RayHit packet;
  alignas(64) std::array<int, kWidth> valid;
  prepare<kWidth>(packet.ray);
  embree::Query query(coherent);
  for (std::size_t first = 0; first < traceable.count(); first += kWidth) {
    load<kWidth>(rays, traceable, first, packet.ray, valid);
    for (std::size_t i = 0; i < kWidth; ++i) {
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    if (baked) query.intersect(baked.get(), valid.data(), packet);
    if (instanced) query.intersect(instanced.get(), valid.data(), packet);
    for (std::size_t i = 0; i < kWidth && first + i < traceable.count(); ++i) {
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      const TriangleId id = name_hit(packet.hit.geomID[i], packet.hit.primID[i], packet.hit.instID[0][i]);
      Hit& hit = hits[traceable[first + i]];
      hit.instance = id.instance;
      hit.triangle = id.triangle;
      hit.u = packet.hit.u[i];
      hit.v = packet.hit.v[i];
      hit.t = packet.ray.tfar[i];
    }
  }
}

// Embree marks an occluded ray by tfar = -infinity; traceable rays have tfar >= 0.
// Instances are always asked without the coherent flag: with it, rtcOccluded16 of Embree 3.13.5 never returns
// when a filter function inside an instance lets some lanes pass and stops others.
template <int kWidth>
void Tracer::Impl::occluded_packets(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                                    bool coherent) const {
  std::fill(occluded.begin(), occluded.end(), std::uint8_t{0});
  const TraceableRays traceable(rays);
  alignas(64) typename embree::Packet<kWidth>::Ray packet;
  alignas(64) std::array<int, kWidth> valid;
  prepare<kWidth>(packet);
  embree::Query query(coherent), instance_query(false);
  for (std::size_t first = 0; first < traceable.count(); first += kWidth) {
    load<kWidth>(rays, traceable, first, packet, valid);
    if (baked) query.occluded(baked.get(), valid.data(), packet);
    if (baked && instanced) {
      for (std::size_t i = 0; i < kWidth; ++i) valid[i] &= packet.tfar[i] >= 0 ? -1 : 0;
    }
    if (instanced) instance_query.occluded(instanced.get(), valid.data(), packet);
    for (std::size_t i = 0; i < kWidth && first + i < traceable.count(); ++i) {
      occluded[traceable[first + i]] = static_cast<std::uint8_t>(packet.tfar[i] == -kInfinity);
    }
  }
}

Tracer::Tracer(const Scene& scene, const SceneState& state) : impl_(std::make_unique<Impl>(scene, state)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

void Tracer::Impl::update(const SceneState& state) {
  bool same = state.instances.size() == mesh_of_instance.size();
  for (std::size_t i = 0; same && i < state.instances.size(); ++i) {
    same = state.instances[i].mesh == mesh_of_instance[i];
  }
  if (!same) throw Error("A tracer can only be updated with another moment of the same scene.");
  if (plan.baked_moves) build_baked(state);
  if (instanced) place_instances(state);
  throw_on_error(device.get());
}

void Tracer::update(const SceneState& state) { impl_->update(state); }

namespace {

template <class Block>
void for_blocks(std::size_t count, const Block& block) {
  const auto one = [&](std::size_t b) { block(b * kBlock, std::min(kBlock, count - b * kBlock)); };
  const std::size_t blocks = (count + kBlock - 1) / kBlock;
  if (count <= kSerialBatch) {
    for (std::size_t b = 0; b < blocks; ++b) one(b);
  } else {
    tbb::parallel_for(std::size_t{0}, blocks, one);
  }
}

}  // namespace

void Tracer::closest(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence) const {
  if (rays.size() != hits.size()) throw Error("Tracer::closest needs as many hits as rays.");
  if (impl_->recorder) impl_->keep(rays, impl_->recorder->closest);
  for_blocks(rays.size(), [&](std::size_t first, std::size_t count) {
    const auto in = rays.subspan(first, count);
    const auto out = hits.subspan(first, count);
    const bool coherent = coherence == Coherence::kCoherent;
    impl_->wide ? impl_->closest_packets<16>(in, out, coherent)
                : impl_->closest_packets<8>(in, out, coherent);
  });
}

void Tracer::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                      Coherence coherence) const {
  if (rays.size() != occluded.size()) throw Error("Tracer::occluded needs as many answers as rays.");
  if (impl_->recorder) impl_->keep(rays, impl_->recorder->occluded);
  for_blocks(rays.size(), [&](std::size_t first, std::size_t count) {
    const auto in = rays.subspan(first, count);
    const auto out = occluded.subspan(first, count);
    const bool coherent = coherence == Coherence::kCoherent;
    impl_->wide ? impl_->occluded_packets<16>(in, out, coherent)
                : impl_->occluded_packets<8>(in, out, coherent);
  });
}

void Tracer::record(RayRecorder* recorder) { impl_->recorder = recorder; }

std::size_t Tracer::bytes() const {
  return static_cast<std::size_t>(std::max<ssize_t>(0, impl_->embree_bytes.load())) +
         impl_->soup.capacity() * sizeof(TriangleId);
}

}  // namespace lumigrove
