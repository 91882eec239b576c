#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <ctime>
#include <set>
#include <string>

#include "test_emitters_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// Sum over all emissive triangles of the irradiance that each causes alone, without shadows.
Color brute_force(const SceneOfLights& scene, const Vec3& p, const Vec3& n) {
  glm::dvec3 sum(0);
  for (const Part& part : scene.data.parts) {
    const Material& m = scene.data.materials[part.material];
    for (std::uint32_t k = part.first_triangle; k < part.first_triangle + part.triangle_count; ++k) {
      const UVec3 i = scene.data.triangles[k];
      const std::vector<Vec3> corners{scene.data.positions[i.x], scene.data.positions[i.y], scene.data.positions[i.z]};
      const Vec3 ng = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      if (!m.double_sided && glm::dot(ng, p - corners[0]) <= 0) continue;
      sum += glm::dvec3(m.emission) * polygon_irradiance(corners, p, n);
    }
  }
  for (const PunctualLight& light : scene.data.lights) {
    const Vec3 d = light.kind == PunctualKind::directional ? -light.direction : light.position - p;
    const double length = glm::length(DVec3(d)), cosine = glm::dot(DVec3(d), DVec3(n)) / length;
    if (cosine <= 0) continue;
    double e = cosine;
    if (light.kind != PunctualKind::directional) e /= length * length;
    if (light.kind == PunctualKind::spot) {
      const double cd = -glm::dot(DVec3(d), DVec3(light.direction)) / length;
      const double scale = 1 / std::max(0.001, static_cast<double>(light.cos_inner) - static_cast<double>(light.cos_outer));
      const double a = std::clamp((cd - static_cast<double>(light.cos_outer)) * scale, 0.0, 1.0);
      e *= a * a;
    }
    sum += glm::dvec3(light.intensity) * e;
  }
  return Color(sum);
}

Hit hit_of(std::uint32_t triangle, float u = 0.3f, float v = 0.3f) { return {1, triangle, u, v}; }

}  // namespace

TEST_CASE("irradiance of polygons: Lambert's formula") {
  const struct {
    const char* name;
    Vec3 a, e1, e2, p;
  } cases[] = {
      {"above", {-0.2f, -0.3f, 1}, {0, 0.6f, 0}, {0.5f, 0, 0}, {0.1f, 0, 0}},
      {"tiny", {0.3f, 0.2f, 0.7f}, {0, 1e-6f, 0}, {1e-6f, 0, 0}, {0.1f, 0, 0}},
      {"tiny, tilted", {0.3f, 0.2f, 0.7f}, {0, 1e-6f, 1e-6f}, {1e-6f, 0, 0}, {0.1f, 0, 0}},
      {"huge", {-1, -1, 1e-3f}, {0, 2, 0}, {2, 0, 0}, {0.1f, -0.2f, 0}},
      {"close by", {-1, -1, 1e-4f}, {0, 2, 0}, {2, 0, 0}, {0, 0.1f, 0}},
      {"grazing receiver", {0.5f, -0.2f, 1e-3f}, {0.1f, 0.4f, 0.002f}, {0.01f, 0, 0.004f}, {-0.5f, 0, 0}},
      {"light at a right angle, through the horizon", {0.5f, -0.2f, -0.3f}, {0, 0, 1}, {0, 0.4f, 0}, {0, 0, 0}},
      {"grazing light", {0.5f, -0.2f, 0.001f}, {0, 0.4f, 0}, {0.4f, 0, 0}, {-0.2f, 0, 0}},
      {"oblique", {0.1f, -0.2f, 0.4f}, {0.1f, 0.5f, 0.2f}, {0.4f, 0.1f, -0.1f}, {0.1f, 0.3f, 0}},
  };
  const Vec3 n(0, 0, 1);
  const Color radiance(3, 2, 1);
  for (const auto& c : cases) {
    for (const bool quad : {false, true}) {
      const std::string name = c.name;
      CAPTURE(name);
      CAPTURE(quad);
      SceneOfLights scene;
      if (quad)
        scene.add_quad(c.a, c.e1, c.e2, radiance, true);
      else
        scene.add_triangle(c.a, c.a + c.e1, c.a + c.e2, radiance, true);
      const Emitters emitters(scene.data);
      CHECK(emitters.size() == 1);
      const Color e = irradiance(emitters, c.p, n, 256, 21), exact = brute_force(scene, c.p, n);
      for (int i = 0; i < 3; ++i) CHECK(e[i] == doctest::Approx(exact[i]).epsilon(1e-3));
    }
  }
}

