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
  CHECK(static_cast<double>(ambient_irradiance(stage.context, 1, in, {}).x) == doctest::Approx(truth).epsilon(0.01));
  CHECK(ambient_irradiance(stage.context, 1, QuadTree(patches), {}) == Color(0));
}
