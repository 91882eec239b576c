#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "test_emitters_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

AreaLight make_light(const Vec3& a, const Vec3& e1, const Vec3& e2, bool quad) { return {a, DVec3(e1), DVec3(e2), quad}; }

double exact_solid_angle(const AreaLight& l, const Vec3& p) {
  const DVec3 a(l.a), b = a + DVec3(l.e1), c = a + DVec3(l.e2), d = b + DVec3(l.e2), q(p);
  return triangle_solid_angle(a, b, c, q) + (l.quad ? triangle_solid_angle(b, d, c, q) : 0.0);
}

/// Chi-square of the directions of samples: their points fall into cells of the light by the cells' solid angles.
bool directions_are_uniform(const AreaLight& light, const Vec3& p, std::uint32_t seed, int count = 200000) {
  constexpr int kCells = 12;
  Random random(seed);
  const DVec3 a(light.a), e1(light.e1), e2(light.e2), q(p);
  const float height = light.height(p);
  const double whole = exact_solid_angle(light, p);
  // Cell (i, j, 0 or 1): the lower or upper half of a square of the grid over (s, t).
  std::vector<double> observed(2 * kCells * kCells), expected(2 * kCells * kCells);
  const auto corner = [&](int i, int j) {
    return a + e1 * (static_cast<double>(i) / kCells) + e2 * (static_cast<double>(j) / kCells);
  };
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const std::size_t k = 2 * (static_cast<std::size_t>(j) * kCells + i);
      if (light.quad || i + j < kCells)
        expected[k] = count / whole * triangle_solid_angle(corner(i, j), corner(i + 1, j), corner(i, j + 1), q);
      if (light.quad || i + j < kCells - 1)
        expected[k + 1] = count / whole * triangle_solid_angle(corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j), q);
    }
  }
  for (int i = 0; i < count; ++i) {
    const AreaSample s = sample_solid_angle(light, p, height, random.square());
    if (!(s.pdf_w > 0) || std::abs(s.pdf_w * whole - 1) > 1e-4) return false;
    if (s.s < 0 || s.t < 0 || s.s > 1 || s.t > 1 || (!light.quad && s.s + s.t > 1.00001f)) return false;
    const float x = s.s * kCells, y = s.t * kCells;
    int cx = std::min(static_cast<int>(x), kCells - 1), cy = std::min(static_cast<int>(y), kCells - 1);
    bool upper = (x - static_cast<float>(cx)) + (y - static_cast<float>(cy)) > 1;
    if (!light.quad && cx + cy >= kCells - 1) upper = false;  // rounding across the edge of the triangle
    if (!light.quad && cx + cy >= kCells) cx = kCells - 1 - cy;
    observed[2 * (static_cast<std::size_t>(cy) * kCells + cx) + (upper ? 1 : 0)] += 1;
  }
  return chi_square_accepts(observed, expected);
}

}  // namespace

TEST_CASE("directions to triangles and parallelograms are uniform in solid angle") {
  for (const bool quad : {false, true}) {
    CAPTURE(quad);
    const AreaLight light = make_light({-0.3f, -0.2f, 0.5f}, {0.8f, 0.1f, 0}, {0.1f, 0.7f, 0.2f}, quad);
    for (const Vec3& p : {Vec3(0, 0, 2), Vec3(0.1f, 0.1f, 0.6f), Vec3(3, -2, 1), Vec3(1.5f, 0, 0.51f), Vec3(0, 0, -0.4f)}) {
      CAPTURE(p.x);
      CAPTURE(p.z);
      CHECK(directions_are_uniform(light, p, 11));
    }
    // Close to the middle: nearly the whole hemisphere.
    CHECK(directions_are_uniform(light, light.a + 0.3f * light.e1 + 0.3f * light.e2 + 0.01f * light.n, 12));
    // A sliver.
    CHECK(directions_are_uniform(make_light({-0.5f, 0, 0}, {1, 0, 0}, {0.2f, 1e-3f, 0}, quad), {0.1f, 0.3f, 0.4f}, 13));
    // Tiny: 1e-6 at a distance of 1, and of 1e-6.
    const AreaLight tiny = make_light({0, 0, 0}, {1e-6f, 0, 0}, {0, 1e-6f, 0}, quad);
    CHECK(directions_are_uniform(tiny, {0.5f, 0.3f, 0.8f}, 14));
    CHECK(directions_are_uniform(tiny, {2e-6f, 0, 1e-6f}, 15));
  }
}

TEST_CASE("the density is one over the solid angle, which is accurate at any size, distance and angle") {
  Random random(5);
  for (int i = 0; i < 20000; ++i) {
    const bool quad = i % 2 == 0;
    const float size = std::pow(10.0f, -6 * random());
    const AreaLight light = make_light(0.5f * random.cube(), size * random.direction(), size * random.direction(), quad);
    if (light.size < 1e-2f * size * size) continue;
    const float distance = size * std::pow(10.0f, 4 * random() - 2);
    const Vec3 p = light.at(random(), random()).p + distance * random.direction();
    const float height = light.height(p);
    if (std::abs(height) < 1e-2f * glm::distance(p, light.a)) continue;
    if (std::abs(height) < 1e-5f) continue;  // there, positions in float are too coarse to say
    const double exact = exact_solid_angle(light, p);
    const float solid = solid_angle(light, p, height);
    CHECK(solid == doctest::Approx(exact).epsilon(1e-4));
    const AreaSample s = sample_solid_angle(light, p, height, random.square());
    CHECK(s.pdf_w == 1 / solid);
  }
}