TEST_CASE("a light does not light its own plane, wherever rounding puts a point of it") {
  Random random(9);
  for (int i = 0; i < 50; ++i) {
    SceneOfLights scene;
    const Vec3 a = 0.5f * random.cube(), e1 = 0.4f * random.cube(), e2 = 0.4f * random.cube();
    scene.add_quad(a, e1, e2, Color(1), i % 2 == 0);
    const Emitters emitters(scene.data);
    const Vec3 n = glm::normalize(glm::cross(e1, e2));
    for (int k = 0; k < 40; ++k) {
      const float s = random(), t = random();
      const Vec3 pa = (1 - s - t) * a, pb = s * (a + e1), pc = t * (a + e2);
      const SurfacePosition at{pa + pb + pc, position_error(glm::abs(pa) + glm::abs(pb) + glm::abs(pc)), n};
      for (const float side : {-1.0f, 1.0f}) {
        CHECK(emitters.sample(at, side * n, random(), random.square()).pdf_w == 0);
        CHECK(emitters.pdf_w(at, side * n, hit_of(0), n) == 0);
      }
      const SurfacePosition above{at.p + 1e-4f * n, at.error, n};
      CHECK(emitters.sample(above, -n, random(), random.square()).pdf_w > 0);
    }
  }
}

TEST_CASE("point, spot and directional lights: closed forms") {
  const Vec3 n = glm::normalize(Vec3(0.1f, 0.2f, 1)), p(0.1f, -0.2f, 0.05f);
  SceneOfLights point, spot, directional;
  point.add_point({0.3f, 0.4f, 0.9f}, Color(1, 2, 3));
  spot.add_spot({0.3f, 0.4f, 0.9f}, {-0.1f, -0.9f, -1}, Color(1, 2, 3), 0.1f, 0.6f);
  directional.add_directional({1, 2, -3}, Color(1, 2, 3));
  for (const SceneOfLights* scene : {&point, &spot, &directional}) {
    const Emitters emitters(scene->data);
    CHECK(emitters.has_delta());
    CHECK(!emitters.has_area());
    const Color e = irradiance(emitters, p, n, 1, 1), exact = brute_force(*scene, p, n);
    CHECK(exact.x > 0);
    for (int i = 0; i < 3; ++i) CHECK(e[i] == doctest::Approx(exact[i]).epsilon(1e-4));
    const LightSample s = emitters.sample(receiver(p, n), n, 0.5f, {0.5f, 0.5f});
    CHECK(s.delta);
    CHECK(s.pdf_w == 1);
    CHECK(std::isfinite(s.distance) == (scene != &directional));
  }
}

TEST_CASE("a small light converges to a point light") {
  SceneOfLights small, point;
  const float size = 1e-6f;
  small.add_quad({0.3f, 0.4f, 0.9f}, {0, size, 0}, {size, 0, 0}, Color(1 / (size * size)));
  point.add_point({0.3f, 0.4f, 0.9f}, Color(1));
  const Emitters emitters(small.data);
  const Vec3 n(0, 0, 1), p(0.2f, 0.1f, 0);
  const LightSample s = emitters.sample(receiver(p), n, 0.5f, {0.4f, 0.7f});
  // The quad's own coordinates are rounded, so its area is not exactly size^2.
  const Color e = s.radiance * (s.wi.z / s.pdf_w), exact = brute_force(small, p, n);
  CHECK(e.x == doctest::Approx(exact.x).epsilon(1e-4));
  CHECK(irradiance(emitters, p, n, 16, 3).x == doctest::Approx(exact.x).epsilon(1e-3));
}

