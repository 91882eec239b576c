#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/patches.hpp"
#include "ln/sampling.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

Vec3 position(const SceneData& data, const Hit& hit) {
  const UVec3 i = data.triangles[hit.triangle];
  return (1 - hit.u - hit.v) * data.positions[i.x] + hit.u * data.positions[i.y] + hit.v * data.positions[i.z];
}

Vec3 position(const SurfaceCell& cell, const Vec2& st) { return cell.o + st.x * cell.a + st.y * cell.b; }

double total_area(const Patches& patches) {
  double sum = 0;
  for (std::uint32_t p = 0; p < patches.size(); ++p) sum += static_cast<double>(area(patches.surface(p)));
  return sum;
}

/// A grid, a sphere and a trapezoid, which is no parallelogram.
SceneData shapes() {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f));
  b.quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, m, 4);
  b.sphere(Vec3(0, 0.5f, 0), 0.3f, m, false, 6);
  b.quad({-0.5f, 0.1f, 0.5f}, {0.5f, 0.1f, 0.5f}, {0.2f, 0.1f, -0.5f}, {-0.2f, 0.1f, -0.5f}, m);
  return b.data;
}

}  // namespace

TEST_CASE("squares become quads, trapezoids stay triangles") {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f));
  b.quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, m, 5);
  Patches patches(b.data);
  CHECK(patches.size() == 25);
  for (std::uint32_t p = 0; p < patches.size(); ++p) {
    CHECK(patches.quad(p));
    CHECK(area(patches.surface(p)) == doctest::Approx(0.16));
    CHECK(glm::dot(patches.surface(p).a, patches.surface(p).b) == doctest::Approx(0).epsilon(1e-6));  // no sheared ones
  }
  b.quad({-0.5f, 0.1f, 0.5f}, {0.5f, 0.1f, 0.5f}, {0.2f, 0.1f, -0.5f}, {-0.2f, 0.1f, -0.5f}, m);
  patches = Patches(b.data);
  CHECK(patches.size() == 27);
  CHECK(total_area(patches) == doctest::Approx(4 + 0.7));
}

TEST_CASE("locate and hit are inverse, and agree with the cell in space") {
  const SceneData data = shapes();
  const Patches patches(data);
  const SampleStream random(1, 0);
  std::uint32_t i = 0;
  for (std::uint32_t p = 0; p < patches.size(); ++p) {
    for (int k = 0; k < 8; ++k) {
      const Vec2 st = patches.domain(p).point(random.get2(0, i++, 4096));
      const Hit hit = patches.hit(p, st);
      CHECK(glm::distance(position(data, hit), position(patches.surface(p), st)) < 1e-6f);
      const Patches::Location back = patches.locate(hit.triangle, hit.u, hit.v);
      CHECK(back.patch == p);
      CHECK(glm::distance(back.st, st) < 1e-6f);
    }
  }
  for (std::uint32_t t = 0; t < data.triangles.size(); ++t) {
    const Hit hit{0, t, 0.2f, 0.3f};
    const Patches::Location at = patches.locate(t, hit.u, hit.v);
    CHECK(glm::distance(position(data, hit), position(patches.surface(at.patch), at.st)) < 1e-6f);
  }
}

TEST_CASE("children tile their cell, in equal areas; descend finds the one that a point is in") {
  for (const bool quad : {true, false}) {
    const DomainCell cell{Vec2(0), Vec2(1, 0), Vec2(0, 1), quad};
    int count[4] = {};
    const SampleStream random(2, 0);
    for (std::uint32_t i = 0; i < 4096; ++i) {
      const Vec2 p = cell.point(random.get2(0, i, 4096));
      Vec2 local = p;
      const int child = descend(quad, local);
      ++count[child];
      const DomainCell c = cell.child(child);
      CHECK(glm::distance(c.o + local.x * c.a + local.y * c.b, p) < 1e-6f);
      CHECK(min_component(Vec3(local, 0)) >= 0);
      CHECK((quad ? std::max(local.x, local.y) : local.x + local.y) <= 1);
    }
    for (const int n : count) CHECK(n == doctest::Approx(1024).epsilon(0.02));
    Vec2 corner(1, 0);
    CHECK(descend(quad, corner) == 1);
    CHECK(corner == Vec2(1, 0));
  }
}

TEST_CASE("neighbours share an edge without a crease, whatever the vertices' numbers") {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f));
  b.quad({-1, 0, 1}, {0, 0, 1}, {0, 0, 0}, {-1, 0, 0}, m);
  b.quad({0, 0, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0}, m);                       // beside it
  b.quad({-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, m);                     // stands on its border
  b.quad({0, 0, 0}, {1, 0, 0}, {1, 0, -1}, {0, 0, -1}, b.material(Color(1)));  // another part
  const Patches patches(b.data);
  REQUIRE(patches.size() == 4);
  int found = 0;
  for (std::uint32_t p = 0; p < patches.size(); ++p) {
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t n = patches.neighbour(p, k);
      if (n == Patches::kNone) continue;
      ++found;
      CHECK(patches.neighbour(n / 4, static_cast<int>(n % 4)) == 4 * p + static_cast<std::uint32_t>(k));
      const SurfaceCell mine = patches.surface(p), other = patches.surface(n / 4);
      CHECK(glm::distance(mine.corner(k), other.corner(static_cast<int>(n % 4 + 1) % 4)) < 1e-6f);
      CHECK(glm::distance(mine.corner((k + 1) % 4), other.corner(static_cast<int>(n % 4))) < 1e-6f);
    }
  }
  CHECK(found == 4);
}
