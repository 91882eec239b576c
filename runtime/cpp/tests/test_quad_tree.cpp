#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <atomic>

#include "ln/quad_tree_mesh.hpp"
#include "ln/quad_tree_sampling.hpp"
#include "photon_scenes.hpp"
#include "quad_tree_functions.hpp"

using namespace ln;
using namespace ln::test;

namespace {

constexpr double kSceneArea = 2 + 1;  // of both sheets

/// Two sheets that meet at a right angle: a floor of 2 x 2 squares, and a wall of triangles on it.
SceneData corner_scene() {
  SceneBuilder b;
  b.quad({-0.5f, 0, 0.5f}, {0.5f, 0, 0.5f}, {0.5f, 0, -0.5f}, {-0.5f, 0, -0.5f}, b.material(Color(0.5f)), 2);
  b.quad({-0.5f, 0, -0.5f}, {0.5f, 0, -0.5f}, {0.4f, 0.6f, -0.5f}, {-0.2f, 0.6f, -0.5f}, b.material(Color(0.5f)));
  return b.data;
}

Vec3 world(const Patches& patches, std::uint32_t face, const Vec2& st) {
  const SurfaceCell s = patches.surface(face / 2);
  return s.o + st.x * s.a + st.y * s.b;
}

Color bumpy(const Vec3& p) {
  return {1 + std::sin(9 * p.x) * std::cos(7 * p.z), p.x > 0.13f ? 2.0f : 0.1f, std::exp(-20 * glm::dot(p, p))};
}

/// Squared L2 distance of two trees, by a sum over a fine grid, and that of the first from 0.
std::pair<double, double> distances(const QuadTree& x, const QuadTree& y) {
  double difference = 0, norm = 0;
  for (std::uint32_t face = 0; face < x.patches().face_count(); ++face) {
    x.for_each_leaf(face, [&](const DomainCell& cell, const Color& value) {
      const double a = static_cast<double>(area(surface_cell(x.patches().surface(face / 2), cell)));
      const Color d = value - y.irradiance(face, cell.center());
      difference += a * static_cast<double>(glm::dot(d, d));
      norm += a * static_cast<double>(glm::dot(value, value));
    });
  }
  return {difference, norm};
}

std::size_t leaf_count(const QuadTree& tree) {
  std::size_t n = 0;
  for (std::uint32_t face = 0; face < tree.patches().face_count(); ++face)
    tree.for_each_leaf(face, [&](const DomainCell&, const Color&) { ++n; });
  return n;
}

/// A wildly graded tree of a function given by position.
template <class Function>
QuadTree graded(const std::shared_ptr<const Patches>& patches, Function&& function) {
  QuadTree tree(patches);
  for (std::uint32_t face = 0; face < patches->face_count(); face += 2) {
    const auto wanted = [&](const DomainCell& cell) {
      const Vec3 p = world(*patches, face, cell.center());
      return larger_than(cell, 2) ||
             (larger_than(cell, 7) && glm::distance(p, Vec3(0.02f, 0, -0.43f)) < 3 * glm::length(cell.a) * 0.25f);
    };
    set_face(tree, face, wanted, [&](const DomainCell& cell) { return function(world(*patches, face, cell.center())); });
  }
  return tree;
}

}  // namespace

TEST_CASE("a point has the value of its leaf, a cell the mean of its children, a face that is black no nodes") {
  const SceneData data = corner_scene();
  const auto patches = std::make_shared<const Patches>(data);
  QuadTree tree(patches);
  CHECK(tree.irradiance(0, 0.1f, 0.1f, true) == Color(0));
  for (const std::uint32_t face : {0u, 8u})
    set_face(
        tree, face, [](const DomainCell& c) { return larger_than(c, 4); },
        [&](const DomainCell& c) { return bumpy(world(*patches, face, c.center())); });
  std::vector<QuadTreeNode> black(5);
  black[0].children = 1;
  tree.set(2, black);
  CHECK(!tree.lit(2));
  CHECK(tree.lit(8));
  DVec3 sum(0);
  for (const std::uint32_t face : {0u, 8u}) {
    CHECK(patches->quad(face / 2) == (face == 0));
    tree.for_each_leaf(face, [&](const DomainCell& cell, const Color& value) {
      sum += static_cast<double>(area(surface_cell(patches->surface(face / 2), cell))) * DVec3(value);
      for (const Vec2 u : {Vec2(0.1f, 0.2f), Vec2(0.9f, 0.6f)}) {
        const Hit hit = patches->hit(face / 2, cell.point(u));
        CHECK(tree.irradiance(hit.triangle, hit.u, hit.v, true) == value);
        CHECK(tree.irradiance(hit.triangle, hit.u, hit.v, false) == Color(0));
      }
    });
  }
  CHECK(glm::distance(sum, tree.flux()) < 1e-6);
}