TEST_CASE("probabilities of all emitters add up to one wherever some light can arrive") {
  const SceneOfLights scene = SceneOfLights::many(300, 31);
  const Emitters emitters(scene.data);
  CHECK(emitters.size() > 295);
  Random random(32);
  for (int i = 0; i < 60; ++i) {
    const Vec3 p = i % 3 == 0 ? 3.0f * random.cube() : random.cube();
    const Vec3 n = i % 5 == 0 ? Vec3(0) : random.direction();
    const SurfacePosition at = receiver(p, n);
    // Find the probabilities of surfaces by their densities, of the others by counting.
    double surfaces = 0;
    std::vector<double> pmf(scene.data.triangles.size());
    for (std::uint32_t t = 0; t < scene.data.triangles.size(); ++t) {
      const UVec3 k = scene.data.triangles[t];
      const float pdf_w = emitters.pdf_w(at, n, hit_of(t), glm::normalize(scene.data.positions[k.x] - p));
      const double solid =
          triangle_solid_angle(scene.data.positions[k.x], scene.data.positions[k.y], scene.data.positions[k.z], p);
      pmf[t] = static_cast<double>(pdf_w) * solid;
      surfaces += pmf[t];
    }
    int found_surfaces = 0;
    double punctual = 0;
    std::set<std::pair<float, float>> seen;
    constexpr int kCount = 20000;
    int nothing = 0;
    for (int j = 0; j < kCount; ++j) {
      const LightSample s = emitters.sample(at, n, (static_cast<float>(j) + 0.5f) / kCount, {0.5f, 0.5f});
      if (s.delta) {
        if (seen.insert({s.position.p.x, s.position.p.y}).second) punctual += static_cast<double>(s.pdf_w);
      } else if (s.pdf_w > 0) {
        ++found_surfaces;
      } else {
        ++nothing;  // a light that shows its back after all
      }
    }
    CHECK(surfaces + punctual <= 1.001);
    CHECK(surfaces + punctual + static_cast<double>(nothing) / kCount == doctest::Approx(1).epsilon(5e-3));
    CHECK(surfaces == doctest::Approx(static_cast<double>(found_surfaces) / kCount).epsilon(5e-3));
  }
}

TEST_CASE("pdf_w is the density of sample") {
  SceneOfLights scene = SceneOfLights::many(60, 41);
  scene.add_quad({0.3f, -0.4f, 0.2f}, {0.1f, 0.2f, 0}, {-0.1f, 0.1f, 0.3f}, Color(5), true);
  const Emitters emitters(scene.data);
  Random random(42);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = random.cube(), n = i % 4 == 0 ? Vec3(0) : random.direction();
    const SurfacePosition at = receiver(p, n);
    const LightSample s = emitters.sample(at, n, random(), random.square());
    if (!(s.pdf_w > 0) || s.delta) continue;
    CHECK(glm::length(s.wi) == doctest::Approx(1).epsilon(1e-5));
    CHECK(glm::distance(p + s.distance * s.wi, s.position.p) < 1e-5f);
    // Which triangle is it? The one whose plane holds the point and that contains it.
    bool found = false;
    for (std::uint32_t t = 0; t < scene.data.triangles.size() && !found; ++t) {
      const UVec3 k = scene.data.triangles[t];
      const DVec3 a(scene.data.positions[k.x]), e1 = DVec3(scene.data.positions[k.y]) - a,
                                                e2 = DVec3(scene.data.positions[k.z]) - a;
      const DVec3 d = DVec3(s.position.p) - a, c = glm::cross(e1, e2);
      const double area2 = glm::dot(c, c), u = glm::dot(glm::cross(d, e2), c) / area2,
                   v = glm::dot(glm::cross(e1, d), c) / area2;
      if (std::abs(glm::dot(d, c)) / std::sqrt(area2) > 1e-6 || u < -1e-3 || v < -1e-3 || u + v > 1.001) continue;
      found = true;
      const Hit hit{s.distance, t, static_cast<float>(u), static_cast<float>(v)};
      CHECK(emitters.pdf_w(at, n, hit, s.wi) == doctest::Approx(s.pdf_w).epsilon(1e-4));
      CHECK(emitters.radiance(hit, -s.wi) == s.radiance);
    }
    CHECK(found);
  }
}

