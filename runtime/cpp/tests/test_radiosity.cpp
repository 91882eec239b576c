#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/diffuse_surface.hpp"
#include "ln/form_factor.hpp"
#include "ln/radiosity.hpp"
#include "photon_scenes.hpp"
#include "quad_tree_functions.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// Irradiance 1 on the fronts of the patches that `lit` names by their middle.
template <class Lit>
QuadTree light_on(const Stage& stage, Lit&& lit) {
  const auto patches = std::make_shared<const Patches>(stage.scene.data());
  QuadTree in(patches);
  for (std::uint32_t p = 0; p < patches->size(); ++p)
    if (lit(patches->surface(p).center())) in.set(Patches::face(p, true), {{Color(1)}});
  return in;
}
const auto everywhere = [](const Vec3&) { return true; };

struct Range {
  double mean, low, high;
};
/// Irradiance (first channel) over the fronts whose middles `wanted` accepts.
template <class Wanted>
Range irradiance(const QuadTree& tree, Wanted&& wanted) {
  double sum = 0, whole = 0, low = 1e30, high = -1e30;
  for (std::uint32_t p = 0; p < tree.patches().size(); ++p) {
    const SurfaceCell s = tree.patches().surface(p);
    if (!wanted(s.center())) continue;
    if (!tree.lit(2 * p)) low = std::min(low, 0.0);
    tree.for_each_leaf(2 * p, [&](const DomainCell& cell, const Color& value) {
      sum += static_cast<double>(area(surface_cell(s, cell)) * value.x);
      low = std::min(low, static_cast<double>(value.x));
      high = std::max(high, static_cast<double>(value.x));
    });
    whole += static_cast<double>(area(s));
  }
  return {sum / whole, low, high};
}

constexpr int kSpaces = 4;

/// A closed space: a box of whole walls; of `pieces` x `pieces` a wall; a sphere of `rings`; a box with obstacles. Its sides
/// are lit evenly, so all irradiance is rho / (1 - rho).
void check_even_space(int shape, int pieces, int rings, float error) {
  CAPTURE(shape);
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f, 0.8f, 0.1f));
  const Vec3 low(-0.5f, -0.4f, -0.3f), high(0.5f, 0.4f, 0.3f);
  if (shape == 2) {
    b.sphere(Vec3(0), 0.8f, m, true, rings);
  } else {
    b.box(low, high, m, true, shape == 1 ? pieces : 1);
  }
  if (shape == 3) {
    b.box(Vec3(-0.2f, -0.35f, -0.1f), Vec3(0.1f, 0.1f, 0.15f), m, false);
    b.box(Vec3(0.25f, -0.1f, -0.1f), Vec3(0.4f, 0.1f, 0.15f), m, false);
  }
  Stage stage(b.data);
  RadiosityReport report;
  RadiosityOptions options;
  options.error = error;
  const QuadTree out = solve_radiosity(stage.context, 1, light_on(stage, everywhere), options, &report);
  const Range found = irradiance(out, everywhere);
  CHECK(found.mean == doctest::Approx(1).epsilon(0.005));
  CHECK(found.low > 0.97);
  CHECK(found.high < 1.03);
  double whole = 0;
  for (std::uint32_t p = 0; p < out.patches().size(); ++p) whole += static_cast<double>(area(out.patches().surface(p)));
  CHECK(out.flux().y / whole == doctest::Approx(4).epsilon(0.005));
  CHECK(out.flux().z / whole == doctest::Approx(1.0 / 9).epsilon(0.005));
  CHECK(report.residual <= 1e-3);
  CHECK(report.correction < 0.02);
}