TEST_CASE("compression keeps the L2 error that it promises, uses most of it, and leaves the flux as it was") {
  const SceneData data = corner_scene();
  const auto patches = std::make_shared<const Patches>(data);
  QuadTree tree(patches);
  for (std::uint32_t face = 0; face < patches->face_count(); face += 2)
    set_face(
        tree, face, [](const DomainCell& c) { return larger_than(c, 6); },
        [&](const DomainCell& c) { return bumpy(world(*patches, face, c.center())); });
  for (const float error : {0.0f, 0.003f, 0.03f, 0.3f}) {
    CAPTURE(error);
    QuadTree compressed = tree;
    compressed.compress(error);
    const auto [difference, norm] = distances(tree, compressed);
    const double found = std::sqrt(difference / norm);
    CHECK(found <= static_cast<double>(error) * (1 + 1e-6));
    CHECK(found >= 0.8 * static_cast<double>(error));
    CHECK(glm::distance(tree.flux(), compressed.flux()) < 1e-5);
    if (error > 0.02f) CHECK(leaf_count(compressed) < leaf_count(tree) / 4);
  }
}

TEST_CASE("the mesh of a function that is linear on each plane is that function, however its cells are graded") {
  const SceneData data = corner_scene();
  const auto patches = std::make_shared<const Patches>(data);
  const auto truth = [](const Vec3& p) { return Color(3 + p.x + 2 * p.y + p.z, 2 - p.x - p.y, 1); };
  Workers workers(2);
  const QuadTree tree = graded(patches, truth);
  REQUIRE(leaf_count(tree) > 200);
  const TriMesh mesh = reconstruct(tree, workers);
  for (std::uint32_t face = 0; face < patches->face_count(); face += 2) {
    for (const MeshTriangle& t : mesh.triangles(face))
      for (int k = 0; k < 3; ++k)
        CHECK(glm::distance(mesh.vertices()[t.vertex[k]], truth(world(*patches, face, t.corner[k]))) < 2e-4f);
    const SampleStream random(face, 0);
    for (std::uint32_t i = 0; i < 500; ++i) {
      const Vec2 st = patches->domain(face / 2).point(random.get2(0, i, 500));
      CHECK(glm::distance(mesh.irradiance(face, st), truth(world(*patches, face, st))) < 2e-4f);
    }
  }
}

TEST_CASE("the mesh of any cells is continuous: no cracks, no vertices inside of edges, and dark where no light is") {
  const SceneData data = corner_scene();
  const auto patches = std::make_shared<const Patches>(data);
  Workers workers(2);
  const TriMesh mesh = reconstruct(graded(patches, bumpy), workers);
  double covered = 0;
  for (std::uint32_t face = 0; face < patches->face_count(); ++face) {
    const float scale = area(patches->surface(face / 2)) * (patches->quad(face / 2) ? 1.0f : 2.0f);
    const auto triangles = mesh.triangles(face);
    if (face % 2 == 1) CHECK(triangles.empty());
    for (const MeshTriangle& t : triangles) {
      const Vec2 a = t.corner[1] - t.corner[0], b = t.corner[2] - t.corner[0];
      const float whole = a.x * b.y - a.y * b.x;
      CHECK(whole > 0);
      covered += static_cast<double>(0.5f * whole * scale);
      // A vertex of any other triangle never lies inside of an edge.
      for (int k = 0; k < 3; ++k) {
        const Vec2 p = t.corner[k], d = t.corner[(k + 1) % 3] - p;
        for (const MeshTriangle& other : triangles) {
          for (const Vec2& q : other.corner) {
            const float along = glm::dot(q - p, d) / glm::dot(d, d);
            const float across = std::abs(d.x * (q.y - p.y) - d.y * (q.x - p.x)) / glm::dot(d, d);
            if (along > 0.01f && along < 0.99f && across < 0.01f) FAIL_CHECK("a T-vertex");
          }
        }
      }
    }
  }
  CHECK(covered == doctest::Approx(kSceneArea - 1 - 0.52).epsilon(1e-4));  // floor 1, wall 0.48
  // Along the edges between the squares of the floor both sides agree; at the crease they need not.
  int edges = 0;
  for (std::uint32_t p = 0; p < patches->size(); ++p) {
    for (int k = 0; k < patches->domain(p).corner_count(); ++k) {
      const std::uint32_t n = patches->neighbour(p, k);
      if (n == Patches::kNone) continue;
      ++edges;
      const DomainCell mine = patches->domain(p), other = patches->domain(n / 4);
      const auto on = [](const DomainCell& c, int edge, float x) {
        return (1 - x) * c.corner(edge) + x * c.corner((edge + 1) % c.corner_count());
      };
      for (float x = 0; x <= 1; x += 1.0f / 64) {
        const Color here = mesh.irradiance(2 * p, on(mine, k, x)),
                    there = mesh.irradiance(2 * (n / 4), on(other, static_cast<int>(n % 4), 1 - x));
        CHECK(glm::distance(here, there) < 1e-3f);
      }
    }
  }
  CHECK(edges == 2 * (4 + 1));
}

