#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/sampling.hpp"
#include "ln/tri_mesh.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

TEST_CASE("a mesh of any number of triangles gives back a linear function, on the sides that have triangles") {
  SceneBuilder b;
  b.quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, b.material(Color(0.5f)));
  const auto patches = std::make_shared<const Patches>(b.data);
  Workers workers(2);
  const auto truth = [](const Vec2& st) { return Color(1 + st.x, 2 - st.y, 3 * st.x + st.y); };
  for (const std::uint32_t n : {1u, 3u, 40u}) {
    TriMesh mesh(patches);
    std::vector<MeshTriangle> triangles;
    // Lines that get denser towards one corner.
    const auto place = [&](std::uint32_t i) { return sqr(static_cast<float>(i) / static_cast<float>(n)); };
    for (std::uint32_t j = 0; j <= n; ++j)
      for (std::uint32_t i = 0; i <= n; ++i) mesh.add_vertex(truth({place(i), place(j)}));
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t k = j * (n + 1) + i;
        const Vec2 p(place(i), place(j)), q(place(i + 1), place(j)), r(place(i + 1), place(j + 1)), s(place(i), place(j + 1));
        triangles.push_back({{p, q, r}, {k, k + 1, k + n + 2}});
        triangles.push_back({{p, r, s}, {k, k + n + 2, k + n + 1}});
      }
    }
    mesh.add_triangles(Patches::face(0, true), triangles);
    mesh.finish(workers);
    CHECK(mesh.triangles(0).size() == 2 * n * n);
    const SampleStream random(1, 0);
    for (std::uint32_t i = 0; i < 2000; ++i) {
      Vec2 st = random.get2(0, i, 2000);
      if (i % 10 == 0) st = Vec2(std::round(st.x), std::round(st.y));  // the corners
      if (i % 10 == 1) st.x = std::round(st.x);                        // the border
      const Hit hit = patches->hit(0, st);
      const Color found = mesh.irradiance(hit.triangle, hit.u, hit.v, true);
      CHECK(glm::distance(found, truth(st)) < 1e-4f);
      CHECK(mesh.irradiance(hit.triangle, hit.u, hit.v, false) == Color(0));
    }
  }
}

TEST_CASE("an empty mesh is dark") { CHECK(TriMesh().irradiance(0, 0.1f, 0.2f, true) == Color(0)); }
