#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <cstring>

#include "../src/mesh_sites.hpp"
#include "ln/error.hpp"
#include "ln/mesh_reduction.hpp"
#include "ln/photon_mesh.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// The mesh of a scene's photons.
struct Meshed : Traced {
  explicit Meshed(const SceneData& data, std::uint64_t count, const PathAutomaton& via = path_automaton<AnyPath>(),
                  int threads = 2)
      : Traced(data, count, via, threads),
        sorted(sort_by_surface(stage.scene.data(), photons.hits)),
        mesh(photon_mesh(stage.context, sorted, {.node = 1})) {}

  /// Irradiance (first channel) at what a ray from `from` hits.
  double at(const TriMesh& of, const Vec3& from, const Vec3& direction) const {
    const Ray ray{from, glm::normalize(direction)};
    const Hit hit = stage.scene.accel().intersect(ray, 0);
    REQUIRE(hit.found());
    const Interaction x(stage.scene, ray, hit);
    return static_cast<double>(of.irradiance(hit.triangle, hit.u, hit.v, x.front).x);
  }

  /// Mean over the floor points that `place` makes of the unit square, seen from above.
  double mean(const std::function<Vec2(Vec2)>& place, float height = 0.9f) const {
    return mean_over_square([&](Vec2 u) {
      const Vec2 p = place(u);
      return at(mesh, {p.x, height, p.y}, {0, -1, 0});
    });
  }

  SortedPhotons sorted;
  TriMesh mesh;
};

/// The integral of a mesh over all surfaces, or some of its faces: its flux.
double flux(const TriMesh& mesh, const std::function<bool(std::uint32_t)>& counts = [](std::uint32_t) { return true; }) {
  double sum = 0;
  for (std::uint32_t face = 0; face < mesh.patches().face_count(); ++face) {
    if (!counts(face)) continue;
    const SurfaceCell cell = mesh.patches().surface(face / 2);
    for (const MeshTriangle& t : mesh.triangles(face)) {
      const Vec2 a = t.corner[1] - t.corner[0], b = t.corner[2] - t.corner[0];
      const float area = 0.5f * (a.x * b.y - a.y * b.x) * glm::length(glm::cross(cell.a, cell.b));
      for (const std::uint32_t v : t.vertex) sum += static_cast<double>(area * mesh.vertices()[v].x) / 3;
    }
  }
  return sum;
}

/// Photons on a floor whose mean irradiance is `mean`; they fall at x = `place(u)` in [-0.7, 0.7] for even u in [0, 1].
Photons floor_photons(const Scene& scene, float mean, std::uint32_t n, const std::function<float(float)>& place,
                      std::uint32_t seed = 11) {
  Photons photons;
  const SampleStream random(seed, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec2 u = random.get2(0, i, n);
    const Ray ray{{place(u.x), 0.5f, 1.4f * u.y - 0.7f}, {0, -1, 0}};
    Photon photon;
    photon.triangle = scene.accel().intersect(ray, 0).triangle;
    photon.position = {ray.origin.x, 0.01f, ray.origin.z};
    photon.normal = PackedNormal({0, 1, 0}, true);
    photon.flux = PackedColor(Color(mean * sqr(1.4f) / static_cast<float>(n)));
    photons.hits.push_back(photon);
  }
  return photons;
}

}  // namespace

TEST_CASE("photons are sorted by the side of what goes on without a crease") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)), true, 3);
  b.sphere(Vec3(0), 0.2f, b.material(Color(0.5f)), false, 20);
  const Meshed m(b.data, 20'000);
  std::size_t lit = 0, total = 0;
  for (std::size_t s = 0; s < m.sorted.surface_count(); ++s) {
    if (m.sorted.on(s).empty()) continue;
    ++lit;
    total += m.sorted.on(s).size();
    bool all_here = true;
    for (const Photon& photon : m.sorted.on(s))
      all_here &= 2 * m.sorted.sheet_of_triangle[photon.triangle] + (photon.normal.front() ? 0 : 1) == s;
    CHECK(all_here);
  }
  CHECK_EQ(lit, 7);  // six walls of nine quads each, one sphere
  CHECK_EQ(total, m.photons.hits.size());
}