/// Links, and rays, of radiosity in a box with walls of 16 times the pieces, over those in the first.
void check_growth(int pieces, float error) {
  std::size_t links[2], rays[2];
  for (int i = 0; i < 2; ++i) {
    SceneBuilder b;
    b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.5f)), true, i == 0 ? pieces : 4 * pieces);
    Stage stage(b.data);
    RadiosityReport report;
    RadiosityOptions options;
    options.error = error;
    const QuadTree out = solve_radiosity(stage.context, 1, light_on(stage, everywhere), options, &report);
    links[i] = report.links;
    rays[i] = stage.context.rays(1, RayKind::shadow);
    CHECK(out.flux().x == doctest::Approx(2 * (0.8 + 0.6 + 0.48)).epsilon(0.01));
  }
  CHECK(links[1] < 40 * links[0]);  // 16 times the surfaces, 256 times the pairs
  CHECK(rays[1] < 40 * rays[0]);
}

/// All flux is reflected again and again: Phi_in rho / (1 - rho), from one lit spot in a closed room with obstacles.
void check_energy(float error) {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.7f));
  b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), m, true, 4);
  b.box(Vec3(-0.2f, -0.35f, -0.1f), Vec3(0.1f, 0.1f, 0.15f), m, false);
  b.box(Vec3(0.25f, -0.1f, -0.1f), Vec3(0.4f, 0.1f, 0.15f), m, false);
  Stage stage(b.data);
  const QuadTree in = light_on(stage, [](const Vec3& c) { return c.x == -0.5f && c.y > 0; });
  RadiosityOptions options;
  options.error = error;
  const QuadTree out = solve_radiosity(stage.context, 1, in, options);
  CHECK(out.flux().x == doctest::Approx(in.flux().x * 0.7 / 0.3).epsilon(0.005));
  CHECK(irradiance(out, [](const Vec3& c) { return c.x == -0.5f; }).low > 0);
}

}  // namespace

TEST_CASE("one reflection between two squares: albedo times the form factor") {
  for (const bool parallel : {true, false}) {
    CAPTURE(parallel);
    SceneBuilder b;
    const float h = 0.5f;
    b.quad({-h, 0, h}, {h, 0, h}, {h, 0, -h}, {-h, 0, -h}, b.material(Color(0.5f, 0.25f, 1)));
    if (parallel) {
      b.quad({-h, 1, h}, {-h, 1, -h}, {h, 1, -h}, {h, 1, h}, b.material(Color(0)));
    } else {
      b.quad({-h, 0, -h}, {h, 0, -h}, {h, 1, -h}, {-h, 1, -h}, b.material(Color(0)));
    }
    // A black receiver cannot use irradiance; a nearly black one can.
    b.data.materials.back().base_color = Color(1e-6f);
    Stage stage(b.data);
    const QuadTree out = solve_radiosity(stage.context, 1, light_on(stage, [](const Vec3& c) { return c.y == 0; }), {});
    const Range found = irradiance(out, [](const Vec3& c) { return c.y > 0; });
    CHECK(found.mean == doctest::Approx(0.5 * (parallel ? 0.199825 : 0.200044)).epsilon(0.005));
    CHECK(irradiance(out, [](const Vec3& c) { return c.y == 0; }).mean < 1e-5);
    CHECK(out.flux().y == doctest::Approx(0.5 * out.flux().x).epsilon(1e-4));
    CHECK(out.flux().z == doctest::Approx(2 * out.flux().x).epsilon(1e-4));
  }
}

TEST_CASE("in a closed space that is lit evenly: rho / (1 - rho), in corners and around obstacles too") {
  for (int shape = 0; shape < kSpaces; ++shape) check_even_space(shape, 4, 6, 0.03f);
}

TEST_CASE("slow: the same of many surfaces, and with small errors" * doctest::skip()) {
  for (int shape = 0; shape < kSpaces; ++shape) check_even_space(shape, 12, 16, 0.01f);
}

