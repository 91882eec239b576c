#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "test_emitters_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// Mean flux of particles and its standard error, first channel.
struct MeanFlux {
  Color mean{0};
  double error = 0;
};
MeanFlux mean_flux(const Emitters& emitters, int count, std::uint32_t seed) {
  Random random(seed);
  glm::dvec3 sum(0);
  double squares = 0;
  for (int i = 0; i < count; ++i) {
    const PhotonEmission photon = emitters.emit(random(), random.square(), random.square());
    sum += glm::dvec3(photon.flux);
    squares += static_cast<double>(photon.flux.x) * static_cast<double>(photon.flux.x);
  }
  const double mean = sum.x / count;
  return {Color(sum / static_cast<double>(count)), std::sqrt(std::max(0.0, squares / count - mean * mean) / count)};
}

}  // namespace

TEST_CASE("the mean flux of particles is the power of all emitters") {
  SceneOfLights scene;
  scene.add_quad({-0.2f, -0.2f, 0.5f}, {0, 0.4f, 0}, {0.4f, 0, 0}, Color(3, 2, 1));
  scene.add_triangle({0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}, Color(1, 2, 0), true);
  scene.add_point({0, 0, 0.2f}, Color(0.1f, 0, 0.3f));
  scene.add_spot({0, 0, 0.2f}, {1, 0, 0}, Color(1, 1, 0), 0.2f, 0.5f);
  scene.add_directional({0, 0, -1}, Color(0.5f));
  SUBCASE("without environment") {
    const Emitters emitters(scene.data);
    const double r2 = 0.33 * 1.0005;  // (0.2^2 + 0.2^2 + 0.5^2), with the margin
    CHECK(emitters.total_power().x ==
          doctest::Approx(kPi * (0.16 * 3 + 0.125 * 2 * 1) + 4 * kPi * 0.1 +
                          2 * kPi * (1 - std::cos(0.2) + (std::cos(0.2) - std::cos(0.5)) / 3) + 0.5 * kPi * r2)
              .epsilon(1e-4));
    const MeanFlux flux = mean_flux(emitters, 400000, 1);
    CHECK(std::abs(static_cast<double>(flux.mean.x - emitters.total_power().x)) < 4 * flux.error + 1e-6);
    CHECK(flux.mean.z == doctest::Approx(emitters.total_power().z).epsilon(0.01));
  }
  SUBCASE("with environment") {
    Image image;
    image.width = 4, image.height = 2, image.channels = 3;
    for (int i = 0; i < 24; ++i) image.floats.push_back(static_cast<float>(i % 7));
    const Emitters emitters(scene.data, &image);
    const MeanFlux flux = mean_flux(emitters, 400000, 1);
    CHECK(std::abs(static_cast<double>(flux.mean.x - emitters.total_power().x)) < 4 * flux.error);
    CHECK(flux.mean.z == doctest::Approx(emitters.total_power().z).epsilon(0.01));
  }
}

TEST_CASE("surfaces emit uniformly over their area and by the cosine, on their bright sides") {
  for (const bool quad : {false, true}) {
    for (const bool double_sided : {false, true}) {
      SceneOfLights scene;
      const Vec3 a(-0.3f, 0.1f, 0.2f), e1(0.6f, 0.1f, 0), e2(0, 0.4f, 0.3f);
      if (quad)
        scene.add_quad(a, e1, e2, Color(1), double_sided);
      else
        scene.add_triangle(a, a + e1, a + e2, Color(1), double_sided);
      const Emitters emitters(scene.data);
      const Vec3 n = glm::normalize(glm::cross(e1, e2));
      constexpr int kCells = 8, kCount = 100000;
      std::vector<double> place(kCells * kCells), expected_place(kCells * kCells), angle(20), expected_angle(20);
      int back = 0, wrong = 0;
      Random random(2);
      for (int i = 0; i < kCount; ++i) {
        const PhotonEmission photon = emitters.emit(random(), random.square(), random.square());
        const float cosine = glm::dot(photon.direction, n);
        if (cosine < 0) ++back;
        const bool right = !photon.delta && !photon.distant && photon.triangle == 0 &&
                           std::abs(glm::length(photon.direction) - 1) < 1e-5f &&
                           std::abs(std::abs(cosine) - photon.cos_theta) < 1e-4f &&
                           std::abs(photon.flux.x / emitters.total_power().x - 1) < 1e-5f;
        wrong += right ? 0 : 1;
        angle[static_cast<std::size_t>(std::min(static_cast<int>(sqr(photon.cos_theta) * 20), 19))] += 1;
        const DVec3 d = DVec3(photon.position.p) - DVec3(a), c = glm::cross(DVec3(e1), DVec3(e2));
        const double s = glm::dot(glm::cross(d, DVec3(e2)), c) / glm::dot(c, c),
                     t = glm::dot(glm::cross(DVec3(e1), d), c) / glm::dot(c, c);
        place[static_cast<std::size_t>(std::clamp(static_cast<int>(t * kCells), 0, kCells - 1) * kCells +
                                       std::clamp(static_cast<int>(s * kCells), 0, kCells - 1))] += 1;
      }
      for (int y = 0; y < kCells; ++y)
        for (int x = 0; x < kCells; ++x)
          expected_place[static_cast<std::size_t>(y * kCells + x)] = quad                  ? kCount / 64.0
                                                                     : x + y < kCells - 1  ? kCount / 32.0
                                                                     : x + y == kCells - 1 ? kCount / 64.0
                                                                                           : 0.0;
      if (!quad) {
        for (int y = 0; y < kCells; ++y) {  // rounding across the long edge
          for (int x = kCells - y; x < kCells; ++x) {
            CHECK(place[static_cast<std::size_t>(y * kCells + x)] < 5);
            place[static_cast<std::size_t>(y * kCells + x)] = 0;
          }
        }
      }
      CHECK(wrong == 0);
      CHECK(chi_square_accepts(place, expected_place));
      std::fill(expected_angle.begin(), expected_angle.end(), kCount / 20.0);
      CHECK(chi_square_accepts(angle, expected_angle));
      if (double_sided)
        CHECK(std::abs(back - kCount / 2) < 4 * std::sqrt(kCount / 4.0));
      else
        CHECK(back == 0);
    }
  }
}

