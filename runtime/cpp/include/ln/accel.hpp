#pragma once
// Ray queries. The only header that names Embree; works with 3.13 and 4.x.

#include <memory>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// The triangles of a scene, ready for ray queries. On triangles of partial coverage (alpha mask or blend) each query
/// decides, by a hash of the ray's key, whether the surface is there.
class Accel {
 public:
  Accel() = default;
  /// Throws Error if Embree cannot be set up or runs out of memory. `data` must outlive the object and not move.
  Accel(SceneData& data, int threads);

  /// Nearest hit. `key`: decides stochastic coverage; different keys are independent.
  Hit intersect(const Ray& ray, std::uint32_t key) const {
    RTCRayHit query;
    set_ray(query.ray, ray, key);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene_.get(), &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_.get(), &context, &query);
#endif
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    const std::uint32_t base = query.hit.geomID == kAlphaGeometry ? alpha_begin_ : 0;
    return {query.ray.tfar, base + query.hit.primID, query.hit.u, query.hit.v};
  }

  /// Is anything in the way, up to ray.tmax?
  bool occluded(const Ray& ray, std::uint32_t key) const {
    RTCRay query;
    set_ray(query, ray, key);
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded1(scene_.get(), &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_.get(), &context, &query);
#endif
    return query.tfar < 0;
  }

 private:
  static constexpr unsigned kOpaqueGeometry = 0, kAlphaGeometry = 1;

  static void set_ray(RTCRay& to, const Ray& ray, std::uint32_t key) {
    to.org_x = ray.origin.x;
    to.org_y = ray.origin.y;
    to.org_z = ray.origin.z;
    to.tnear = 0;
    to.dir_x = ray.direction.x;
    to.dir_y = ray.direction.y;
    to.dir_z = ray.direction.z;
    to.time = 0;
    to.tfar = ray.tmax;
    to.mask = 0xffffffffu;
    to.id = key;
    to.flags = 0;
  }

  struct ReleaseDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  };
  struct ReleaseScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice> device_;
  std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene> scene_;
  std::uint32_t alpha_begin_ = 0;
};

}  // namespace ln
