#pragma once
// Camera rays, and the way back: where in the picture a point is seen.

#include <optional>

#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// A point as the camera sees it, if nothing is in between.
struct CameraView {
  Vec2 pixel;           // as in CameraRays::ray
  Vec3 direction;       // from the point to the camera
  SurfacePosition end;  // of the ray from the point to the camera
  float importance;     // radiance of a pixel [per unit of flux], for light that is scattered there with BSDF * |cos| = 1/sr
};

/// Maps points of the picture to rays. Pixels are square: the vertical extent is the camera's own, the horizontal follows
/// from the size of the picture.
class CameraRays {
 public:
  CameraRays() = default;
  CameraRays(const Camera& camera, int width, int height) : orthographic_(camera.orthographic), position_(camera.position) {
    const float half_height = camera.orthographic ? camera.ymag : std::tan(0.5f * camera.yfov);
    const float step = 2 * half_height / static_cast<float>(height);
    right_ = camera.right * step;
    down_ = -camera.up * step;
    corner_ = -0.5f * (static_cast<float>(width) * right_ + static_cast<float>(height) * down_);
    forward_ = camera.forward;
    height_ = 2 * half_height;
  }

  /// The ray through `pixel` (x to the right, y down, in pixels; (0, 0) is the corner of the picture).
  Ray ray(const Vec2& pixel) const {
    const Vec3 offset = corner_ + pixel.x * right_ + pixel.y * down_;
    if (orthographic_) return {position_ + offset, forward_, kInfinity};
    return {position_, glm::normalize(forward_ + offset), kInfinity};
  }

  /// How the camera sees `p`; none: it lies behind. The pixel may lie outside of the picture.
  std::optional<CameraView> view(const Vec3& p) const {
    const Vec3 d = p - position_;
    const float depth = glm::dot(d, forward_), step2 = glm::dot(right_, right_);
    if (!(depth > 0)) return std::nullopt;
    const Vec3 in_plane = (orthographic_ ? d - depth * forward_ : d / depth - forward_) - corner_;
    const Vec2 pixel(glm::dot(in_plane, right_) / step2, glm::dot(in_plane, down_) / step2);
    if (orthographic_) return CameraView{pixel, -forward_, {p - depth * forward_, 0, Vec3(0)}, 1 / step2};
    const float distance = glm::length(d), cosine = depth / distance;
    return CameraView{pixel, -d / distance, {position_, 0, Vec3(0)}, 1 / (sqr(distance) * cosine * sqr(cosine) * step2)};
  }

  /// Height of what the picture shows at this distance from the eye.
  float height_at(float distance) const { return orthographic_ ? height_ : height_ * distance; }

 private:
  bool orthographic_ = false;
  float height_ = 2;  // perspective: at distance 1
  Vec3 position_{0}, corner_{0}, right_{1, 0, 0}, down_{0, -1, 0}, forward_{0, 0, -1};
};

}  // namespace ln