TEST_CASE("an irradiance that is linear comes out as it is, up to borders and corners") {
  SceneBuilder b;
  add_floor(b);
  Stage stage(b.data);
  constexpr std::uint32_t kCount = 400'000;
  // The share of the flux up to t in [0, 1] is (t + 2 t^2) / 3: irradiance from 1 to 5.
  const Photons photons =
      floor_photons(stage.scene, 3, kCount, [](float u) { return 1.4f * (std::sqrt(1 + 24 * u) - 1) / 4 - 0.7f; });
  const SortedPhotons sorted = sort_by_surface(stage.scene.data(), photons.hits);
  const TriMesh mesh = photon_mesh(stage.context, sorted, {});
  const auto at = [&](float x, float z) {
    const Hit hit = stage.scene.accel().intersect({{x, 0.5f, z}, {0, -1, 0}}, 0);
    return static_cast<double>(mesh.irradiance(hit.triangle, hit.u, hit.v, true).x);
  };
  const auto truth = [](float x) { return 3 + 2 * static_cast<double>(x) / 0.7; };
  // Strips along both ends, where an estimate without correction would give half, and one that only divides by the area the
  // irradiance of the strip's inside: 0.04 more or less at this radius.
  for (const float x : {-0.699f, 0.699f, -0.35f, 0.0f, 0.35f}) {
    double sum = 0, sum2 = 0;
    constexpr int kPoints = 60;  // farther apart than kernels are wide
    for (int i = 0; i < kPoints; ++i) {
      const double E = at(x, (static_cast<float>(i) + 0.5f) * (1.4f / kPoints) - 0.7f) - truth(x);
      sum += E;
      sum2 += E * E;
    }
    const double mean = sum / kPoints, error = std::sqrt((sum2 / kPoints - mean * mean) / (kPoints - 1));
    CAPTURE(x);
    CHECK(std::abs(mean) < 4 * error);
    CHECK(error < 0.015 * truth(x));
  }
}

TEST_CASE("on triangles much finer than kernels, what is linear still comes out as it is") {
  SceneBuilder b;
  add_floor(b, 60);
  Stage stage(b.data);
  constexpr float kPlaces[] = {-0.699f, -0.69f, -0.35f, 0.0f, 0.35f, 0.69f, 0.699f};
  constexpr std::size_t kCount = std::size(kPlaces);
  constexpr int kSeeds = 8;
  double sum[kCount] = {}, sum2[kCount] = {};
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    // Irradiance from 1 to 5, as above.
    const Photons photons =
        floor_photons(stage.scene, 3, 50'000, [](float u) { return 1.4f * (std::sqrt(1 + 24 * u) - 1) / 4 - 0.7f; }, seed);
    const TriMesh mesh = photon_mesh(stage.context, sort_by_surface(stage.scene.data(), photons.hits), {});
    for (std::size_t i = 0; i < kCount; ++i) {
      double strip = 0;
      constexpr int kPoints = 100;
      for (int k = 0; k < kPoints; ++k) {
        const Hit hit = stage.scene.accel().intersect(
            {{kPlaces[i], 0.5f, (static_cast<float>(k) + 0.5f) * (1.4f / kPoints) - 0.7f}, {0, -1, 0}}, 0);
        strip += static_cast<double>(mesh.irradiance(hit.triangle, hit.u, hit.v, true).x) / kPoints;
      }
      sum[i] += strip;
      sum2[i] += strip * strip;
    }
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    CAPTURE(kPlaces[i]);
    const double mean = sum[i] / kSeeds, error = std::sqrt((sum2[i] / kSeeds - mean * mean) / (kSeeds - 1));
    const double truth = 3 + 2 * static_cast<double>(kPlaces[i]) / 0.7;
    const double measuring = 0.003 * truth;  // surface that is taken for points
    CHECK(std::abs(mean - truth) < measuring + 4 * error);
    CHECK(error < 0.01 * truth);
  }
}

