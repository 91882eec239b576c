#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <algorithm>

#include "ln/photon_map.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

Vec3 random_unit(const SampleStream& random, std::uint32_t d, std::uint32_t i, std::uint32_t n) {
  const Vec2 u = random.get2(d, i, n);
  const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
  return {r * std::cos(2 * kPi * u.y), r * std::sin(2 * kPi * u.y), z};
}

/// Photons all over two spheres, a plane and one point, of both sides.
Photons scattered(std::uint32_t n) {
  const SampleStream random(3, 0);
  Photons photons;
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 v = random_unit(random, 0, i, n);
    const bool front = random.get1(1, i, n) < 0.7f;
    Photon p;
    p.flux = PackedColor(Color(static_cast<float>(i + 1)));
    switch (i % 4) {
      case 0: p.position = 0.5f * v; break;
      case 1: p.position = Vec3(0.2f) + 0.1f * v; break;
      case 2: p.position = Vec3(v.x, v.y, -0.3f); break;
      default: p.position = i % 64 == 3 ? Vec3(0.25f, 0.25f, -0.3f) : Vec3(v.x * 0.3f, v.y * 0.3f, -0.31f);
    }
    p.normal = PackedNormal(i % 4 < 2 ? (front ? v : -v) : Vec3(0, 0, front ? 1 : -1), front);
    photons.hits.push_back(p);
  }
  return photons;
}

bool belongs(const Neighbourhood& around, const Photon& p) {
  const float cosine = glm::dot(p.normal.normal(), around.normal);
  if (p.normal.front() != around.front || !(cosine > Neighbourhood::kMinCos)) return false;
  const Vec3 d = p.position - around.point;
  const float h = glm::dot(d, around.normal), in_plane2 = glm::dot(d, d) - h * h;
  const float step = h + glm::dot(d, p.normal.normal()), max_step = Neighbourhood::max_step(cosine);
  return h * h * 1.25f <= 0.25f * glm::dot(d, d) + 1e-12f && step * step <= max_step * max_step * in_plane2 + 1e-12f;
}

}  // namespace

TEST_CASE("the nearest photons are those that a search of all finds") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  Stage stage(b.data);
  const SampleStream random(5, 0);
  for (const std::uint32_t n : {1u, 7u, 8u, 9u, 100u, 20'000u, 150'000u}) {
    const Photons photons = scattered(n);
    const PhotonMap map(stage.context, photons.hits);
    CHECK(map.size() == n);
    for (const std::size_t wanted : {1u, 2u, 10u, 60u, 500u}) {
      std::vector<NearPhoton> found(PhotonMap::capacity(wanted));
      for (std::uint32_t q = 0; q < 40; ++q) {
        const Photon& at = photons.hits[hash32(q) % n];
        // On the surface, or beside it.
        const Vec3 offset = q % 2 == 0 ? Vec3(0) : 0.01f * random_unit(random, 2, q, 40);
        const Neighbourhood around{at.position + offset, at.normal.normal(), at.normal.front()};
        const float limit = q % 3 == 0 ? 0.02f : 16.0f;
        std::vector<float> expected;
        for (const Photon& p : photons.hits) {
          const Vec3 d = p.position - around.point;
          if (belongs(around, p) && glm::dot(d, d) < limit) expected.push_back(glm::dot(d, d));
        }
        std::sort(expected.begin(), expected.end());
        const std::size_t count = map.nearest(around, limit, wanted, found.data());
        REQUIRE(count == std::min(wanted, expected.size()));
        if (count == wanted) CHECK(found[count - 1].distance2 == doctest::Approx(expected[count - 1]));
        std::vector<float> distances;
        for (std::size_t i = 0; i < count; ++i) {
          distances.push_back(found[i].distance2);
          const Vec3 d = map.position(found[i].slot) - around.point;
          CHECK(glm::dot(d, d) == doctest::Approx(found[i].distance2).epsilon(1e-5));
        }
        std::sort(distances.begin(), distances.end());
        for (std::size_t i = 0; i < count; ++i) CHECK(distances[i] == doctest::Approx(expected[i]).epsilon(1e-5));
      }
    }
  }
}

TEST_CASE("the map keeps every photon once, in the same place for any number of threads") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  const Photons photons = scattered(100'003);
  std::vector<std::vector<float>> fluxes;
  for (const int threads : {1, 2, 5}) {
    Stage stage(b.data, threads);
    const PhotonMap map(stage.context, photons.hits);
    std::vector<float>& f = fluxes.emplace_back();
    for (std::uint32_t i = 0; i < map.size(); ++i) f.push_back(map.flux(i).x);
  }
  CHECK(fluxes[1] == fluxes[0]);
  CHECK(fluxes[2] == fluxes[0]);
  std::sort(fluxes[0].begin(), fluxes[0].end());
  for (std::size_t i = 0; i < fluxes[0].size(); ++i) REQUIRE(fluxes[0][i] == static_cast<float>(i + 1));
}

TEST_CASE("an empty map has no neighbours") {
  const PhotonMap map;
  NearPhoton found[PhotonMap::capacity(4)];
  CHECK(map.nearest({}, 1, 4, found) == 0);
}
