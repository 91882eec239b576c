#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/form_factor.hpp"
#include "ln/sampling.hpp"

using namespace ln;

namespace {

FlatCell quad(const Vec3& o, const Vec3& a, const Vec3& b) { return make_flat_cell({o, a, b, true}, true); }

/// Form factor of a receiver that is cut `depth` times.
double refined(const FlatCell& receiver, const FlatCell& source, int depth) {
  if (depth == 0) return static_cast<double>(form_factor(receiver, source).mean);
  double sum = 0;
  for (int i = 0; i < 4; ++i)
    sum += 0.25 * refined(make_flat_cell(receiver.cell.child(i),
                                         glm::dot(glm::cross(receiver.cell.a, receiver.cell.b), receiver.normal) > 0),
                          source, depth - 1);
  return sum;
}

/// Two parallel a x b rectangles at distance c (Howell, configuration C-11).
double parallel_truth(double a, double b, double c) {
  const double x = a / c, y = b / c, pi = static_cast<double>(kPi);
  const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return 2 / (pi * x * y) *
         (0.5 * std::log((1 + x * x) * (1 + y * y) / (1 + x * x + y * y)) + x * q * std::atan(x / q) +
          y * p * std::atan(y / p) - x * std::atan(x) - y * std::atan(y));
}

/// Two rectangles at right angles with the common edge c; the receiver is b wide, the source a (Howell, configuration C-14).
double perpendicular_truth(double a, double b, double c) {
  const double h = a / c, w = b / c, pi = static_cast<double>(kPi), s = h * h + w * w;
  const double u = (1 + w * w) * (1 + h * h) / (1 + s);
  const double v = std::pow(w * w * (1 + s) / ((1 + w * w) * s), w * w),
               z = std::pow(h * h * (1 + s) / ((1 + h * h) * s), h * h);
  return (w * std::atan(1 / w) + h * std::atan(1 / h) - std::sqrt(s) * std::atan(1 / std::sqrt(s)) +
          0.25 * std::log(u * v * z)) /
         (pi * w);
}

}  // namespace

TEST_CASE("parallel rectangles; unit squares at distance 1: 0.1998") {
  CHECK(parallel_truth(1, 1, 1) == doctest::Approx(0.199825).epsilon(1e-5));
  for (const double c : {0.05, 0.3, 1.0, 4.0, 30.0}) {
    CAPTURE(c);
    const FlatCell below = quad({0, 0, 0}, {1, 0, 0}, {0, 0.5f, 0});
    const FlatCell above = quad({0, 0, static_cast<float>(c)}, {0, 0.5f, 0}, {1, 0, 0});
    CHECK(refined(below, above, 5) == doctest::Approx(parallel_truth(1, 0.5, c)).epsilon(2e-3));
  }
  const FlatCell below = quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), above = quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  CHECK(static_cast<double>(form_factor(below, above).mean) == doctest::Approx(0.199825).epsilon(0.003));  // one call is enough
}

TEST_CASE("rectangles at a right angle with a common edge; unit squares: 0.2000") {
  CHECK(perpendicular_truth(1, 1, 1) == doctest::Approx(0.200044).epsilon(1e-5));
  for (const double a : {0.2, 1.0, 3.0}) {
    CAPTURE(a);
    const FlatCell floor = quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const FlatCell wall = quad({0, 0, 0}, {0, 1, 0}, {0, 0, static_cast<float>(a)});  // looks along +x
    CHECK(refined(floor, wall, 5) == doctest::Approx(perpendicular_truth(a, 1, 1)).epsilon(2e-3));
  }
}

TEST_CASE("from any point inside of a closed box the walls fill the hemisphere") {
  const Vec3 low(-0.5f, -0.4f, -0.3f), high(0.5f, 0.4f, 0.3f), size = high - low;
  const Vec3 x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
  const FlatCell walls[] = {quad(low, x, y),    quad(low, y, z),    quad(low, z, x),
                            quad(high, -y, -x), quad(high, -z, -y), quad(high, -x, -z)};
  const SampleStream random(1, 0);
  for (std::uint32_t i = 0; i < 200; ++i) {
    const Vec2 u = random.get2(0, i, 200), v = random.get2(1, i, 200);
    const float z_local = 1 - 2 * v.y, r = std::sqrt(1 - z_local * z_local), phi = 2 * kPi * random.get1(2, i, 200);
    const Vec3 n(r * std::cos(phi), r * std::sin(phi), z_local);
    const Vec3 p = low + size * Vec3(u.x, u.y, v.x) * 0.998f + size * 0.001f;
    float sum = 0;
    for (const FlatCell& wall : walls) sum += point_form_factor(p, n, wall);
    CHECK(sum == doctest::Approx(1).epsilon(1e-5));
  }
  // And from the walls themselves, at their very edges: nothing is singular.
  for (const FlatCell& wall : walls) {
    for (const float e : {0.5f, 1e-2f, 1e-4f}) {
      float sum = 0;
      for (const FlatCell& other : walls)
        sum += point_form_factor(wall.cell.o + e * wall.cell.a + 0.3f * wall.cell.b, wall.normal, other);
      CHECK(sum == doctest::Approx(1).epsilon(1e-3));
    }
  }
}

TEST_CASE("nothing is seen behind, beside in the same plane, or from behind") {
  const FlatCell floor = quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  CHECK(form_factor(floor, quad({2, 0, 0}, {1, 0, 0}, {0, 1, 0})).mean == 0);    // same plane
  CHECK(form_factor(floor, quad({0, 0, -1}, {1, 0, 0}, {0, 1, 0})).mean == 0);   // below
  CHECK(form_factor(floor, quad({0, 0, 1}, {1, 0, 0}, {0, 1, 0})).mean == 0);    // above, but looking up
  CHECK(form_factor(floor, quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0})).mean > 0.1f);  // looking down
  CHECK(form_factor(floor, quad({40, 0, 1}, {0, 1, 0}, {1, 0, 0})).mean > 0);
}

TEST_CASE("a source far away, through the kernel, and a triangle, through the formula, agree with many points") {
  const FlatCell receiver = quad({0, 0, 0}, {0.3f, 0, 0}, {0, 0.2f, 0});
  for (const float d : {1.5f, 2.0f, 3.4f, 3.8f, 9.0f}) {
    const FlatCell source = make_flat_cell({Vec3(d, 0.3f, 0.8f), Vec3(0, 0.3f, 0.1f), Vec3(0.2f, 0, 0.3f), false}, false);
    const FormFactor found = form_factor(receiver, source);
    CHECK(static_cast<double>(found.mean) == doctest::Approx(refined(receiver, source, 3)).epsilon(0.02));
    CHECK(found.mean > 0);
    CHECK(found.spread < found.mean);
  }
}