TEST_CASE("of surfaces that coincide, rays meet one at each point; what meets a surface at an edge, or stands on it, is none") {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f));
  b.quad({-0.5f, 0, 0.5f}, {0.5f, 0, 0.5f}, {0.5f, 0, -0.5f}, {-0.5f, 0, -0.5f}, m, 1);
  b.quad({-0.5f, 0, 0.5f}, {0.5f, 0, 0.5f}, {0.5f, 0, -0.5f}, {-0.5f, 0, -0.5f}, m, 3);
  const auto doubled = static_cast<std::uint32_t>(b.data.triangles.size());
  b.quad({-0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, -0.5f}, {-0.5f, 0.5f, -0.5f}, m);
  b.box(Vec3(-0.2f, 0.5f, -0.2f), Vec3(0.2f, 0.6f, 0.2f), m, false);
  b.sphere(Vec3(0.8f), 0.02f, m, true, 100);  // triangles of half a thousandth
  Stage stage(b.data);
  const Patches patches(stage.scene.data());
  double share = 0;
  std::size_t hidden = 0;
  stage.context.for_chunks(1, 1, [&](std::size_t, std::size_t, Tracer& tracer) {
    for (std::uint32_t p = 0; p < patches.size(); ++p) {
      const std::uint32_t points = p < 10 ? 2000 : 16;
      for (std::uint32_t i = 0; i < points; ++i) {
        const Hit at = patches.hit(p, patches.domain(p).point(sobol_point(p, 0, i)));
        const bool found = outermost(tracer, 1, at, true, hash32(p, i));
        if (at.triangle < doubled) {
          share += found ? static_cast<double>(area(patches.surface(p)) / static_cast<float>(points)) : 0;
        } else if (!found) {
          ++hidden;
        }
      }
    }
  });
  CHECK(share == doctest::Approx(1).epsilon(0.02));
  CHECK(hidden == 0);
}

TEST_CASE("walls that coincide count once; what is seen of them is lit as if there were one") {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f));
  const Vec3 low(-0.5f, -0.4f, -0.3f), high(0.5f, 0.4f, 0.3f);
  b.box(low, high, m, true, 1);
  b.box(low, high, m, true, 3);
  Stage stage(b.data);
  const Range found = irradiance(solve_radiosity(stage.context, 1, light_on(stage, everywhere), {}), everywhere);
  CHECK(found.mean == doctest::Approx(1).epsilon(0.005));
  CHECK(found.low > 0.97);
  CHECK(found.high < 1.03);
}

TEST_CASE("energy is kept: what arrives is what leaves, from a single lit spot in a closed room with obstacles") {
  check_energy(0.03f);
}

TEST_CASE("most of it is kept where each link may err by all the light") {
  SceneBuilder b;
  b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.7f)));
  Stage stage(b.data);
  const QuadTree in = light_on(stage, [](const Vec3& c) { return c.x == -0.5f; });
  RadiosityOptions options;
  options.error = 1;
  CHECK(solve_radiosity(stage.context, 1, in, options).flux().x == doctest::Approx(in.flux().x * 0.7 / 0.3).epsilon(0.1));
}

TEST_CASE("slow: energy is kept with small errors, too" * doctest::skip()) { check_energy(0.01f); }

TEST_CASE("a wall casts its shadow") {
  SceneBuilder b;
  const std::uint32_t white = b.material(Color(1)), black = b.material(Color(1e-6f));
  b.quad({-0.2f, 0, 0.2f}, {0.2f, 0, 0.2f}, {0.2f, 0, -0.2f}, {-0.2f, 0, -0.2f}, white);              // lit
  b.quad({-0.8f, 0.8f, 0.5f}, {-0.8f, 0.8f, -0.5f}, {0.8f, 0.8f, -0.5f}, {0.8f, 0.8f, 0.5f}, black);  // above
  b.quad({0, 0.4f, 0.5f}, {0.8f, 0.4f, 0.5f}, {0.8f, 0.4f, -0.5f}, {0, 0.4f, -0.5f}, black);          // between, right half
  Stage stage(b.data);
  const QuadTree out = solve_radiosity(stage.context, 1, light_on(stage, [](const Vec3& c) { return c.y == 0; }), {});
  const auto above = [&](float x, float z) {
    const Hit hit = stage.scene.accel().intersect({Vec3(x, 0.79f, z), Vec3(0, 1, 0), kInfinity}, 0);
    return out.irradiance(hit.triangle, hit.u, hit.v, true).x;
  };
  // From a point above, the left half sees all of the lit square; the shadow's penumbra reaches to -0.2 and 0.2.
  const FlatCell source = make_flat_cell(out.patches().surface(0), true);
  for (const float x : {-0.7f, -0.4f, -0.25f})
    CHECK(above(x, 0.1f) == doctest::Approx(point_form_factor({x, 0.8f, 0.1f}, {0, -1, 0}, source)).epsilon(0.01));
  for (const float x : {0.25f, 0.4f, 0.7f}) CHECK(above(x, 0.1f) < 1e-4f);
}

