#pragma once
// One thread's access to the scene: casts rays and counts them.

#include <array>
#include <vector>

#include "ln/scene.hpp"

namespace ln {

/// What a ray is for. camera: camera rays and their specular continuation; shadow: visibility only; gather: other rays
/// from surfaces; photon: from emitters.
enum class RayKind : std::uint8_t { camera, shadow, gather, photon };
inline constexpr int kRayKinds = 4;

/// Position of a node in the network's list of nodes: who asked for a ray.
using NodeId = std::uint16_t;

using RayCounts = std::array<std::uint64_t, kRayKinds>;

class Tracer {
 public:
  Tracer(const Scene& scene, std::size_t node_count, std::size_t layer_count)
      : scene_(&scene), counts_(node_count), layers_(layer_count, Color(0)) {}

  const Scene& scene() const { return *scene_; }

  Hit intersect(const Ray& ray, std::uint32_t key, NodeId node, RayKind kind) {
    ++counts_[node][static_cast<int>(kind)];
    return scene_->accel().intersect(ray, key);
  }

  bool occluded(const Ray& ray, std::uint32_t key, NodeId node) {
    ++counts_[node][static_cast<int>(RayKind::shadow)];
    return scene_->accel().occluded(ray, key);
  }

  const std::vector<RayCounts>& counts() const { return counts_; }

  /// Values of the picture's layers for the sample being computed.
  std::vector<Color>& layers() { return layers_; }

 private:
  const Scene* scene_;
  std::vector<RayCounts> counts_;
  std::vector<Color> layers_;
};

}  // namespace ln