TEST_CASE("a thousand lights: unbiased") {
  const SceneOfLights scene = SceneOfLights::many(1000, 51);
  const Emitters emitters(scene.data);
  Random random(52);
  for (int r = 0; r < 20; ++r) {
    const Vec3 p = 0.6f * random.cube(), n = random.direction();
    constexpr int kCount = 100000;
    double sum = 0, squares = 0;
    for (int i = 0; i < kCount; ++i) {
      const LightSample s = emitters.sample(receiver(p, n), n, random(), random.square());
      const double x =
          s.pdf_w > 0 ? static_cast<double>(mean_component(s.radiance) * std::max(0.0f, glm::dot(n, s.wi)) / s.pdf_w) : 0.0;
      sum += x;
      squares += x * x;
    }
    const double mean = sum / kCount, error = std::sqrt((squares / kCount - mean * mean) / kCount);
    CHECK(std::abs(mean - static_cast<double>(mean_component(brute_force(scene, p, n)))) < 4.5 * error);
  }
}

TEST_CASE("a thousand lights: far less variance than if chosen by power") {
  Random random(53);
  SceneOfLights scene;
  constexpr float kSize = 0.02f;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 center = 0.55f * random.cube();
    scene.add_triangle(center, center + kSize * random.direction(), center + kSize * random.direction(),
                       Color(std::pow(10.0f, 3 * random())));
  }
  const Emitters emitters(scene.data);
  double by_importance = 0, by_power = 0, worst = 0;
  for (int r = 0; r < 40; ++r) {
    const Vec3 p = 0.6f * random.cube(), n = random.direction();
    // Variance of e_i / probability_i, from the probabilities themselves.
    double e_sum = 0, power_sum = 0, importance_squares = 0, power_squares = 0;
    for (std::uint32_t t = 0; t < 1000; ++t) {
      const UVec3 k = scene.data.triangles[t];
      const std::vector<Vec3> corners{scene.data.positions[k.x], scene.data.positions[k.y], scene.data.positions[k.z]};
      const Vec3 ng = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      const auto radiance = static_cast<double>(scene.data.materials[scene.data.parts[t].material].emission.x);
      const double power = radiance * static_cast<double>(glm::length(ng));
      power_sum += power;
      const double e = glm::dot(ng, p - corners[0]) > 0 ? radiance * polygon_irradiance(corners, p, n) : 0.0;
      if (e == 0) continue;
      const double pmf = static_cast<double>(emitters.pdf_w(receiver(p), n, hit_of(t), n)) *
                         triangle_solid_angle(corners[0], corners[1], corners[2], p);
      e_sum += e;
      importance_squares += e * e / pmf;
      power_squares += e * e / power;
    }
    if (e_sum == 0) continue;
    const double importance = importance_squares / (e_sum * e_sum) - 1, power = power_sum * power_squares / (e_sum * e_sum) - 1;
    by_importance += importance / 40;
    by_power += power / 40;
    worst = std::max(worst, importance / power);
  }
  MESSAGE("relative variance by importance " << by_importance << ", by power " << by_power << ", largest ratio " << worst);
  CHECK(by_importance < 0.1 * by_power);
  CHECK(worst < 1);
}

