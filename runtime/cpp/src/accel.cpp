#include "ln/accel.hpp"

#include <string>

#include "ln/gltf.hpp"
#include "ln/material.hpp"
#include "ln/sampling.hpp"

namespace ln {

namespace {

/// Rejects a candidate hit where the surface is not there: alpha mask, or a draw against alpha blend's coverage.
void filter_by_coverage(const RTCFilterFunctionNArguments* args) {
  const auto& data = *static_cast<const SceneData*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const RTCHit hit = rtcGetHitFromHitN(args->hit, args->N, i);
    const RTCRay ray = rtcGetRayFromRayN(args->ray, args->N, i);
    const std::uint32_t triangle = data.alpha_begin + hit.primID;
    const float c = coverage(data, triangle, hit.u, hit.v);
    if (c >= 1) continue;
    // A fold of the same surface crossed twice needs two draws: the triangle is part of the hash.
    if (c <= 0 || to_unit_float(hash32(ray.id, triangle)) >= c) args->valid[i] = 0;
  }
}

void on_embree_error(void* first_message, RTCError code, const char* message) {
  auto& text = *static_cast<std::string*>(first_message);
  if (text.empty()) text = std::string(message ? message : "unknown") + " (Embree error " + std::to_string(code) + ")";
}

RTCGeometry make_triangles(RTCDevice device, const SceneData& data, std::size_t first, std::size_t count) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, data.positions.data(), 0, sizeof(Vec3),
                             data.positions.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, data.triangles.data(), first * sizeof(UVec3),
                             sizeof(UVec3), count);
  rtcSetGeometryMask(geometry, 0xffffffffu);
  return geometry;
}

}  // namespace

Accel::Accel(SceneData& data, int threads) : alpha_begin_(data.alpha_begin) {
  const std::string config = "threads=" + std::to_string(threads);
  device_.reset(rtcNewDevice(config.c_str()));
  if (!device_) throw Error("Embree cannot be started (error " + std::to_string(rtcGetDeviceError(nullptr)) + ")");
  std::string error;
  rtcSetDeviceErrorFunction(device_.get(), on_embree_error, &error);

  scene_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
  // Embree reads vertices 16 bytes at a time: keep one more float behind the last.
  data.positions.reserve(data.positions.size() + 1);
  const std::size_t count = data.triangles.size();
  if (alpha_begin_ > 0) {
    RTCGeometry geometry = make_triangles(device_.get(), data, 0, alpha_begin_);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_.get(), geometry, kOpaqueGeometry);
    rtcReleaseGeometry(geometry);
  }
  if (alpha_begin_ < count) {
    RTCGeometry geometry = make_triangles(device_.get(), data, alpha_begin_, count - alpha_begin_);
    rtcSetGeometryUserData(geometry, &data);
    rtcSetGeometryIntersectFilterFunction(geometry, filter_by_coverage);
    rtcSetGeometryOccludedFilterFunction(geometry, filter_by_coverage);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_.get(), geometry, kAlphaGeometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene_.get());
  rtcSetDeviceErrorFunction(device_.get(), nullptr, nullptr);
  if (!error.empty()) throw Error("Embree cannot build the scene: " + error);
}

}  // namespace ln
