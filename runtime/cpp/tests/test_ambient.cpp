#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/ambient.hpp"
#include "photon_scenes.hpp"
#include "quad_tree_functions.hpp"

using namespace ln;
using namespace ln::test;

TEST_CASE("the mean is over what lies in lit space: shadows count, the outside of a room and what is below a block do not") {
  // A room on a floor of twice its size; a block on the floor.
  SceneBuilder b;
  const std::uint32_t white = b.material(Color(0.5f));
  const float h = 0.5f, f = 0.0625f;
  b.quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, white);
  const Vec3 foot[] = {{-h, 0, -h}, {h, 0, -h}, {h, 0, h}, {-h, 0, h}}, up(0, h, 0);
  for (int k = 0; k < 4; ++k) b.quad(foot[k], foot[(k + 1) % 4], foot[(k + 1) % 4] + up, foot[k] + up, white);
  b.quad(foot[0] + up, foot[1] + up, foot[2] + up, foot[3] + up, white);
  b.box({0, 0, -4 * f}, {2 * f, f, 0}, white, false);
  Stage stage(b.data);
  const auto patches = std::make_shared<const Patches>(stage.scene.data());
  QuadTree in(patches);
  // 2 on the floor of the room, but for a shadow in one quarter of it and below the block; 1 on the block.
  const auto lit_floor = [&](const Vec3& p) {
    const bool shadow = p.x < 0 && p.z > 0, block = p.x > 0 && p.x < 2 * f && p.z < 0 && p.z > -4 * f;
    return std::max(std::abs(p.x), std::abs(p.z)) < h && !shadow && !block;
  };
  const double block_area = static_cast<double>(2 * (2 + 4) * f * f + 8 * f * f), below = static_cast<double>(8 * f * f);
  for (std::uint32_t p = 0; p < patches->size(); ++p) {
    const SurfaceCell s = patches->surface(p);
    const std::uint32_t face = Patches::face(p, true);
    if (area(s) > 3) {
      set_face(
          in, face, [](const DomainCell& c) { return larger_than(c, 5); },
          [&](const DomainCell& c) { return lit_floor(surface_cell(s, c).center()) ? Color(2) : Color(0); });
    } else if (area(s) < 0.1f && s.center().y > 0) {
      in.set(face, {{Color(1)}});
    }
  }
  const double room = 1 + 4 * 0.5 + 1;  // floor, walls, ceiling
  const double truth = (2 * (0.75 - below) + block_area) / (room - below + block_area);
  const AmbientLight ambient(stage.context, 1, in, {});
  CHECK(static_cast<double>(ambient.mean().x) == doctest::Approx(truth).epsilon(0.01));

  // It is given to lit space alone, and what was read is given.
  const auto at = [&](const Vec3& p, const Vec3& n) {
    Tracer tracer(stage.scene, 2, 0);
    const Hit hit = tracer.intersect({p + 0.01f * n, -n, kInfinity}, 0, 1, RayKind::gather);
    SurfacePosition found;
    stage.scene.locate(hit, found);
    return (ambient.irradiance(hit.triangle, hit.u, hit.v, glm::dot(found.ng, n) > 0) / ambient.mean()).x;
  };
  const Vec3 y(0, 1, 0), x(1, 0, 0);
  CHECK(at({0.4f, 0, 0.3f}, y) == 1);             // on the floor
  CHECK(at({-0.3f, 0, 0.3f}, y) == 1);            // in the shadow
  CHECK(at({f, f, -2 * f}, y) == 1);              // on the block
  CHECK(at({0.2f, h, 0.1f}, -y) == 1);            // below the ceiling
  CHECK(at({0.8f, 0, 0.1f}, y) == 0);             // on the floor outside of the room
  CHECK(at({f, 0, -2 * f}, y) == 0);              // below the block
  CHECK(at({0.2f, h, 0.1f}, y) == 0);             // on the roof
  CHECK(at({h, 0.2f, 0.1f}, x) == 0);             // outside of a wall
  CHECK(at({2 * f, 0.5f * f, -2 * f}, -x) == 0);  // inside of the block
  double given = 0, read = 0;
  for (std::uint32_t p = 0; p < patches->size(); ++p) {
    const SurfaceCell s = patches->surface(p);
    constexpr int kSide = 128;  // all cells are coarser
    for (const bool front : {true, false}) {
      const std::uint32_t face = Patches::face(p, front);
      in.for_each_leaf(
          face, [&](const DomainCell& c, const Color& E) { read += static_cast<double>(area(surface_cell(s, c)) * E.x); });
      for (int i = 0; i < kSide * kSide; ++i) {
        const Vec2 u((static_cast<float>(i % kSide) + 0.5f) / kSide, (static_cast<float>(i / kSide) + 0.5f) / kSide);
        const Hit hit = patches->hit(p, patches->domain(p).point(u));
        given += static_cast<double>(area(s) * ambient.irradiance(hit.triangle, hit.u, hit.v, front).x) / (kSide * kSide);
      }
    }
  }
  CHECK(given == doctest::Approx(read).epsilon(1e-4));
  CHECK(AmbientLight(stage.context, 1, QuadTree(patches), {}).mean() == Color(0));
}

TEST_CASE("what hangs in a lit room gets its light, on both sides of a single-sided sheet, too; mirrors hold none") {
  SceneBuilder b;
  const std::uint32_t white = b.material(Color(0.5f));
  b.box(Vec3(-0.5f), Vec3(0.5f), white);
  b.quad({-0.1f, 0, -0.1f}, {0.1f, 0, -0.1f}, {0.1f, 0, 0.1f}, {-0.1f, 0, 0.1f}, white);
  b.sphere({0.3f, 0.3f, 0}, 0.1f, b.mirror(), false, 8);
  Stage stage(b.data);
  const auto patches = std::make_shared<const Patches>(stage.scene.data());
  QuadTree in(patches);
  for (std::uint32_t p = 0; p < patches->size(); ++p)
    if (area(patches->surface(p)) > 0.5f) in.set(Patches::face(p, true), {{Color(3)}});
  const AmbientLight ambient(stage.context, 1, in, {});
  CHECK(static_cast<double>(ambient.mean().x) == doctest::Approx(3 * 6 / (6 + 2 * 0.04)).epsilon(1e-4));
  const std::uint32_t sheet = 12;  // behind the box's triangles
  for (const bool front : {true, false}) CHECK(ambient.irradiance(sheet, 0.2f, 0.3f, front) == ambient.mean());
  for (const bool front : {true, false}) CHECK(is_black(ambient.irradiance(0, 0.2f, 0.3f, front)) != front);
}
