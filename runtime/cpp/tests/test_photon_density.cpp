#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/photon_density.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// Photons of a scene and estimates of irradiance from them.
struct Estimate : Traced {
  explicit Estimate(const SceneData& data, std::uint64_t count, int neighbours = 60, PhotonKernel kernel = PhotonKernel::cone,
                    const PathAutomaton& via = path_automaton<AnyPath>(), int every = 0)
      : Traced(data, count, via), map(stage.context, photons.hits), density(stage.context, map, neighbours, 0, kernel, every) {}

  /// Mean irradiance (first channel) at the points that `place` makes of the unit square.
  double mean(const std::function<Vec3(Vec2)>& place, const Vec3& normal, std::uint32_t n = 4000) const {
    return mean_over_square([&](Vec2 u) { return static_cast<double>(density.estimate({place(u), normal, true}).E.x); }, n);
  }

  /// Irradiance (first channel) at what a ray hits.
  double at(const Ray& ray) const {
    const Interaction x(stage.scene, ray, stage.scene.accel().intersect(ray, 0));
    return static_cast<double>(density.estimate({x.at.p, x.front ? x.at.ng : -x.at.ng, x.front}).E.x);
  }

  PhotonMap map;
  PhotonDensity density;
};

constexpr Vec3 kUp(0, 1, 0);

}  // namespace

TEST_CASE("in a closed box whose walls all shine, the irradiance is the same everywhere: Phi / (A (1 - rho))") {
  const double truth = 2 * static_cast<double>(kPi);
  for (const PhotonKernel kernel : {PhotonKernel::constant, PhotonKernel::cone}) {
    for (const int pieces : {1, 9}) {
      CAPTURE(pieces);
      SceneBuilder b;
      b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.5f), Color(1)), true, pieces);
      const Estimate e(b.data, 300'000, 60, kernel);
      // About 160,000 photons on the floor: a standard error of 0.3 %, in the strips of 1 %.
      CHECK(e.mean([](Vec2 u) { return Vec3(u.x - 0.5f, -0.4f, 0.6f * u.y - 0.3f); }, kUp) ==
            doctest::Approx(truth).epsilon(0.012));
      CHECK(e.mean([](Vec2 u) { return Vec3(u.x - 0.5f, -0.4f, 0.3f - 0.02f * u.y); }, kUp) ==
            doctest::Approx(truth).epsilon(0.035));
      // All corners, each seen from its three faces.
      double corners = 0;
      for (int i = 0; i < 8; ++i) {
        const Vec3 sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Vec3 normal(0);
          normal[axis] = -sign[axis];
          corners += e.mean(
              [&](Vec2 u) {
                Vec3 p = sign * Vec3(0.5f, 0.4f, 0.3f);
                p[(axis + 1) % 3] *= 1 - 0.02f * u.x;
                p[(axis + 2) % 3] *= 1 - 0.02f * u.y;
                return p;
              },
              normal, 100);
        }
      }
      CHECK(corners / 24 == doctest::Approx(truth).epsilon(0.06));
    }
  }
}