TEST_CASE("no light that contributes is excluded, wherever the receiver is") {
  SceneOfLights scene;
  Random random(61);
  // A cluttered set: some in one plane, some in one place, some facing each other.
  for (int i = 0; i < 40; ++i)
    scene.add_triangle({0.1f * (i % 7), 0.1f * (i / 7), 0.5f}, {0.1f * (i % 7), 0.1f * (i / 7) + 0.08f, 0.5f},
                       {0.1f * (i % 7) + 0.08f, 0.1f * (i / 7), 0.5f}, Color(1));
  for (int i = 0; i < 20; ++i) scene.add_triangle({0, 0, 0.2f}, {0.1f, 0, 0.2f}, {0, 0.1f, 0.2f}, Color(2));
  for (int i = 0; i < 20; ++i)
    scene.add_triangle({-0.5f, 0.05f * i, 0}, {-0.5f, 0.05f * i, 0.3f}, {-0.5f, 0.05f * i + 0.04f, 0.3f}, Color(2), i % 2 == 0);
  const Emitters emitters(scene.data);
  for (int i = 0; i < 4000; ++i) {
    Vec3 p = 0.7f * random.cube(), n = random.direction();
    if (i % 4 == 1) p.z = 0.5f;                                      // in the plane of many
    if (i % 4 == 2) p = {-0.5f + 1e-6f * random(), random(), 0.1f};  // just in front of some
    if (i % 4 == 3) p = {0.02f, 0.02f, 0.2f - 1e-5f * random()};     // inside the bounds of the stack
    if (i % 5 == 0) n = {0, 0, 1};
    if (i % 11 == 0) n = Vec3(0);
    const SurfacePosition at = receiver(p, n);
    double sum = 0;
    for (std::uint32_t t = 0; t < scene.data.triangles.size(); ++t) {
      const UVec3 k = scene.data.triangles[t];
      const std::vector<Vec3> corners{scene.data.positions[k.x], scene.data.positions[k.y], scene.data.positions[k.z]};
      const Vec3 ng = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      const Part& part = scene.data.parts[t];
      const float side = glm::dot(ng, p - corners[0]);
      const bool front = side > 0 || (scene.data.materials[part.material].double_sided && side != 0);
      const float pdf_w = emitters.pdf_w(at, n, hit_of(t), n);
      CHECK(pdf_w >= 0);
      const double solid = triangle_solid_angle(corners[0], corners[1], corners[2], p);
      const double e = !front ? 0 : n == Vec3(0) ? solid : polygon_irradiance(corners, p, n);
      if (e > 1e-9) CHECK(pdf_w > 0);
      if (pdf_w < kInfinity) sum += static_cast<double>(pdf_w) * solid;
    }
    CHECK(sum < 1.01);
    const LightSample s = emitters.sample(at, n, random(), random.square());
    CHECK(s.pdf_w >= 0);
    CHECK(is_finite(s.radiance));
    CHECK(is_finite(s.wi));
  }
}

TEST_CASE("no spot that reaches the receiver is excluded") {
  Random random(63);
  for (int i = 0; i < 300; ++i) {
    // A spot of which the receiver sees the rim, beside others.
    SceneOfLights scene;
    const Vec3 p = 0.5f * random.cube();
    for (int k = 0; k < 20; ++k) {
      const Vec3 position = random.cube(), axis = random.direction(),
                 side = glm::normalize(glm::cross(axis, random.direction()));
      const float angle = 0.199f * random();
      scene.add_spot(position, std::cos(angle) * axis + std::sin(angle) * side, Color(1), 0.1f, 0.2f);
      if (k == 0) scene.data.lights[0].position = p - 0.5f * axis;
    }
    const Emitters emitters(scene.data);
    const Vec3 n = glm::normalize(scene.data.lights[0].position - p + 0.4f * random.direction());
    // Each light that is ever found, once.
    std::set<std::pair<float, float>> found;
    double e = 0;
    for (int k = 0; k < 20000; ++k) {
      const LightSample s = emitters.sample(receiver(p, n), n, (static_cast<float>(k) + 0.5f) / 20000, {0.5f, 0.5f});
      if (s.pdf_w > 0 && found.insert({s.position.p.x, s.position.p.y}).second)
        e += static_cast<double>(s.radiance.x * std::max(0.0f, glm::dot(n, s.wi)));
    }
    CHECK(e == doctest::Approx(brute_force(scene, p, n).x).epsilon(1e-3));
  }
}

TEST_CASE("receivers that nothing can reach get nothing") {
  SceneOfLights scene;
  scene.add_quad({-0.2f, -0.2f, 0.5f}, {0, 0.4f, 0}, {0.4f, 0, 0}, Color(1));  // shines down
  SUBCASE("one light") {}
  SUBCASE("two lights") { scene.add_quad({-0.2f, 0.5f, 0.5f}, {0, 0.4f, 0}, {0.4f, 0, 0}, Color(1)); }
  const Emitters emitters(scene.data);
  const Vec3 n(0, 0, 1);
  for (const Vec3& p : {Vec3(0, 0, 0.8f), Vec3(0, 0, 0.5f), Vec3(0.9f, 0, 0.5f), Vec3(-0.2f, -0.2f, 0.5f)})
    CHECK(emitters.sample(receiver(p), n, 0.3f, {0.5f, 0.5f}).pdf_w == 0);
  CHECK(emitters.pdf_w(receiver({0, 0, 0.8f}), n, hit_of(0), -n) == 0);
  CHECK(emitters.sample(receiver({0, 0, 0}), n, 0.3f, {0.5f, 0.5f}).pdf_w > 0);
}

