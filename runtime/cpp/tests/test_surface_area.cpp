#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/surface_area.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

constexpr float kHeight = 0.01f;  // of the floor

/// A scene's surface around points that face upwards.
struct Measured {
  explicit Measured(const SceneData& data) : stage(data), area(stage.context, stage.scene.data()) {}

  SurfaceCoverage at(const Vec3& point, float radius, PhotonKernel kernel = PhotonKernel::parabola) const {
    SurfaceCoverage coverage;
    area.measure({point, {0, 1, 0}, true}, radius, kernel, coverage);
    return coverage;
  }

  Stage stage;
  SurfaceArea area;
};

/// Integral of a kernel over a disc of radius 1.
double disc(PhotonKernel kernel) {
  const auto pi = static_cast<double>(kPi);
  return kernel == PhotonKernel::constant ? pi : kernel == PhotonKernel::cone ? pi / 3 : pi / 2;
}

constexpr PhotonKernel kKernels[] = {PhotonKernel::constant, PhotonKernel::cone, PhotonKernel::parabola};

}  // namespace

TEST_CASE("a floor in few pieces or many: a disc in the middle, half of it at the border, a quarter in the corner") {
  // At radius 0.3, sides are from 5 down to 0.02 radii.
  for (const int pieces : {1, 7, 20, 40, 60, 100, 250}) {
    CAPTURE(pieces);
    SceneBuilder b;
    add_floor(b, pieces);
    const Measured m(b.data);
    constexpr float kRadius = 0.3f;
    for (const PhotonKernel kernel : kKernels) {
      CAPTURE(static_cast<int>(kernel));
      const double whole = disc(kernel) * static_cast<double>(sqr(kRadius));
      const double tolerance = kernel == PhotonKernel::constant ? 0.003 : 0.001;
      const auto share = [&](float x, float z) {
        const SurfaceCoverage coverage = m.at({x, kHeight, z}, kRadius, kernel);
        CHECK_EQ(coverage.radius, kRadius);
        return static_cast<double>(coverage.area) / whole;
      };
      for (const float x : {0.0f, 0.013f, -0.107f, 0.21f}) CHECK(share(x, 0.05f) == doctest::Approx(1).epsilon(tolerance));
      CHECK(share(-0.7f, 0.05f) == doctest::Approx(0.5).epsilon(tolerance));
      CHECK(share(0.7f, -0.7f) == doctest::Approx(0.25).epsilon(tolerance));
    }
    const SurfaceMoments middle = m.at({0.013f, kHeight, 0.05f}, kRadius).moments;
    for (const float zero : {middle.x, middle.y, middle.xy}) CHECK(std::abs(zero) < 0.002f);
    for (const float second : {middle.xx, middle.yy}) CHECK(second == doctest::Approx(kPi / 12).epsilon(0.01));
  }
}

TEST_CASE("what lies on each other counts once, in few pieces or many") {
  for (const auto& [first, second] : {std::pair{1, 1}, std::pair{1, 90}, std::pair{90, 90}, std::pair{90, 61}}) {
    CAPTURE(first);
    CAPTURE(second);
    SceneBuilder b;
    add_floor(b, first);
    add_floor(b, second);
    const Measured m(b.data);
    for (const PhotonKernel kernel : kKernels) {
      const SurfaceCoverage coverage = m.at({0.013f, kHeight, 0.05f}, 0.3f, kernel);
      const double r = static_cast<double>(coverage.radius);  // less, where there are too many triangles for one by one
      CHECK(static_cast<double>(coverage.area) == doctest::Approx(disc(kernel) * r * r).epsilon(0.02));
    }
  }
}

TEST_CASE("a surface a step above or below does not count") {
  for (const int pieces : {1, 90}) {
    CAPTURE(pieces);
    SceneBuilder b;
    add_floor(b, pieces);
    b.quad({0, 0.06f, 0.7f}, {0.7f, 0.06f, 0.7f}, {0.7f, 0.06f, -0.7f}, {0, 0.06f, -0.7f}, b.material(Color(0.5f)), pieces);
    const Measured m(b.data);
    for (const PhotonKernel kernel : kKernels) {
      CAPTURE(static_cast<int>(kernel));
      const double whole = disc(kernel) * 0.09;
      CHECK(m.at({0.05f, kHeight, 0.05f}, 0.3f, kernel).area == doctest::Approx(whole).epsilon(0.005));
      CHECK(m.at({0, 0.06f, 0.05f}, 0.3f, kernel).area == doctest::Approx(0.5 * whole).epsilon(0.005));
    }
  }
}

TEST_CASE("a wall hides the half behind it, on a floor in few pieces or many") {
  for (const int pieces : {1, 90}) {
    CAPTURE(pieces);
    SceneBuilder b;
    add_floor(b, pieces);
    add_thin_wall(b);
    const Measured m(b.data);
    for (const PhotonKernel kernel : kKernels)
      CHECK(m.at({0.002f, kHeight, 0.05f}, 0.3f, kernel).area == doctest::Approx(0.5 * disc(kernel) * 0.09).epsilon(0.015));
  }
}

TEST_CASE("a cap of a sphere in many triangles: what is within the ball and bends by less than the normals may") {
  // Points at the angle t from the pole are 2 R sin(t / 2) away.
  constexpr double kSphere = 0.8, kRadius = 0.3;
  const double last = 2 * std::asin(kRadius / (2 * kSphere));
  for (const int pieces : {100, 400}) {
    CAPTURE(pieces);
    SceneBuilder b;
    b.sphere(Vec3(0), static_cast<float>(kSphere), b.material(Color(0.5f)), false, pieces);
    const Measured m(b.data);
    for (const PhotonKernel kernel : kKernels) {
      CAPTURE(static_cast<int>(kernel));
      double truth = 0;
      constexpr int kSteps = 1000;
      for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) * last / kSteps, d = 2 * kSphere * std::sin(t / 2) / kRadius;
        const double k = kernel == PhotonKernel::constant ? 1 : kernel == PhotonKernel::cone ? 1 - d : 1 - d * d;
        truth += k * 2 * static_cast<double>(kPi) * kSphere * kSphere * std::sin(t) * last / kSteps;
      }
      for (const Vec3& n : {Vec3(0, 1, 0), glm::normalize(Vec3(1, 2, -1)), glm::normalize(Vec3(-3, 1, 0.5f))}) {
        SurfaceCoverage coverage;
        m.area.measure({static_cast<float>(kSphere) * n, n, true}, static_cast<float>(kRadius), kernel, coverage);
        CHECK(coverage.area == doctest::Approx(truth).epsilon(0.01));
      }
    }
  }
}