TEST_CASE("a plane under a directional light is evenly lit up to its border") {
  SceneBuilder b;
  add_floor(b);
  b.directional({0.3f, -1, 0.2f}, Color(3));
  const Estimate e(b.data, 400'000);
  const double truth = 3 / std::sqrt(1 + 0.09 + 0.04);
  CHECK(e.mean([](Vec2 u) { return Vec3(1.4f * u.x - 0.7f, 0.01f, 1.4f * u.y - 0.7f); }, kUp) ==
        doctest::Approx(truth).epsilon(0.015));
  CHECK(e.mean([](Vec2 u) { return Vec3(0.7f - 0.01f * u.x, 0.01f, 1.4f * u.y - 0.7f); }, kUp) ==
        doctest::Approx(truth).epsilon(0.015));
  CHECK(e.mean([](Vec2 u) { return Vec3(0.7f - 0.01f * u.x, 0.01f, 0.01f * u.y - 0.7f); }, kUp) ==
        doctest::Approx(truth).epsilon(0.05));
}

TEST_CASE("half of a surface sees the same light as all of it") {
  SceneBuilder b;
  add_floor(b);
  b.data.materials.back().alpha_mode = AlphaMode::blend;
  b.data.materials.back().alpha = 0.5f;
  b.directional({0, -1, 0}, Color(1));
  const Estimate e(b.data, 200'000);
  CHECK(e.mean([](Vec2 u) { return Vec3(1.4f * u.x - 0.7f, 0.01f, 1.4f * u.y - 0.7f); }, kUp) ==
        doctest::Approx(1).epsilon(0.02));
}

TEST_CASE("inside a finely divided sphere: Phi / (A (1 - rho))") {
  SceneBuilder b;
  b.sphere(Vec3(0), 0.8f, b.material(Color(0.5f), Color(1)), true, 60);
  const Estimate e(b.data, 300'000);
  CHECK(mean_over_square([&](Vec2 u) { return e.at({Vec3(0), direction_at(u)}); }) ==
        doctest::Approx(2 * static_cast<double>(kPi)).epsilon(0.01));
}

TEST_CASE("a small ball of many triangles gets its light, also with few photons") {
  // In a closed box with walls of radiance 2 pi / pi = 2: the irradiance is the same everywhere.
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  b.sphere(Vec3(0.1f, 0, 0), 0.08f, b.material(Color(0.5f), Color(1)), false, 40);
  const double truth = 2 * static_cast<double>(kPi);
  for (const std::uint64_t count : {20'000u, 200'000u}) {
    CAPTURE(count);
    const Estimate e(b.data, count);
    std::size_t hits = 0;
    for (const Photon& photon : e.photons.hits) hits += glm::distance(photon.position, {0.1f, 0, 0}) < 0.09f ? 1 : 0;
    const double mean = mean_over_square([&](Vec2 u) {
      const Vec3 d = direction_at(u);
      return e.at({Vec3(0.1f, 0, 0) + 0.1f * d, -d});
    });
    CHECK(std::abs(mean / truth - 1) < 4 / std::sqrt(static_cast<double>(hits)));
  }
}

TEST_CASE("things that stand on a floor leave no dark rim, and twice the same floor does not halve the light") {
  for (const bool twice : {false, true}) {
    SceneBuilder b;
    add_floor(b);
    if (twice) add_floor(b);
    b.box({-0.2f, 0.01f, -0.2f}, {0.2f, 0.3f, 0.2f}, b.material(Color(0.5f)), false);
    b.directional({0, -1, 0}, Color(1));
    const Estimate e(b.data, 300'000, 60, PhotonKernel::cone, path_automaton<EmptyPath>());
    CHECK(e.mean([](Vec2 u) { return Vec3(0.205f + 0.01f * u.x, 0.01f, 0.3f * u.y - 0.15f); }, kUp) ==
          doctest::Approx(1).epsilon(0.03));
    CHECK(e.mean([](Vec2 u) { return Vec3(0.4f + 0.2f * u.x, 0.01f, u.y - 0.5f); }, kUp) == doctest::Approx(1).epsilon(0.03));
  }
}

TEST_CASE("light does not leak below a thin wall") {
  SceneBuilder b;
  add_floor(b);
  add_thin_wall(b);
  b.directional({0, -1, 0}, Color(1));
  const Estimate e(b.data, 200'000, 60, PhotonKernel::cone, path_automaton<EmptyPath>());
  CHECK(e.mean([](Vec2 u) { return Vec3(-0.001f - 0.02f * u.x, 0.01f, 0.6f * u.y - 0.3f); }, kUp) < 1e-3);
  CHECK(e.mean([](Vec2 u) { return Vec3(0.001f + 0.02f * u.x, 0.01f, 0.6f * u.y - 0.3f); }, kUp) ==
        doctest::Approx(1).epsilon(0.03));
}

TEST_CASE("light does not leak from a plate close above a floor to the shadow below it") {
  SceneBuilder b;
  add_floor(b);
  b.quad({-0.35f, 0.014f, 0.35f}, {0.35f, 0.014f, 0.35f}, {0.35f, 0.014f, -0.35f}, {-0.35f, 0.014f, -0.35f},
         b.material(Color(0.5f)));
  b.directional({0, -1, 0}, Color(1));
  const Estimate e(b.data, 200'000, 60, PhotonKernel::cone, path_automaton<EmptyPath>());
  REQUIRE(e.density.max_radius() > 5 * 0.004f);  // the plate is well within the ball
  CHECK(e.mean([](Vec2 u) { return Vec3(0.6f * u.x - 0.3f, 0.01f, 0.6f * u.y - 0.3f); }, kUp) == 0);
  CHECK(e.mean([](Vec2 u) { return Vec3(0.7f * u.x - 0.35f, 0.014f, 0.7f * u.y - 0.35f); }, kUp) ==
        doctest::Approx(1).epsilon(0.02));
}

TEST_CASE("estimates made beforehand are as bright as those made anew, and shared by points near each other") {
  SceneBuilder b;
  b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.5f), Color(1)));
  const Estimate e(b.data, 300'000, 30, PhotonKernel::cone, path_automaton<AnyPath>(), 4);
  // About 160,000 photons on the floor: a standard error of 0.3 %.
  CHECK(e.mean([](Vec2 u) { return Vec3(u.x - 0.5f, -0.4f, 0.6f * u.y - 0.3f); }, kUp, 40'000) ==
        doctest::Approx(2 * static_cast<double>(kPi)).epsilon(0.009));
  int shared = 0;
  for (int i = 0; i < 100; ++i) {
    const float x = 0.009f * static_cast<float>(i) - 0.45f;
    const auto estimate = [&](float at) { return e.density.estimate({{at, -0.4f, 0.1f}, kUp, true}).E; };
    if (estimate(x) == estimate(x + 1e-5f)) ++shared;
  }
  CHECK(shared > 80);
}

TEST_CASE("no light is gathered from far away") {
  SceneBuilder b;
  b.quad({-1, 0.01f, 0.5f}, {1, 0.01f, 0.5f}, {1, 0.01f, -0.5f}, {-1, 0.01f, -0.5f}, b.material(Color(0.5f)));
  b.quad({0, 0.4f, 0.6f}, {0, 0.4f, -0.6f}, {-1, 0.4f, -0.6f}, {-1, 0.4f, 0.6f}, b.material(Color(0)));
  b.directional({0, -1, 0}, Color(1));
  const Estimate e(b.data, 20'000, 60, PhotonKernel::cone, path_automaton<EmptyPath>());
  CHECK(e.density.max_radius() < 0.2f);
  CHECK(e.density.estimate({{-0.6f, 0.01f, 0}, kUp, true}).E == Color(0));
  CHECK(e.density.estimate({{0.6f, 0.01f, 0}, kUp, true}).E.x > 0.3f);
  CHECK(e.density.estimate({{0.6f, 0.01f, 0}, -kUp, false}).E == Color(0));  // below the floor
}

TEST_CASE("without photons it is dark; few photons do no harm") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  for (const std::uint64_t count : {0u, 1u, 2u, 3u, 61u}) {
    const Estimate e(b.data, count);
    const Color E = e.density.estimate({{0.1f, -0.5f, 0.2f}, kUp, true}).E;
    CHECK(is_finite(E));
    CHECK(min_component(E) >= 0);
  }
}

TEST_CASE("estimates beforehand hardly blur an edge of light more than kernels do") {
  // A plate puts half of the floor into the shade of one of two lights: 4 beside 1.
  SceneBuilder b;
  add_floor(b);
  b.quad({0, 0.3f, 0.7f}, {0, 0.3f, -0.7f}, {-0.7f, 0.3f, -0.7f}, {-0.7f, 0.3f, 0.7f}, b.material(Color(0)));
  b.directional({0, -1, 0}, Color(3));
  b.directional({-1, -1, 0}, Color(std::sqrt(2.0f)));
  const auto mean = [&](int every) {
    return Estimate(b.data, 400'000, 60, PhotonKernel::cone, path_automaton<EmptyPath>(), every)
        .mean([](Vec2 u) { return Vec3(-0.02f * u.x, 0.01f, u.y - 0.5f); }, kUp);
  };
  CHECK(mean(4) - mean(0) < 0.14);  // 0.17 by the nearest one alone
}