TEST_CASE("surfaces emit on the front, on both sides where they are double-sided; others not at all") {
  SceneOfLights scene;
  scene.add_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, Color(1, 2, 3));
  scene.add_triangle({0, 0, 0.5f}, {1, 0, 0.5f}, {0, 1, 0.5f}, Color(4), true);
  scene.add_triangle({0, 0, 0.7f}, {1, 0, 0.7f}, {0, 1, 0.7f}, Color(0));
  const Emitters emitters(scene.data);
  CHECK(emitters.size() == 2);
  const Vec3 up = glm::normalize(Vec3(0.3f, 0, 1));
  CHECK(emitters.radiance(hit_of(0), up) == Color(1, 2, 3));
  CHECK(emitters.radiance(hit_of(0), -up) == Color(0));
  CHECK(emitters.radiance(hit_of(1), up) == Color(4));
  CHECK(emitters.radiance(hit_of(1), -up) == Color(4));
  CHECK(emitters.radiance(hit_of(2), up) == Color(0));
  CHECK(emitters.pdf_w(receiver({0.1f, 0.1f, 0.6f}), Vec3(0), hit_of(2), up) == 0);
  CHECK(emitters.environment(up) == Color(0));
  CHECK(emitters.environment_pdf_w(receiver({}), up, up) == 0);

  // A selection knows only its own.
  const Emitters second(scene.data, nullptr, [](std::size_t part) { return part == 1; }, [](std::size_t) { return false; });
  CHECK(second.size() == 1);
  CHECK(second.radiance(hit_of(0), up) == Color(0));
  CHECK(second.radiance(hit_of(1), up) == Color(4));
  CHECK(second.pdf_w(receiver({0.1f, 0.1f, 0.1f}), Vec3(0), hit_of(0), up) == 0);
  const Emitters none(scene.data, nullptr, [](std::size_t) { return false; }, [](std::size_t) { return false; });
  CHECK(none.empty());
  CHECK(!none.has_area());
  CHECK(none.sample(receiver({}), up, 0.5f, {0.5f, 0.5f}).pdf_w == 0);
  CHECK(is_black(none.emit(0.5f, {0.5f, 0.5f}, {0.5f, 0.5f}).flux));
}

TEST_CASE("emission that varies over a surface: textures, and colours of unlit surfaces") {
  // A texture of two texels, black and white, repeated; its border lies across the triangle.
  SceneOfLights scene;
  scene.add_triangle({0, 0, 0.5f}, {0, 0.4f, 0.5f}, {0.4f, 0, 0.5f}, Color(4, 2, 1));
  Image image;
  image.width = 2, image.height = 1, image.channels = 3;
  image.bytes = {0, 0, 0, 255, 255, 255};
  scene.data.images.push_back(image);
  scene.data.materials[0].emissive_texture.image = 0;
  scene.data.materials[0].emissive_texture.nearest = true;
  scene.data.uvs[0] = {{0, 0}, {0, 0}, {1, 0}};
  SUBCASE("texture") {}
  SUBCASE("vertex colours") {
    scene.data.materials[0].emissive_texture = {};
    scene.data.materials[0].unlit = true;
    scene.data.parts[0].has_colors = true;
    scene.data.colors = {{0, 0, 0, 1}, {0, 0, 0, 1}, {1, 1, 1, 1}};
  }
  const bool texture = !scene.data.materials[0].unlit;
  const Emitters emitters(scene.data);
  const Vec3 down(0, 0, -1);
  CHECK(emitters.radiance(hit_of(0, 0.1f, 0.2f), down).y == doctest::Approx(texture ? 0.0f : 0.4f));
  CHECK(emitters.radiance(hit_of(0, 0.1f, 0.8f), down).y == doctest::Approx(texture ? 2.0f : 1.6f));
  CHECK(emitters.radiance(hit_of(0, 0.1f, 0.8f), -down) == Color(0));

  // The bright part is the quarter at the third corner; the vertices' mean colour is a third.
  const double mean = texture ? 0.25 : 1.0 / 3;
  CHECK(emitters.total_power().x == doctest::Approx(4 * mean * kPi * 0.08).epsilon(0.1));
  Random random(81);
  double flux = 0;
  for (int i = 0; i < 100000; ++i)
    flux += static_cast<double>(emitters.emit(random(), random.square(), random.square()).flux.x) / 100000;
  CHECK(flux == doctest::Approx(4 * mean * kPi * 0.08).epsilon(0.02));
  for (int i = 0; i < 1000; ++i) {
    const LightSample s = emitters.sample(receiver({0, 0, 0}), -down, random(), random.square());
    CHECK(s.pdf_w > 0);
    const float v = s.position.p.x / 0.4f, u = s.position.p.y / 0.4f;
    if (std::abs(v - 0.5f) > 1e-4f)
      CHECK(s.radiance.x == doctest::Approx(emitters.radiance(hit_of(0, u, v), down).x).epsilon(1e-4));
  }
}

