#pragma once
// Small scenes of light sources for the tests of emitters, and what they are compared with.

#include <cmath>
#include <random>
#include <vector>

#include "ln/emitters.hpp"

namespace ln::test {

struct Random {
  std::mt19937 engine;
  explicit Random(std::uint32_t seed) : engine(seed) {}
  float operator()() { return static_cast<float>(engine() >> 8) * 0x1p-24f; }
  Vec2 square() { return {(*this)(), (*this)()}; }
  Vec3 cube() { return {2 * (*this)() - 1, 2 * (*this)() - 1, 2 * (*this)() - 1}; }
  Vec3 direction() {
    const float z = 1 - 2 * (*this)(), r = std::sqrt(std::max(0.0f, 1 - z * z)), phi = 2 * kPi * (*this)();
    return {r * std::cos(phi), r * std::sin(phi), z};
  }
};

struct SceneOfLights {
  SceneData data;

  std::uint32_t add_material(const Color& emission, bool double_sided = false) {
    Material m;
    m.emission = emission;
    m.double_sided = double_sided;
    data.materials.push_back(m);
    return static_cast<std::uint32_t>(data.materials.size() - 1);
  }
  /// A part of its own for these triangles (three corners each).
  void add_part(const std::vector<Vec3>& corners, std::uint32_t material) {
    Part part;
    part.first_triangle = static_cast<std::uint32_t>(data.triangles.size());
    part.triangle_count = static_cast<std::uint32_t>(corners.size() / 3);
    part.material = material;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      const auto k = static_cast<std::uint32_t>(data.positions.size());
      data.positions.insert(data.positions.end(), {corners[i], corners[i + 1], corners[i + 2]});
      data.triangles.push_back({k, k + 1, k + 2});
      data.triangle_part.push_back(static_cast<std::uint32_t>(data.parts.size()));
    }
    data.parts.push_back(part);
  }
  void add_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Color& emission, bool double_sided = false) {
    add_part({a, b, c}, add_material(emission, double_sided));
  }
  void add_quad(const Vec3& a, const Vec3& e1, const Vec3& e2, const Color& emission, bool double_sided = false) {
    const Vec3 b = a + e1, c = a + e1 + e2, d = a + e2;
    add_part({a, b, c, a, c, d}, add_material(emission, double_sided));
  }
  void add_point(const Vec3& position, const Color& intensity) {
    PunctualLight light;
    light.position = position;
    light.intensity = intensity;
    data.lights.push_back(light);
  }
  void add_spot(const Vec3& position, const Vec3& direction, const Color& intensity, float inner, float outer) {
    PunctualLight light;
    light.kind = PunctualKind::spot;
    light.position = position;
    light.direction = glm::normalize(direction);
    light.intensity = intensity;
    light.cos_inner = std::cos(inner);
    light.cos_outer = std::cos(outer);
    data.lights.push_back(light);
  }
  void add_directional(const Vec3& direction, const Color& irradiance) {
    PunctualLight light;
    light.kind = PunctualKind::directional;
    light.direction = glm::normalize(direction);
    light.intensity = irradiance;
    data.lights.push_back(light);
  }

  /// `count` small triangles, and a few punctual lights, all over the unit ball with powers over three decades.
  static SceneOfLights many(int count, std::uint32_t seed) {
    Random random(seed);
    SceneOfLights scene;
    for (int i = 0; i < count; ++i) {
      const Vec3 center = 0.55f * random.cube();
      const Color emission = std::pow(10.0f, 3 * random()) * Color(0.5f + random(), 0.5f + random(), 0.5f + random());
      if (i % 10 == 9) {
        scene.add_point(center, 1e-4f * emission);
      } else if (i % 10 == 8) {
        scene.add_spot(center, random.direction(), 1e-4f * emission, 0.3f, 0.6f);
      } else {
        const float size = 0.02f;
        scene.add_triangle(center, center + size * random.direction(), center + size * random.direction(), emission,
                           i % 7 == 0);
      }
    }
    return scene;
  }
};