TEST_CASE("points emit in all directions, spots within their cone") {
  SceneOfLights point, spot;
  point.add_point({0.1f, 0.2f, 0.3f}, Color(1, 2, 3));
  spot.add_spot({0.1f, 0.2f, 0.3f}, {1, 1, 0}, Color(1, 2, 3), 0.2f, 0.5f);
  Random random(3);
  const Emitters points(point.data), spots(spot.data);
  DVec3 sum(0);
  for (int i = 0; i < 50000; ++i) {
    const PhotonEmission a = points.emit(random(), random.square(), random.square());
    CHECK(a.delta);
    CHECK(a.position.p == Vec3(0.1f, 0.2f, 0.3f));
    CHECK(a.flux.y == doctest::Approx(8 * kPi));
    sum += DVec3(a.direction);
    const PhotonEmission b = spots.emit(random(), random.square(), random.square());
    CHECK(glm::dot(b.direction, spot.data.lights[0].direction) > std::cos(0.5f) - 1e-4f);
    CHECK(b.flux.y == doctest::Approx(spots.total_power().y).epsilon(1e-5));
  }
  CHECK(glm::length(sum) / 50000 < 4 / std::sqrt(50000.0));
}

TEST_CASE("distant light fills the bounding sphere's disk and carries the right irradiance to the middle") {
  SceneOfLights scene;
  scene.add_triangle({-0.5f, -0.6f, 0}, {0.6f, 0, 0}, {0, 0.7f, 0.1f}, Color(0));
  Image image;
  image.width = image.height = 1, image.channels = 3;
  image.floats = {1, 1, 1};
  for (const bool environment : {false, true}) {
    SceneOfLights lit = scene;
    if (!environment) lit.add_directional({1, 2, -3}, Color(2));
    const Emitters emitters(lit.data, environment ? &image : nullptr);
    Random random(4);
    constexpr int kCount = 400000;
    double flux = 0;
    int wrong = 0;
    for (int i = 0; i < kCount; ++i) {
      const PhotonEmission photon = emitters.emit(random(), random.square(), random.square());
      // All of the scene is ahead.
      bool right = photon.distant && photon.delta == !environment;
      for (const Vec3& p : scene.data.positions) right = right && glm::dot(p - photon.position.p, photon.direction) > 0;
      wrong += right ? 0 : 1;
      // Flux through a small square in the plane z = 0, downwards.
      if (photon.direction.z >= 0) continue;
      const Vec3 at = photon.position.p - photon.direction * (photon.position.p.z / photon.direction.z);
      if (std::abs(at.x) < 0.1f && std::abs(at.y) < 0.1f) flux += static_cast<double>(photon.flux.x) / kCount;
    }
    CHECK(wrong == 0);
    const double exact = environment ? kPi : 2 * 3 / std::sqrt(14.0);
    CHECK(flux / 0.04 == doctest::Approx(exact).epsilon(0.015));
  }
}

TEST_CASE("emitters are chosen in proportion to their power") {
  const SceneOfLights scene = SceneOfLights::many(50, 5);
  const Emitters emitters(scene.data);
  Random random(6);
  // Every particle then carries the same flux, on average over the channels.
  const float mean = mean_component(emitters.total_power());
  for (int i = 0; i < 5000; ++i) {
    const PhotonEmission photon = emitters.emit(random(), random.square(), random.square());
    CHECK(mean_component(photon.flux) == doctest::Approx(mean).epsilon(2e-3));
  }
}
