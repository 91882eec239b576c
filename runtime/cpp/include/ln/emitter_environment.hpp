#pragma once
// Light from all around: a lat-long picture, or one radiance everywhere.
//
// Orientation (that of OpenEXR's lat-long maps): y is up and at the top of the picture, +z in its centre, +x a quarter of
// the width left of the centre. Radiance is interpolated bilinearly between the centres of the pixels.

#include "ln/distribution.hpp"
#include "ln/scene_data.hpp"

namespace ln {

class Environment {
 public:
  struct Sample {
    Vec3 w{0, 1, 0};
    float pdf_w = 0;  // 0: there is no light
  };

  /// `image` (any channel count; values that are negative or not finite count as 0) is referred to, not copied.
  explicit Environment(const Image& image);

  /// Radiance [W/(m^2 sr)] that arrives from direction `w`, unit length.
  Color radiance(const Vec3& w) const { return constant_ ? mean_ : interpolated(w); }
  /// Mean radiance over the sphere.
  const Color& mean() const { return mean_; }
  bool is_black() const { return ln::is_black(mean_); }

  /// A direction with density proportional to radiance, constant within each pixel. The same radiance everywhere: uniform
  /// over the sphere.
  Sample sample(const Vec2& u) const;
  float pdf_w(const Vec3& w) const;
  /// The same for a receiver with normal `n`: the same radiance everywhere is sampled by the cosine to `n`. `n` = 0: as above.
  Sample sample(const Vec3& n, const Vec2& u) const;
  float pdf_w(const Vec3& n, const Vec3& w) const;

 private:
  Color interpolated(const Vec3& w) const;
  Color light_of(int x, int y) const;
  /// Where direction `w` is in the picture, in pixels.
  Vec2 picture_position(const Vec3& w) const;

  const Image* image_;
  bool constant_ = false;
  Color mean_{0};
  std::vector<float> pixel_solid_angle_;  // by row
  Distribution rows_;
  std::vector<Distribution> columns_;  // by row
};

}  // namespace ln