TEST_CASE("lights without area or power are left out; extreme radiances are not") {
  SceneOfLights scene;
  scene.add_triangle({0, 0, 0}, {1, 0, 0}, {0.5f, 0, 0}, Color(1));
  scene.add_triangle({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, Color(1));
  scene.add_point({0, 0, 0}, Color(0));
  CHECK(Emitters(scene.data).empty());
  scene.add_triangle({0, 0, 0.5f}, {0, 0.1f, 0.5f}, {0.1f, 0, 0.5f}, Color(1e-30f));
  scene.add_triangle({0, 0, 0.6f}, {0, 0.1f, 0.6f}, {0.1f, 0, 0.6f}, Color(1e30f));
  const Emitters emitters(scene.data);
  CHECK(emitters.size() == 2);
  const LightSample s = emitters.sample(receiver({}), {0, 0, 1}, 0.7f, {0.5f, 0.5f});
  CHECK(s.pdf_w > 0);
  CHECK(std::isfinite(s.pdf_w));
  const PhotonEmission photon = emitters.emit(0.5f, {0.5f, 0.5f}, {0.5f, 0.5f});
  CHECK(photon.flux.x > 0);
  CHECK(std::isfinite(photon.flux.x));
}

TEST_CASE("two triangles of a parallelogram are one light, of another quadrilateral two") {
  SceneOfLights square, kite, unequal;
  square.add_quad({-0.278f, 0.1f, 0.31f}, {0.13f, 0.2f, 0.01f}, {-0.2f, 0.13f, 0.05f}, Color(1));
  CHECK(Emitters(square.data).size() == 1);
  kite.add_part({{0, 0, 0}, {1, 0, 0}, {1.1f, 1, 0}, {0, 0, 0}, {1.1f, 1, 0}, {0, 1, 0}}, kite.add_material(Color(1)));
  CHECK(Emitters(kite.data).size() == 2);
  unequal.add_triangle({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, Color(1));
  unequal.add_triangle({0, 0, 0}, {1, 1, 0}, {0, 1, 0}, Color(2));
  CHECK(Emitters(unequal.data).size() == 2);
}

TEST_CASE("a hundred thousand lights are ready soon, and the same every time") {
  const SceneOfLights scene = SceneOfLights::many(100000, 71);
  const std::clock_t start = std::clock();
  const Emitters emitters(scene.data);
  MESSAGE("processor seconds to build: " << static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  const Emitters again(scene.data);
  Random random(72);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random.cube(), n = random.direction();
    const float pick = random();
    const Vec2 u = random.square();
    const LightSample a = emitters.sample(receiver(p, n), n, pick, u), b = again.sample(receiver(p, n), n, pick, u);
    CHECK(a.pdf_w == b.pdf_w);
    CHECK(a.position.p == b.position.p);
  }
}
