#pragma once
// Scenes made by hand for the tests of photons.

#include <cstring>
#include <functional>
#include <vector>

#include "ln/photon_tracer.hpp"

namespace ln::test {

/// Collects quads into a SceneData; coordinates must lie in [-1, 1].
class SceneBuilder {
 public:
  SceneBuilder() { data.materials.clear(); }

  std::uint32_t material(const Color& albedo, const Color& emission = Color(0)) {
    Material m;
    m.base_color = albedo;
    m.metallic = 0;
    m.roughness = 1;
    m.specular = 0;  // exactly Lambertian
    m.emission = emission;
    return add(m);
  }

  std::uint32_t mirror(const Color& color = Color(1)) {
    Material m;
    m.base_color = color;
    m.metallic = 1;
    m.roughness = 0;
    return add(m);
  }

  std::uint32_t glossy(const Color& color) {
    Material m;
    m.base_color = color;
    m.metallic = 0;
    m.roughness = 0.4f;
    return add(m);
  }

  /// Corners counter-clockwise as seen from the front, cut into `n` x `n` pairs of triangles.
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, std::uint32_t material, int n = 1) {
    begin(material);
    const auto first = static_cast<std::uint32_t>(data.positions.size());
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        const float u = static_cast<float>(i) / static_cast<float>(n), v = static_cast<float>(j) / static_cast<float>(n);
        data.positions.push_back((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c));
      }
    }
    const auto row = static_cast<std::uint32_t>(n + 1);
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(n); ++j) {
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
        const std::uint32_t k = first + j * row + i;
        triangle({k, k + 1, k + row + 1});
        triangle({k, k + row + 1, k + row});
      }
    }
  }

  /// A closed box; the fronts look inwards, or outwards.
  void box(const Vec3& low, const Vec3& high, std::uint32_t material, bool inwards = true, int n = 1) {
    const auto corner = [&](int i) { return Vec3(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z); };
    const int faces[6][4] = {{0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4},
                             {1, 5, 7, 3}, {0, 1, 3, 2}, {4, 6, 7, 5}};  // seen from inside
    for (const auto& f : faces) {
      if (inwards)
        quad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]), material, n);
      else
        quad(corner(f[3]), corner(f[2]), corner(f[1]), corner(f[0]), material, n);
    }
  }

  /// A sphere of 2 n x n quads.
  void sphere(const Vec3& center, float radius, std::uint32_t material, bool inwards, int n) {
    begin(material);
    const auto first = static_cast<std::uint32_t>(data.positions.size());
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= 2 * n; ++i) {
        const float theta = kPi * static_cast<float>(j) / static_cast<float>(n);
        const float phi = kPi * static_cast<float>(i % (2 * n)) / static_cast<float>(n);
        const float s = j == 0 || j == n ? 0.0f : std::sin(theta);
        data.positions.push_back(center + radius * Vec3(s * std::cos(phi), s * std::sin(phi), std::cos(theta)));
      }
    }
    const auto row = static_cast<std::uint32_t>(2 * n + 1);
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(n); ++j) {
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(2 * n); ++i) {
        const std::uint32_t k = first + j * row + i;
        UVec3 upper{k, k + row, k + row + 1}, lower{k, k + row + 1, k + 1};
        if (inwards) {
          std::swap(upper.y, upper.z);
          std::swap(lower.y, lower.z);
        }
        if (j + 1 < static_cast<std::uint32_t>(n)) triangle(upper);
        if (j > 0) triangle(lower);
      }
    }
  }

  void directional(const Vec3& direction, const Color& irradiance) {
    PunctualLight light;
    light.kind = PunctualKind::directional;
    light.direction = glm::normalize(direction);
    light.intensity = irradiance;
    data.lights.push_back(light);
  }

  SceneData data;

 private:
  std::uint32_t add(const Material& m) {
    data.materials.push_back(m);
    return static_cast<std::uint32_t>(data.materials.size() - 1);
  }

  void begin(std::uint32_t material) {
    Part part;
    part.first_triangle = static_cast<std::uint32_t>(data.triangles.size());
    part.material = material;
    data.parts.push_back(part);
  }

  void triangle(const UVec3& t) {
    data.triangles.push_back(t);
    data.triangle_part.push_back(static_cast<std::uint32_t>(data.parts.size() - 1));
    ++data.parts.back().triangle_count;
  }
};

