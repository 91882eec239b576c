#pragma once
// Camera rays.

#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

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
  }

  /// The ray through `pixel` (x to the right, y down, in pixels; (0, 0) is the corner of the picture).
  Ray ray(const Vec2& pixel) const {
    const Vec3 offset = corner_ + pixel.x * right_ + pixel.y * down_;
    if (orthographic_) return {position_ + offset, forward_, kInfinity};
    return {position_, glm::normalize(forward_ + offset), kInfinity};
  }

 private:
  bool orthographic_ = false;
  Vec3 position_{0}, corner_{0}, right_{1, 0, 0}, down_{0, -1, 0}, forward_{0, 0, -1};
};

}  // namespace ln