TEST_CASE("a dark strip between bright ones stays dark") {
  SceneBuilder b;
  add_floor(b);
  Stage stage(b.data);
  // Irradiance 1, but 0.05 where |x| < 0.04: a hundred photons in the middle of the strip would reach beyond it.
  constexpr float kDark = 0.05f, kHalf = 0.04f, kWhole = 0.7f - kHalf + kDark * kHalf;  // flux of the right half
  const Photons photons = floor_photons(stage.scene, kWhole / 0.7f, 300'000, [=](float u) {
    const float flux = std::abs(2 * u - 1) * kWhole;  // between x = 0 and the photon
    const float x = flux < kDark * kHalf ? flux / kDark : kHalf + (flux - kDark * kHalf);
    return u < 0.5f ? -x : x;
  });
  const TriMesh mesh = photon_mesh(stage.context, sort_by_surface(stage.scene.data(), photons.hits), {});
  const auto mean_within = [&](float width) {
    return mean_over_square([&](Vec2 u) {
      const Hit hit = stage.scene.accel().intersect({{width * (2 * u.x - 1), 0.5f, 1.2f * u.y - 0.6f}, {0, -1, 0}}, 0);
      return static_cast<double>(mesh.irradiance(hit.triangle, hit.u, hit.v, true).x);
    });
  };
  // Kernels of a hundred photons at least leave 0.05 too much in the middle.
  CHECK(mean_within(0.01f) < static_cast<double>(kDark) + 0.035);
  CHECK(mean_within(0.7f) == doctest::Approx(kWhole / 0.7).epsilon(0.02));
}

TEST_CASE("the mesh is fine where the light changes, however wide the kernels beside it are") {
  SceneBuilder b;
  add_floor(b);
  Stage stage(b.data);
  // Irradiance 0.1 where x < 0.02, and 1 elsewhere.
  constexpr float kDark = 0.1f, kEdge = 0.02f, kLeft = kDark * (0.7f + kEdge), kWhole = kLeft + 0.7f - kEdge;
  const Photons photons = floor_photons(stage.scene, kWhole / 1.4f, 300'000, [=](float u) {
    const float flux = u * kWhole;  // left of the photon
    return flux < kLeft ? flux / kDark - 0.7f : kEdge + flux - kLeft;
  });
  const TriMesh mesh = photon_mesh(stage.context, sort_by_surface(stage.scene.data(), photons.hits), {});
  const auto mean_at = [&](float x) {
    return mean_over_square([&](Vec2 u) {
      const Hit hit = stage.scene.accel().intersect({{x, 0.5f, 1.2f * u.y - 0.6f}, {0, -1, 0}}, 0);
      return static_cast<double>(mesh.irradiance(hit.triangle, hit.u, hit.v, true).x);
    });
  };
  CHECK(mean_at(kEdge - 0.02f) < 1.3 * static_cast<double>(kDark));
  CHECK(mean_at(kEdge + 0.02f) > 0.9);
}