/// A scene with what is needed to prepare operators on it.
struct Stage {
  explicit Stage(SceneData data, int threads = 2, std::uint64_t seed = 1)
      : workers(threads), scene(std::move(data), {}, threads, nullptr), context(scene, workers, seed, 4) {}

  Workers workers;
  Scene scene;
  PrepareContext context;
};

// Path expressions, as the compiler writes them.
struct AnyPath {  // (D|G|S)*
  static constexpr int next[][3] = {{0, 0, 0}};
  static constexpr bool accepting[] = {true};
};
struct EmptyPath {
  static constexpr int next[][3] = {{-1, -1, -1}};
  static constexpr bool accepting[] = {true};
};
struct SpecularPath {  // S+
  static constexpr int next[][3] = {{-1, -1, 1}, {-1, -1, 1}};
  static constexpr bool accepting[] = {false, true};
};
struct OneDiffuse {  // D
  static constexpr int next[][3] = {{1, -1, -1}, {-1, -1, -1}};
  static constexpr bool accepting[] = {false, true};
};
struct OneGlossy {  // G
  static constexpr int next[][3] = {{-1, 1, -1}, {-1, -1, -1}};
  static constexpr bool accepting[] = {false, true};
};
struct OneSmooth {  // D|G, in two states that must be told apart
  static constexpr int next[][3] = {{1, 2, -1}, {-1, -1, -1}, {-1, -1, -1}};
  static constexpr bool accepting[] = {false, true, true};
};

/// A scene and its photons.
struct Traced {
  explicit Traced(const SceneData& data, std::uint64_t count, const PathAutomaton& via = path_automaton<AnyPath>(),
                  int threads = 2)
      : stage(data, threads), photons(trace_photons(stage.context, 1, stage.scene.emitters(), via, count)) {}

  Stage stage;
  Photons photons;
};

/// A horizontal square in one piece or `pieces` x `pieces`, at a height of 0.01.
inline void add_floor(SceneBuilder& b, int pieces = 1) {
  b.quad({-0.7f, 0.01f, 0.7f}, {0.7f, 0.01f, 0.7f}, {0.7f, 0.01f, -0.7f}, {-0.7f, 0.01f, -0.7f}, b.material(Color(0.5f)),
         pieces);
}

/// On the floor, from front to back: a wall without thickness at x = 0, and a roof from its top over all that is left of it.
inline void add_thin_wall(SceneBuilder& b) {
  b.quad({0, 0.01f, 0.7f}, {0, 0.01f, -0.7f}, {0, 0.5f, -0.7f}, {0, 0.5f, 0.7f}, b.material(Color(0)));
  b.quad({0, 0.5f, 0.7f}, {0, 0.5f, -0.7f}, {-0.7f, 0.5f, -0.7f}, {-0.7f, 0.5f, 0.7f}, b.material(Color(0)));
}

/// Mean of a function over the unit square.
inline double mean_over_square(const std::function<double(Vec2)>& function, std::uint32_t n = 4000) {
  const SampleStream random(17, 0);
  double sum = 0;
  for (std::uint32_t i = 0; i < n; ++i) sum += function(random.get2(0, i, n));
  return sum / n;
}

/// A direction from a point of the unit square, evenly over the sphere.
inline Vec3 direction_at(const Vec2& u) {
  const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
  return {r * std::cos(2 * kPi * u.y), r * std::sin(2 * kPi * u.y), z};
}

inline DVec3 total_flux(const Photons& photons) {
  DVec3 sum(0);
  for (const Photon& p : photons.hits) sum += DVec3(p.flux.unpack());
  return sum;
}

}  // namespace ln::test