inline SurfacePosition receiver(const Vec3& p, const Vec3& n = {0, 0, 1}) { return {p, 0, n}; }

/// Irradiance at `p` by `grid`^2 stratified samples of each emitter choice.
inline Color irradiance(const Emitters& emitters, const Vec3& p, const Vec3& n, int grid, std::uint32_t seed) {
  Random random(seed);
  glm::dvec3 sum(0);
  for (int y = 0; y < grid; ++y) {
    for (int x = 0; x < grid; ++x) {
      const Vec2 u((static_cast<float>(x) + random()) / static_cast<float>(grid),
                   (static_cast<float>(y) + random()) / static_cast<float>(grid));
      const LightSample s = emitters.sample(receiver(p, n), n, random(), glm::min(u, Vec2(kOneMinusEpsilon)));
      if (s.pdf_w > 0) sum += glm::dvec3(s.radiance) * static_cast<double>(std::max(0.0f, glm::dot(n, s.wi)) / s.pdf_w);
    }
  }
  return Color(sum / (static_cast<double>(grid) * grid));
}

/// Lambert's formula: irradiance / radiance at `p` from a polygon that faces it, clipped at the horizon.
inline double polygon_irradiance(const std::vector<Vec3>& corners, const Vec3& p, const Vec3& n) {
  const DVec3 normal = glm::normalize(DVec3(n));
  std::vector<DVec3> v, clipped;
  for (const Vec3& c : corners) v.push_back(DVec3(c) - DVec3(p));
  for (std::size_t i = 0; i < v.size(); ++i) {
    const DVec3 a = v[i], b = v[(i + 1) % v.size()];
    const double ha = glm::dot(a, normal), hb = glm::dot(b, normal);
    if (ha > 0) clipped.push_back(a);
    if ((ha > 0) != (hb > 0)) clipped.push_back(a + (b - a) * (ha / (ha - hb)));
  }
  double sum = 0;
  for (std::size_t i = 0; i < clipped.size(); ++i) {
    const DVec3 a = clipped[i], b = clipped[(i + 1) % clipped.size()], cross = glm::cross(a, b);
    const double length = glm::length(cross);
    if (length > 0) sum += std::atan2(length, glm::dot(a, b)) * glm::dot(cross, normal) / length;
  }
  return 0.5 * std::abs(sum);
}

/// Solid angle of a triangle seen from `p`, in double precision.
inline double triangle_solid_angle(const DVec3& a, const DVec3& b, const DVec3& c, const DVec3& p) {
  const DVec3 r0 = a - p, r1 = b - p, r2 = c - p;
  const double l0 = glm::length(r0), l1 = glm::length(r1), l2 = glm::length(r2);
  return 2 * std::atan2(std::abs(glm::dot(r0, glm::cross(b - a, c - a))),
                        l0 * l1 * l2 + glm::dot(r0, r1) * l2 + glm::dot(r0, r2) * l1 + glm::dot(r1, r2) * l0);
}

/// Are these counts what is expected? Pearson's test; bins with less than 5 expected are pooled. Significance 0.1 %.
inline bool chi_square_accepts(const std::vector<double>& observed, const std::vector<double>& expected) {
  double sum = 0, pooled_observed = 0, pooled_expected = 0;
  int bins = 0;
  const auto add = [&](double o, double e) {
    sum += (o - e) * (o - e) / e;
    ++bins;
  };
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (expected[i] == 0 && observed[i] > 0) return false;
    if (expected[i] >= 5) {
      add(observed[i], expected[i]);
    } else {
      pooled_observed += observed[i];
      pooled_expected += expected[i];
    }
  }
  if (pooled_expected >= 5) add(pooled_observed, pooled_expected);
  // Wilson & Hilferty's approximation of the 99.9 % quantile.
  const double k = std::max(bins - 1, 1), t = 1 - 2 / (9 * k) + 3.0902 * std::sqrt(2 / (9 * k));
  return sum < k * t * t * t;
}

}  // namespace ln::test