TEST_CASE("a plane under a directional light is evenly lit up to its border, in one piece or many") {
  for (const int pieces : {1, 7}) {
    SceneBuilder b;
    add_floor(b, pieces);
    b.directional({0.3f, -1, 0.2f}, Color(3));
    const Meshed m(b.data, 150'000);
    const double truth = 3 / std::sqrt(1 + 0.09 + 0.04);
    CHECK(m.mean([](Vec2 u) { return Vec2(1.4f * u.x - 0.7f, 1.4f * u.y - 0.7f); }) == doctest::Approx(truth).epsilon(0.01));
    CHECK(m.mean([](Vec2 u) { return Vec2(0.699f - 0.01f * u.x, 1.398f * u.y - 0.699f); }) ==
          doctest::Approx(truth).epsilon(0.02));
    CHECK(m.mean([](Vec2 u) { return Vec2(0.699f - 0.01f * u.x, 0.01f * u.y - 0.699f); }) ==
          doctest::Approx(truth).epsilon(0.15));
  }
}

TEST_CASE("a vertex with few photons takes what better neighbours say of it, unless its light is other light") {
  const auto at = [](float x, float radius) { return MeshVertex{{{x, 0, 0}, {0, 1, 0}, true}, 0, {{radius, radius}}}; };
  MeshVertex vertices[] = {at(0, 0.05f), at(0.1f, 0.3f), at(0.2f, 0.3f), at(0.4f, 0.3f)};
  SurfaceIrradiance irradiances[] = {{Color(2), 0.4f, Vec3(9)},
                                     {Color(3, 6, 0), 0.1f, Vec3(10, 0, 0)},
                                     {Color(6), 0.1f, Vec3(10, 0, 0)},
                                     {Color(7), 0.1f, Vec3(10, 0, 0)}};
  const std::uint32_t everything[] = {0, 1, 2, 3};
  const auto first = [&] { return steadied(0, vertices, irradiances, everything); };
  // The second says (3, 6, 0) * 2 / 3, with 16 times the weight; 6 - 2 is too much, 7 - 4 too far away.
  const Color expected = (Color(2) + 16.0f * Color(2, 4, 0)) / 17.0f;
  for (int k = 0; k < 3; ++k) CHECK(first()[k] == doctest::Approx(expected[k]));
  CHECK(steadied(1, vertices, irradiances, everything) == Color(3, 6, 0));
  irradiances[1].sigma = 0.3f;  // no better
  CHECK(first() == Color(2));
  irradiances[1].sigma = 0;  // unknown
  CHECK(first() == Color(2));
  irradiances[1].sigma = 0.1f;
  vertices[0].radii = vertices[1].radii;  // as wide, as at a border
  CHECK(first() == Color(2));
}

TEST_CASE("light that falls off steeply does so up to borders and corners") {
  SceneBuilder b;
  add_floor(b);
  const Vec3 lamp(0, 0.5f, 0);
  PunctualLight light;
  light.position = lamp;
  light.intensity = Color(1);
  b.data.lights.push_back(light);
  const Meshed m(b.data, 300'000);
  double sum2 = 0, most = 0;
  int count = 0;
  for (const MeshTriangle& t : m.mesh.triangles(Patches::face(0, true)))
    for (std::size_t k = 0; k < 3; ++k, ++count) {
      const SurfaceCell cell = m.mesh.patches().surface(0);
      const Vec3 way = lamp - (cell.o + t.corner[k].x * cell.a + t.corner[k].y * cell.b);
      const double truth = way.y / std::pow(glm::length(way), 3.0);
      const double error = static_cast<double>(m.mesh.vertices()[t.vertex[k]].x) / truth - 1;
      sum2 += error * error;
      most = std::max(most, std::abs(error));
    }
  CHECK(std::sqrt(sum2 / count) < 0.04);
  CHECK(most < 0.3);  // in a corner, whose kernels hold a quarter of the photons
}

TEST_CASE("hardly a vertex makes a speck in even light") {
  SceneBuilder b;
  b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.5f), Color(1)));
  const Meshed m(b.data, 1'000'000);
  const float truth = 2 * kPi;
  double specks = 0;
  for (const Color& E : m.mesh.vertices()) specks += std::abs(E.x / truth - 1) > 0.1f ? 1 : 0;
  CHECK(specks < 0.0035 * static_cast<double>(m.mesh.vertices().size()));  // 0.6 % by their own photons alone
}

TEST_CASE("the mesh has the energy of the photons") {
  SceneBuilder b;
  b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.5f), Color(1)));
  b.sphere(Vec3(0.1f, 0, 0), 0.2f, b.material(Color(0.7f)), false, 20);
  const Meshed m(b.data, 60'000);
  const double truth = total_flux(m.photons).x;
  CHECK(flux(m.mesh) == doctest::Approx(truth).epsilon(0.005));
}

