#pragma once
// Where particles are aimed at: what can start a light path that is wanted (Jensen's projection maps, as balls).

#include <vector>

#include "ln/scene_data.hpp"

namespace ln {

/// Balls around triangles. Light that meets none of them meets none of the triangles, so that it can be left out.
class PhotonAim {
 public:
  /// A choice and the measure that it stands for: the inverse of its density.
  struct Direction {
    Vec3 w{0, 0, 1};
    float solid_angle = 0;
  };
  struct Origin {
    Vec3 p{0};  // on the plane through the scene's centre, perpendicular to the light
    float area = 0;
  };

  /// At the parts with `wanted[part]`.
  PhotonAim(const SceneData& data, const std::vector<bool>& wanted);

  /// Sum of the balls' solid angles from a point; infinite inside of one.
  float solid_angle(const Vec3& from) const;
  /// A direction towards one of the balls; solid_angle(from) must be finite.
  Direction direction(const Vec3& from, const Vec2& u) const;

  /// Sum of the balls' cross sections.
  float cross_section() const;
  /// A point from which parallel light in direction `w` meets a ball.
  Origin origin(const Vec3& w, const Vec2& u) const;

  /// Number of balls that the ray meets; those around its start count.
  int met(const Vec3& from, const Vec3& w) const;

 private:
  struct Ball {
    Vec3 center;
    float radius;
  };

  std::vector<Ball> balls_;
};

}  // namespace ln