TEST_CASE("the inside of a solid stays dark, and what carries no tag takes no part") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f)));
  const std::uint32_t small = b.material(Color(0.5f));
  b.data.materials[small].name = "small";
  b.box(Vec3(-0.1f), Vec3(0.1f), small, false);
  b.data.materials[0].name = "wall";
  const TagRule rules[] = {{0, "wall", TagRule::Kind::material, "wall"}, {1, "small", TagRule::Kind::material, "small"}};
  Workers workers(2);
  const Scene scene(b.data, rules, 2, nullptr);
  PrepareContext context(scene, workers, 1, 4);
  const auto patches = std::make_shared<const Patches>(scene.data());
  QuadTree in(patches);
  for (std::uint32_t p = 0; p < patches->size(); ++p) in.set(Patches::face(p, true), {{Color(1)}});
  RadiosityOptions options;
  options.error = 0.05f;
  const auto lit = [&](const QuadTree& tree, bool front) {
    int walls = 0, things = 0;
    for (std::uint32_t p = 0; p < patches->size(); ++p)
      if (tree.lit(Patches::face(p, front))) ++(scene.data().parts[patches->part(p)].material == 0 ? walls : things);
    return 100 * walls + things;
  };
  QuadTree out = solve_radiosity(context, 1, in, options);
  CHECK(lit(out, true) == 606);
  CHECK(lit(out, false) == 0);
  options.to = TagSelection::with(0);
  CHECK(lit(solve_radiosity(context, 1, in, options), true) == 600);
  options.to = TagSelection::with(1);
  CHECK(lit(solve_radiosity(context, 1, in, options), true) == 6);
  options.from = TagSelection::with(1);  // the box alone scatters, and sees walls only
  const QuadTree direct = solve_radiosity(context, 1, in, options);
  CHECK(direct.flux().x < 1e-6);
  options.to = TagSelection::with(0);
  CHECK(solve_radiosity(context, 1, in, options).flux().x == doctest::Approx(0.5 * 6 * 0.04).epsilon(0.02));
}

TEST_CASE("the same bits for any number of threads") {
  DVec3 flux[2];
  for (const int threads : {1, 3}) {
    SceneBuilder b;
    b.box(Vec3(-0.5f, -0.4f, -0.3f), Vec3(0.5f, 0.4f, 0.3f), b.material(Color(0.5f)));
    b.box(Vec3(-0.2f, -0.35f, -0.1f), Vec3(0.1f, 0.1f, 0.15f), b.material(Color(0.5f)), false);
    Stage stage(b.data, threads);
    RadiosityOptions options;
    options.error = 0.1f;
    const QuadTree in = light_on(stage, [](const Vec3& c) { return c.y > 0.2f; });
    flux[threads / 2] = solve_radiosity(stage.context, 1, in, options).flux();
  }
  CHECK(flux[0] == flux[1]);
}

TEST_CASE("rays and links grow much more slowly than the square of the number of surfaces") { check_growth(4, 0.2f); }

TEST_CASE("slow: so they do between 400 and 6000 surfaces" * doctest::skip()) { check_growth(8, 0.05f); }