TEST_CASE("things that stand on a floor leave no dark rim") {
  SceneBuilder b;
  add_floor(b);
  b.box({-0.2f, 0.01f, -0.2f}, {0.2f, 0.3f, 0.2f}, b.material(Color(0.5f)), false);
  b.directional({0, -1, 0}, Color(1));
  const Meshed m(b.data, 150'000, path_automaton<EmptyPath>());
  CHECK(m.mean([](Vec2 u) { return Vec2(0.202f + 0.01f * u.x, 0.3f * u.y - 0.15f); }) == doctest::Approx(1).epsilon(0.04));
  CHECK(m.mean([](Vec2 u) { return Vec2(0.4f + 0.2f * u.x, u.y - 0.5f); }) == doctest::Approx(1).epsilon(0.02));
}

TEST_CASE("a surface that few photons hit has their flux over its area") {
  SceneBuilder b;
  add_floor(b, 3);
  b.directional({0, -1, 0}, Color(2));
  const Meshed m(b.data, 45);
  const double hit = total_flux(m.photons).x;
  CHECK(m.at(m.mesh, {0.1f, 0.5f, 0.2f}, {0, -1, 0}) == doctest::Approx(hit / (1.4 * 1.4)).epsilon(1e-4));
  CHECK(m.at(m.mesh, {0.1f, -0.5f, 0.2f}, {0, 1, 0}) == 0);
}

TEST_CASE("a curved surface of many triangles has no cracks and no facets") {
  SceneBuilder b;
  b.sphere(Vec3(0), 0.8f, b.material(Color(0.5f), Color(1)), true, 24);
  const Meshed m(b.data, 60'000);
  const double mean = mean_over_square([&](Vec2 u) {
    const double E = m.at(m.mesh, Vec3(0), direction_at(u));
    CHECK(E > 3.5);
    return E;
  });
  CHECK(mean == doctest::Approx(2 * static_cast<double>(kPi)).epsilon(0.01));
}

TEST_CASE("a small ball of many triangles gets its light") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  b.sphere(Vec3(0.1f, 0, 0), 0.08f, b.material(Color(0.5f), Color(1)), false, 40);
  const Meshed m(b.data, 20'000);
  const std::uint32_t ball = m.sorted.sheet_of_triangle.back();
  double truth = 0;
  for (const Photon& photon : m.sorted.on(2 * ball)) truth += static_cast<double>(photon.flux.unpack().x);
  CHECK(flux(m.mesh, [&](std::uint32_t face) { return m.sorted.surface_of_face(face) == 2 * ball; }) ==
        doctest::Approx(truth).epsilon(0.02));
}

TEST_CASE("light does not leak below a thin wall") {
  SceneBuilder b;
  add_floor(b);
  add_thin_wall(b);
  b.directional({0, -1, 0}, Color(1));
  const Meshed m(b.data, 200'000, path_automaton<EmptyPath>());
  CHECK(m.mean([](Vec2 u) { return Vec2(-0.003f - 0.02f * u.x, 0.6f * u.y - 0.3f); }, 0.4f) < 1e-3);
  CHECK(m.mean([](Vec2 u) { return Vec2(0.003f + 0.02f * u.x, 0.6f * u.y - 0.3f); }, 0.4f) == doctest::Approx(1).epsilon(0.03));
}

TEST_CASE("kernels whose mesh would not fit into memory are refused at once") {
  SceneBuilder b;
  add_floor(b);
  b.directional({0, -1, 0}, Color(1));
  Meshed m(b.data, 2000);
  const auto mesh = [&](float radius) {
    return photon_mesh(m.stage.context, m.sorted, {.node = 1, .kernels = {.max_radius = radius}});
  };
  CHECK_THROWS_WITH_AS(mesh(1e-6f), doctest::Contains("raise 'radius' or 'spacing' of SurfaceDE"), Error);
  CHECK(mesh(0.05f).vertices().size() > 0);
}

TEST_CASE("any number of threads makes the same mesh") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  b.sphere(Vec3(0.1f, -0.2f, 0), 0.2f, b.material(Color(0.5f)), false, 60);  // finer than kernels
  const Meshed one(b.data, 10'000, path_automaton<AnyPath>(), 1);
  for (const int threads : {2, 5}) {
    const Meshed many(b.data, 10'000, path_automaton<AnyPath>(), threads);
    for (const auto& [x, y] :
         {std::pair{one.mesh, many.mesh}, std::pair{reduce(one.mesh, 0.05f, const_cast<Stage&>(one.stage).workers),
                                                    reduce(many.mesh, 0.05f, const_cast<Stage&>(many.stage).workers)}}) {
      REQUIRE_EQ(x.vertices().size(), y.vertices().size());
      REQUIRE_EQ(x.triangles().size(), y.triangles().size());
      CHECK(std::memcmp(x.vertices().data(), y.vertices().data(), x.vertices().size() * sizeof(Color)) == 0);
      CHECK(std::memcmp(x.triangles().data(), y.triangles().data(), x.triangles().size() * sizeof(MeshTriangle)) == 0);
    }
  }
}

TEST_CASE("a reduced mesh keeps its bound everywhere, and what is linear becomes two triangles") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  b.sphere(Vec3(0.1f, -0.2f, 0), 0.2f, b.material(Color(0.5f)), false, 12);
  Meshed m(b.data, 50'000);
  double area = 0;
  for (const double a : m.sorted.sheet_area) area += a;
  const double mean = flux(m.mesh) / area;
  std::size_t last = m.mesh.triangles().size() + 1;
  for (const float error : {0.0f, 0.02f, 0.1f, 0.5f}) {
    CAPTURE(error);
    const TriMesh reduced = reduce(m.mesh, error, m.stage.workers);
    CHECK(reduced.triangles().size() < last);
    last = reduced.triangles().size();
    const SampleStream random(7, 0);
    double most = 0;
    for (std::uint32_t i = 0; i < 20'000; ++i) {
      const auto face =
          static_cast<std::uint32_t>(random.get1(1, i, 20'000) * static_cast<float>(m.mesh.patches().face_count()));
      const DomainCell domain = m.mesh.patches().domain(face / 2);
      const Vec2 st = domain.point(random.get2(0, i, 20'000));
      most = std::max(most, static_cast<double>(std::abs(reduced.irradiance(face, st).x - m.mesh.irradiance(face, st).x)));
    }
    CHECK(most <= (static_cast<double>(error) + 2e-4) * mean);
    if (error == 0.1f) CHECK(most > 0.2 * static_cast<double>(error) * mean);
  }

  TriMesh linear(m.mesh.shared_patches());
  constexpr int n = 16;
  std::vector<MeshTriangle> triangles;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) linear.add_vertex(Color(static_cast<float>(1 + 3 * i + j)));
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t k = j * (n + 1) + i;
      const auto st = [&](std::uint32_t di, std::uint32_t dj) {
        return Vec2(static_cast<float>(i + di), static_cast<float>(j + dj)) / static_cast<float>(n);
      };
      triangles.push_back({{st(0, 0), st(1, 0), st(1, 1)}, {k, k + 1, k + n + 2}});
      triangles.push_back({{st(0, 0), st(1, 1), st(0, 1)}, {k, k + n + 2, k + n + 1}});
    }
  }
  linear.add_triangles(0, triangles);
  linear.finish(m.stage.workers);
  const TriMesh reduced = reduce(linear, 0.001f, m.stage.workers);
  CHECK_EQ(reduced.triangles().size(), 2);
  CHECK_EQ(reduced.irradiance(0, Vec2(0.3f, 0.6f)).x == doctest::Approx(1 + 48 * 0.3 + 16 * 0.6), true);
}
