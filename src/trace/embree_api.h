// Embree 3 and Embree 4 under one set of names: the only file that knows which one is installed.
//   - Embree 4 dropped the intersect context argument for an optional arguments struct, and its default
//   geometry mask
//     is 1 instead of all bits, so rays and geometries here always set their masks.
//   - Packets of 1, 8 and 16 rays share one template; ray streams are gone in Embree 4 and not used.
#pragma once

#if __has_include(<embree3/rtcore.h>)
#include <embree3/rtcore.h>
#elif __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#error "Embree 3 or 4 is needed (Debian: libembree-dev)"
#endif

namespace lumigrove::embree {

inline constexpr unsigned kMaskAll = 0xffffffffu;

template <int kWidth>
struct Packet;
template <>
struct Packet<8> {
  using Ray = RTCRay8;
  using RayHit = RTCRayHit8;
};
template <>
struct Packet<16> {
  using Ray = RTCRay16;
  using RayHit = RTCRayHit16;
};

// How a batch is to be traced: Embree 3's intersect context, Embree 4's arguments.
#if RTC_VERSION_MAJOR >= 4
class Query {
 public:
  explicit Query(bool coherent) {
    rtcInitIntersectArguments(&intersect_);
    rtcInitOccludedArguments(&occluded_);
    const RTCRayQueryFlags flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    intersect_.flags = flags;
    occluded_.flags = flags;
  }
  void intersect(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray, &intersect_); }
  void intersect(RTCScene scene, const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene, &rays, &intersect_);
  }
  void intersect(RTCScene scene, const int* valid, RTCRayHit16& rays) {
    rtcIntersect16(valid, scene, &rays, &intersect_);
  }
  void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray, &occluded_); }
  void occluded(RTCScene scene, const int* valid, RTCRay8& rays) {
    rtcOccluded8(valid, scene, &rays, &occluded_);
  }
  void occluded(RTCScene scene, const int* valid, RTCRay16& rays) {
    rtcOccluded16(valid, scene, &rays, &occluded_);
  }

 private:
  RTCIntersectArguments intersect_;
  RTCOccludedArguments occluded_;
};
#else
class Query {
 public:
  explicit Query(bool coherent) {
    rtcInitIntersectContext(&context_);
    context_.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  void intersect(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &context_, &ray); }
  void intersect(RTCScene scene, const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene, &context_, &rays);
  }
  void intersect(RTCScene scene, const int* valid, RTCRayHit16& rays) {
    rtcIntersect16(valid, scene, &context_, &rays);
  }
  void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &context_, &ray); }
  void occluded(RTCScene scene, const int* valid, RTCRay8& rays) {
    rtcOccluded8(valid, scene, &context_, &rays);
  }
  void occluded(RTCScene scene, const int* valid, RTCRay16& rays) {
    rtcOccluded16(valid, scene, &context_, &rays);
  }

 private:
  RTCIntersectContext context_;
};
#endif

}  // namespace lumigrove::embree
