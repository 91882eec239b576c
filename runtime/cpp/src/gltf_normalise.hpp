#pragma once
// The last step of loading: drop what is double or too small, and move everything into [-1, 1].

#include <vector>

#include "gltf_model.hpp"
#include "ln/scene_data.hpp"

namespace ln::gltf {

/// From the world to [-1, 1].
struct Normalisation {
  DVec3 low{0.0}, half{0.0};  // of the box: its lowest corner, half its size
  double unit = 1;

  /// Relative to the lowest corner first: that difference, and so the result, is the same wherever the scene stands, as long
  /// as its world positions are exact.
  Vec3 operator()(const DVec3& world) const { return Vec3(((world - low) - half) / unit); }
};

/// Sets SceneData::origin, unit and positions from the vertices' world positions, and removes triangles that have no area
/// in float, triangles with the same corners as another one, and then vertices and parts without triangles.
///
/// Of several triangles with the same corners (in either winding) one stays: one that emits if there is one, else the first.
/// A scene without triangles has origin 0 and unit 1.
/// Triangles of a material with alpha mask or blend only compete with their own material.
Normalisation normalise_geometry(SceneData& scene, std::vector<DVec3>&& world, Notes& notes);

}  // namespace ln::gltf