TEST_CASE("a dark face beside a lit one is joined to it") {
  const SceneData data = corner_scene();
  const auto patches = std::make_shared<const Patches>(data);
  QuadTree tree(patches);
  set_face(tree, 0, [](const DomainCell& c) { return larger_than(c, 3); }, [](const DomainCell&) { return Color(1); });
  Workers workers(2);
  const TriMesh mesh = reconstruct(tree, workers);
  CHECK(mesh.irradiance(0, {0.5f, 0.5f}) == Color(1));
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t n = patches->neighbour(0, k);
    if (n == Patches::kNone) continue;
    const DomainCell other = patches->domain(n / 4);
    const Vec2 there = 0.5f * (other.corner(static_cast<int>(n % 4)) + other.corner(static_cast<int>(n % 4 + 1) % 4));
    CHECK(
        mesh.irradiance(2 * (n / 4), there).x ==
        doctest::Approx(mesh.irradiance(0, 0.5f * (patches->domain(0).corner(k) + patches->domain(0).corner((k + 1) % 4))).x));
    CHECK(mesh.irradiance(2 * (n / 4), other.center()).x < 0.3f);
  }
}

TEST_CASE("sampled cells have the means of the function, in more detail where it varies, whatever the number of threads") {
  const Vec3 center(-0.23f, 0, 0.17f);
  const auto truth = [&](const Vec3& p) { return glm::distance(p, center) < 0.2f ? Color(2) : Color(0.5f, 0.5f, 0.1f); };
  DVec3 flux[2];
  for (const int threads : {1, 3}) {
    Stage stage(corner_scene(), threads);
    const auto sample = [&](Tracer& tracer, const SampleStream&, const Hit& hit, bool front) {
      SurfacePosition at;
      tracer.scene().locate(hit, at);
      return front ? truth(at.p) : Color(0);
    };
    const QuadTree tree = sample_quad_tree(stage.context, 1, {16, 0.1f, 8, 0.01f}, sample);
    flux[threads / 2] = tree.flux();
    float smallest = 1, largest = 0;
    for (std::uint32_t face = 0; face < tree.patches().face_count(); ++face) {
      if (face % 2 == 1) CHECK(!tree.lit(face));
      tree.for_each_leaf(face, [&](const DomainCell& cell, const Color&) {
        smallest = std::min(smallest, glm::length(cell.a));
        largest = std::max(largest, glm::length(cell.a));
      });
    }
    CHECK(smallest < 0.02f);
    CHECK(largest > 0.1f);
    // The rim is known to a 64th of the circle's area.
    const double disc = static_cast<double>(kPi) * 0.04;
    CHECK(tree.flux().x == doctest::Approx(0.5 * 1.48 + 1.5 * disc).epsilon(0.003));
  }
  CHECK(flux[0] == flux[1]);
}

TEST_CASE("noise is smoothed away, not resolved, also by few samples, which cannot tell it from detail") {
  for (const int samples : {4, 16}) {
    CAPTURE(samples);
    Stage stage(corner_scene());
    std::atomic<int> drawn = 0;
    const auto sample = [&](Tracer&, const SampleStream& random, const Hit&, bool) {
      ++drawn;
      return Color(random.get1(5, 0) < 0.5f ? 0.0f : 2.0f);
    };
    const QuadTree tree = sample_quad_tree(stage.context, 1, {samples, 0.1f, 8, 0.01f}, sample);
    CHECK(leaf_count(tree) < 200);  // of 4 x 64 + 2 x 64 at first, on both sides
    CHECK(drawn.load() < 100'000);  // not 4^8 cells on each face
    CHECK(tree.flux().x == doctest::Approx(2 * 1.48).epsilon(0.01));
  }
}

TEST_CASE("what is sampled in several batches is what it is in one: within its error of the function") {
  Stage stage(corner_scene());
  const auto sample = [](Tracer& tracer, const SampleStream&, const Hit& hit, bool front) {
    SurfacePosition at;
    tracer.scene().locate(hit, at);
    return front ? bumpy(at.p) : Color(0);
  };
  const QuadTree tree = sample_quad_tree(stage.context, 1, {4, 0.005f, 9, 0.02f}, sample);  // 200,000 first cells
  double difference = 0, norm = 0;
  for (std::uint32_t face = 0; face < tree.patches().face_count(); face += 2) {
    const double a = static_cast<double>(area(tree.patches().surface(face / 2)));
    for (std::uint32_t i = 0; i < 4096; ++i) {
      const Vec2 st = tree.patches().domain(face / 2).point(sobol_point(1, 0, i));
      const Color truth = bumpy(world(tree.patches(), face, st)), d = tree.irradiance(face, st) - truth;
      difference += a * static_cast<double>(glm::dot(d, d));
      norm += a * static_cast<double>(glm::dot(truth, truth));
    }
  }
  // 2 % by compression, as much by what cells vary by without being cut, and a jump through cells of 0.001.
  CHECK(std::sqrt(difference / norm) < 0.04);
  CHECK(leaf_count(tree) < 10000);
}
