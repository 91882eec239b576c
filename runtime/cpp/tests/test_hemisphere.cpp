#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "ln/hemisphere.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <optional>
#include <vector>

#include "ln/sampling.hpp"

using namespace ln;

namespace {

/// What is seen from `p` in direction `w`.
using Room = std::function<HemisphereCell(const Vec3& p, const Vec3& w)>;

/// Looks through the middle of each cell, or anywhere in it, by random numbers of `key`.
std::vector<HemisphereCell> look(const Room& room, const HemisphereGrid& grid, const Vec3& p, const Frame& frame,
                                 std::optional<std::uint32_t> key = {}) {
  std::vector<HemisphereCell> cells;
  for (int ring = 0; ring < grid.polar; ++ring) {
    for (int sector = 0; sector < grid.azimuth; ++sector) {
      const Vec2 u = key ? SampleStream(*key, static_cast<std::uint32_t>(cells.size())).get2(0, 0) : Vec2(0.5f);
      cells.push_back(room(p, frame.to_world(grid.direction(ring, sector, u))));
    }
  }
  return cells;
}

/// Irradiance by a fine quadrature that shares nothing with `integrate` but the room.
double irradiance(const Room& room, const Vec3& p, const Vec3& n) {
  constexpr int kPolar = 500, kAzimuth = 1500;
  const Frame frame = make_frame(n);
  double sum = 0;
  for (int i = 0; i < kPolar; ++i) {
    const double theta = 0.5 * static_cast<double>(kPi) * (i + 0.5) / kPolar;
    const double weight = std::sin(theta) * std::cos(theta);
    for (int j = 0; j < kAzimuth; ++j) {
      const double phi = 2 * static_cast<double>(kPi) * (j + 0.5) / kAzimuth;
      const Vec3 local(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      sum += weight * static_cast<double>(room(p, frame.to_world(local)).radiance.x);
    }
  }
  return sum * static_cast<double>(kPi * kPi) / (kPolar * kAzimuth);
}

/// How irradiance changes along `axis`, by finite differences.
double slope(const Room& room, const Vec3& p, const Vec3& n, const Vec3& axis) {
  constexpr float kStep = 0.03f;
  return (irradiance(room, p + kStep * axis, n) - irradiance(room, p - kStep * axis, n)) / (2 * static_cast<double>(kStep));
}

/// A cube of half width 1 whose walls shine by a smooth function of the place.
HemisphereCell bright_cube(const Vec3& p, const Vec3& w) {
  HemisphereCell seen;
  for (int i = 0; i < 3; ++i) {
    const float height = std::copysign(1.0f, w[i]) - p[i];
    if (w[i] == 0 || height / w[i] >= seen.distance) continue;
    seen.distance = height / w[i];
    seen.plane = Vec3(0);
    seen.plane[i] = 1 / height;
  }
  const Vec3 at = p + seen.distance * w;
  const float L = 2 + std::sin(1.5f * at.x) + 0.5f * std::cos(2 * at.y + at.z);
  seen.radiance = Color(L, 0.5f * L, 0);
  return seen;
}

/// The same with a black plate above the floor, which hides a part of it.
HemisphereCell cube_with_plate(const Vec3& p, const Vec3& w) {
  constexpr float kHeight = 0.1f;
  if (const float t = (kHeight - p.z) / w.z; t > 0) {
    const Vec3 at = p + t * w;
    if (at.x > -0.4f && at.x < 0.9f && std::abs(at.y) < 0.5f) return {Color(0), t, Vec3(0, 0, 1 / (kHeight - p.z))};
  }
  return bright_cube(p, w);
}

/// The cube with a black ball in it.
HemisphereCell cube_with_ball(const Vec3& p, const Vec3& w) {
  constexpr float kRadius = 0.4f;
  const Vec3 to_centre = Vec3(0.3f, 0, 0.1f) - p;
  const float along = glm::dot(to_centre, w), inside = sqr(kRadius) - glm::dot(to_centre, to_centre) + sqr(along);
  if (along <= 0 || inside < 0) return bright_cube(p, w);
  const float t = along - std::sqrt(inside);
  const Vec3 n = glm::normalize(t * w - to_centre);
  return {Color(0), t, n / (t * glm::dot(w, n))};
}

/// A cube whose wall x = -1 alone shines.
HemisphereCell one_bright_wall(const Vec3& p, const Vec3& w) {
  HemisphereCell seen = bright_cube(p, w);
  seen.radiance = Color(seen.plane.x < 0 ? 1 : 0);
  return seen;
}

/// Gradients of the first channel by finite differences, along the axes of the frame.
void check_gradients(const Room& room, const Vec3& p, const Vec3& n, double tolerance) {
  const Frame frame = make_frame(n);
  const HemisphereGrid grid = HemisphereGrid::of(60'000);
  const IrradianceSample sample = integrate(grid, look(room, grid, p, frame), frame);
  const double E = irradiance(room, p, n);
  CHECK(static_cast<double>(sample.irradiance.x) == doctest::Approx(E).epsilon(1e-3));

  constexpr float kStep = 0.03f;
  for (const Vec3& axis : {frame.s, frame.t}) {
    CHECK(static_cast<double>((axis * sample.translation).x) ==
          doctest::Approx(slope(room, p, n, axis)).epsilon(tolerance).scale(E));
    const auto tilted = [&](float angle) {
      return irradiance(room, p, glm::normalize(n * std::cos(angle) + axis * std::sin(angle)));
    };
    const double turned = (tilted(kStep) - tilted(-kStep)) / (2 * static_cast<double>(kStep));
    CHECK(static_cast<double>((glm::cross(n, axis) * sample.rotation).x) ==
          doctest::Approx(turned).epsilon(tolerance).scale(E));
  }
}

}  // namespace

TEST_CASE("directions fill their cells evenly: the mean cosine to the normal is 2/3, to the sides 0") {
  const HemisphereGrid grid = HemisphereGrid::of(300);
  CHECK(grid.cells() == doctest::Approx(300).epsilon(0.03));
  DVec3 sum(0);
  for (int ring = 0; ring < grid.polar; ++ring)
    for (int sector = 0; sector < grid.azimuth; ++sector) sum += DVec3(grid.direction(ring, sector, Vec2(0.5f)));
  sum /= grid.cells();
  CHECK(sum.z == doctest::Approx(2.0 / 3).epsilon(4e-3));
  CHECK(std::abs(sum.x) + std::abs(sum.y) < 1e-5);
}

TEST_CASE("gradients are those of finite differences where the walls shine unevenly") {
  check_gradients(bright_cube, Vec3(0.2f, -0.3f, 0.1f), Vec3(0, 0, 1), 0.01);
  check_gradients(bright_cube, Vec3(-0.5f, 0.6f, -0.2f), glm::normalize(Vec3(1, 2, -1)), 0.01);
}

TEST_CASE("gradients know what hides and uncovers as the point moves") {
  check_gradients(cube_with_plate, Vec3(-0.3f, 0.2f, -0.6f), Vec3(0, 0, 1), 0.02);
  check_gradients(cube_with_plate, Vec3(0.7f, -0.4f, -0.5f), glm::normalize(Vec3(-0.3f, 0.2f, 1)), 0.02);
}

TEST_CASE("the mean gradient of a few hundred directions, in the open and close to a wall") {
  struct Case {
    Room room;
    Vec3 p;
    double tolerance;  // as a share of irradiance; moving all borders by the nearest thing seen is off by 0.04, 1.3 and 0.2
  };
  const Case cases[] = {{cube_with_ball, Vec3(0.1f, 0.2f, -0.9f), 0.03},
                        {one_bright_wall, Vec3(-0.95f, 0.2f, -0.9f), 0.3},
                        {one_bright_wall, Vec3(-0.6f, 0.2f, -0.9f), 0.1}};
  constexpr std::uint32_t kKeys = 400;
  const Frame frame = make_frame(Vec3(0, 0, 1));
  const HemisphereGrid grid = HemisphereGrid::of(512);
  for (const auto& [room, p, tolerance] : cases) {
    DVec3 mean(0);
    for (std::uint32_t key = 0; key < kKeys; ++key)
      mean += DVec3(integrate(grid, look(room, grid, p, frame, key), frame).translation[0]) / static_cast<double>(kKeys);
    const double E = irradiance(room, p, frame.n);
    for (const Vec3& axis : {frame.s, frame.t})
      CHECK(std::abs(glm::dot(mean, DVec3(axis)) - slope(room, p, frame.n, axis)) < tolerance * E);
  }
}

TEST_CASE("a shining ceiling at height h: irradiance pi L, no gradient, harmonic mean distance 3/2 h") {
  const HemisphereGrid grid = HemisphereGrid::of(2000);
  const Frame frame = make_frame(Vec3(0, 1, 0));
  const Room ceiling = [](const Vec3&, const Vec3& w) { return HemisphereCell{Color(2), 0.5f / w.y}; };
  const IrradianceSample sample = integrate(grid, look(ceiling, grid, Vec3(0), frame), frame);
  CHECK(sample.irradiance.x == doctest::Approx(2 * kPi));
  CHECK(sample.distance == doctest::Approx(0.75).epsilon(1e-3));
  for (int c = 0; c < 3; ++c) {
    CHECK(glm::length(sample.translation[c]) < 1e-4f);
    CHECK(glm::length(sample.rotation[c]) < 1e-4f);
  }
}

TEST_CASE("nothing but sky: infinitely far, and the same wherever one goes") {
  const HemisphereGrid grid = HemisphereGrid::of(500);
  const Frame frame = make_frame(Vec3(0, 0, 1));
  const Room sky = [](const Vec3&, const Vec3& w) { return HemisphereCell{Color(1 + w.x), kInfinity}; };
  const IrradianceSample sample = integrate(grid, look(sky, grid, Vec3(0), frame), frame);
  CHECK(sample.distance == kInfinity);
  CHECK(glm::length(sample.translation[0]) == 0);
  CHECK(glm::length(sample.rotation[0]) > 0.1f);
}

TEST_CASE("the horizon of a cube: inverse distances to its walls along the surface") {
  const HemisphereGrid grid = HemisphereGrid::of(500);
  const Frame frame = make_frame(Vec3(0, 0, 1));
  const Vec3 p(0.2f, -0.3f, -0.9f);
  const IrradianceSample sample = integrate(grid, look(bright_cube, grid, p, frame), frame);
  REQUIRE(sample.horizon.size() == static_cast<std::size_t>(grid.azimuth));
  for (int k = 0; k < grid.azimuth; ++k) {
    const float phi = 2 * kPi * (static_cast<float>(k) + 0.5f) / static_cast<float>(grid.azimuth);
    const Vec3 along = frame.s * std::cos(phi) + frame.t * std::sin(phi);
    CHECK(1 / sample.horizon[static_cast<std::size_t>(k)] == doctest::Approx(bright_cube(p, along).distance));
  }
}

TEST_CASE("just above a mottled floor, the gradient over a step is noisy like irradiance, not a hundred times more") {
  constexpr float kHeight = 1e-3f, kStep = 0.1f;
  const Frame frame = make_frame(Vec3(1, 0, 0));
  const HemisphereGrid grid = HemisphereGrid::of(512);
  double gradient = 0, change = 0;  // squares, over the step; and of differences of two irradiances
  float last = 0;
  for (std::uint32_t i = 0; i < 200; ++i) {
    std::uint32_t seed = hash32(i);
    const auto mottled = [&](const Vec3& p, const Vec3& w) -> HemisphereCell {
      if (w.y >= 0) return {Color(1), kInfinity};
      seed = hash32(seed + 1);
      return {Color(seed % 2 == 0 ? 2 : 0), -p.y / w.y};
    };
    const IrradianceSample sample = integrate(grid, look(mottled, grid, Vec3(0, kHeight, 0), frame), frame, kStep);
    gradient += static_cast<double>(sqr(kStep) * glm::dot(sample.translation[0], sample.translation[0])) / 200;
    if (i > 0) change += static_cast<double>(sqr(sample.irradiance.x - last)) / 199;
    last = sample.irradiance.x;
  }
  CHECK(gradient > 0);
  CHECK(std::sqrt(gradient) < 4 * std::sqrt(change));
}