TEST_CASE("extreme random numbers and receivers give points on the light or nothing, never NaN") {
  Random random(6);
  const float edges[] = {0, 0x1p-24f, 0.5f, kOneMinusEpsilon};
  for (int i = 0; i < 5000; ++i) {
    const float size = std::pow(10.0f, -8 * random());
    AreaLight light = make_light(0.5f * random.cube(), size * random.direction(), size * random.direction(), i % 2 == 0);
    light.double_sided = true;
    if (!(light.size > 0)) continue;
    Vec3 p = light.at(2 * random() - 0.5f, 2 * random() - 0.5f).p;  // in the plane but for rounding
    if (i % 3 == 0) p = light.a;                                    // in a corner
    if (i % 3 == 1) p += std::pow(10.0f, -8 * random()) * random.direction();
    const float height = light.height(p);
    if (!light.seen_from(height)) continue;
    for (const float x : edges) {
      for (const float y : edges) {
        const AreaSample s = sample_solid_angle(light, p, height, {x, y});
        const bool inside = s.s >= 0 && s.t >= 0 && s.s <= 1 && s.t <= 1 && (light.quad || s.s + s.t <= 1.00001f);
        CHECK((s.pdf_w >= 0 && inside));
      }
    }
  }
}

TEST_CASE("spots fall off as the reference code of KHR_lights_punctual") {
  for (const auto& [inner, outer] :
       {std::pair(0.2f, 0.7f), std::pair(0.0f, 0.785398f), std::pair(0.6f, 0.6001f), std::pair(0.01f, 0.03f)}) {
    const PunctualSource spot = PunctualSource::spot({}, {0, 0, -1}, Color(1), std::cos(inner), std::cos(outer));
    double sum = 0;
    float largest_error = 0;
    constexpr int kSteps = 200000;
    for (int i = 0; i < kSteps; ++i) {
      // Midpoint rule over the cosine, where it is not zero.
      const float range = 1 - std::cos(outer), cosine = std::cos(outer) + range * (static_cast<float>(i) + 0.5f) / kSteps;
      const float scale = 1.0f / std::max(0.001f, std::cos(inner) - std::cos(outer));
      const float reference = sqr(std::clamp(cosine * scale - std::cos(outer) * scale, 0.0f, 1.0f));
      largest_error = std::max(largest_error, std::abs(spot.attenuation(cosine) - reference));
      sum += 2 * kPi * range / kSteps * static_cast<double>(spot.attenuation(cosine));
    }
    CHECK(largest_error < 5e-4f);
    CHECK(spot.effective_solid_angle() == doctest::Approx(sum).epsilon(1e-3));

    Random random(7);
    std::vector<double> observed(40), expected(40);
    const float range = 1 - std::cos(outer);
    int outside = 0;
    constexpr int kCount = 100000;
    for (int i = 0; i < kCount; ++i) {
      const float x = (spot.sample_cos(random()) - std::cos(outer)) / range;
      outside += x > -1e-3f ? 0 : 1;
      observed[static_cast<std::size_t>(std::clamp(static_cast<int>(x * 40), 0, 39))] += 1;
    }
    for (int i = 0; i < 40; ++i) {
      double cell = 0;
      for (int j = 0; j < 200; ++j)
        cell += static_cast<double>(spot.attenuation(
                    std::cos(outer) + range * (static_cast<float>(i) + (static_cast<float>(j) + 0.5f) / 200) / 40)) /
                200;
      expected[static_cast<std::size_t>(i)] = kCount * cell * 2 * kPi * range / 40 / spot.effective_solid_angle();
    }
    CHECK(outside == 0);
    if (outer > 0.1f) CHECK(chi_square_accepts(observed, expected));
  }
}

TEST_CASE("a distribution picks as its probabilities say") {
  Distribution none(std::vector<double>{0, -1, std::nan("")});
  CHECK(none.empty());
  CHECK(none.sample(0.5f).pmf == 0);

  const std::vector<double> weights{0, 3, 0, 1e-30, 5, 2, 0};
  const Distribution d(weights);
  double sum = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    sum += static_cast<double>(d.pmf(i));
    CHECK((d.pmf(i) > 0) == (weights[i] > 0));
  }
  CHECK(sum == 1);
  CHECK(d.pmf(4) == doctest::Approx(0.5).epsilon(1e-6));
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const Distribution::Sample s = d.sample(random());
    CHECK(weights[s.index] > 0);
    CHECK(s.pmf == d.pmf(s.index));
    CHECK(s.u >= 0);
    CHECK(s.u < 1);
  }
  CHECK(d.sample(0).index == 1);
  CHECK(d.sample(kOneMinusEpsilon).index == 5);
}
