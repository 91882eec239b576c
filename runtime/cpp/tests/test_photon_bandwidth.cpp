#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/photon_bandwidth.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// Photons on a floor at y = 0.01, |x|, |z| < 0.7, whose irradiance is E(x): as many fall on each of the strips as its light
/// says.
struct Floor {
  explicit Floor(const std::function<double(double)>& E, double photons_per_light) : stage(floor()) {
    constexpr int kStrips = 2000;
    const double step = 1.4 / kStrips;
    const SampleStream random(23, 0);
    double owed = 0;
    std::uint32_t n = 0;
    for (int i = 0; i < kStrips; ++i) {
      const double x = (i + 0.5) * step - 0.7;
      for (owed += E(x) * step * 1.4 * photons_per_light; owed >= 1; --owed, ++n) {
        const Vec2 u(random.get1(0, n, 1u << 20), random.get1(1, n, 1u << 20));
        Photon photon;
        photon.position = {static_cast<float>(x + (static_cast<double>(u.x) - 0.5) * step), 0.01f, 1.4f * u.y - 0.7f};
        photon.normal = PackedNormal({0, 1, 0}, true);
        photon.flux = PackedColor(Color(static_cast<float>(1 / photons_per_light)));
        photons.push_back(photon);
      }
    }
    map = PhotonMap(stage.context, photons);
    area = SurfaceArea(stage.context, stage.scene.data());
    kernels = kernel_range(stage.context, map, 20, 800, 0);
  }

  static SceneData floor() {
    SceneBuilder b;
    add_floor(b);
    return b.data;
  }

  LocalEstimate at(float x, float z) const {
    return adaptive_local_linear(map, area, {{x, 0.01f, z}, {0, 1, 0}, true}, kernels);
  }

  /// Mean and its standard error at places with this x that are farther from each other than kernels are wide.
  std::pair<double, double> along(float x) const {
    constexpr int kPoints = 30;
    double sum = 0, sum2 = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double E = static_cast<double>(at(x, (static_cast<float>(i) + 0.5f) * (1.4f / kPoints) - 0.7f).E.x);
      sum += E;
      sum2 += E * E;
    }
    const double mean = sum / kPoints;
    return {mean, std::sqrt((sum2 / kPoints - mean * mean) / (kPoints - 1))};
  }

  Stage stage;
  std::vector<Photon> photons;
  PhotonMap map;
  SurfaceArea area;
  KernelRange kernels;
};

}  // namespace

TEST_CASE("linear light comes out as it is up to borders, from wide kernels") {
  const auto E = [](double x) { return 3 + 2 * x / 0.7; };
  const Floor floor(E, 60'000);
  for (const float x : {-0.7f, -0.699f, -0.69f, -0.35f, 0.0f, 0.35f, 0.69f, 0.699f, 0.7f}) {
    CAPTURE(x);
    const auto [mean, error] = floor.along(x);
    const double truth = E(static_cast<double>(x));
    // Next to a border, at a hundredth of the radius, the surface is measured less well.
    const double bias = std::abs(std::abs(x) - 0.699f) < 1e-6f ? 0.02 * truth : 0;
    CHECK(std::abs(mean - truth) < bias + 4 * error);
    CHECK(error < 0.015 * truth);
  }
  int wide = 0;
  for (int i = 0; i < 100; ++i) {
    const auto share = static_cast<float>(i) / 100;
    wide +=
        floor.at(share - 0.5f, 0.5f - share).sigma < 0.06f * static_cast<float>(E(static_cast<double>(share) - 0.5)) ? 1 : 0;
  }
  CHECK(wide > 80);  // 800 photons: 4 %; 20: 26 %
}

TEST_CASE("an edge is as sharp as the narrowest kernels, not the widest") {
  const auto E = [](double x) { return x < 0 ? 1.0 : 4.0; };
  const Floor floor(E, 60'000);
  // Radii of kernels with 20 and 800 photons, on the darker side: 0.010 and 0.065.
  for (const float x : {-0.2f, -0.03f, 0.03f, 0.2f}) {
    CAPTURE(x);
    const auto [mean, error] = floor.along(x);
    CHECK(mean == doctest::Approx(E(static_cast<double>(x))).epsilon(0.06));
  }
}

TEST_CASE("the estimated standard error is that of the estimates") {
  const Floor floor([](double) { return 2.0; }, 60'000);
  double sum = 0, sum2 = 0, variance = 0;
  constexpr int kPoints = 400;
  for (int i = 0; i < kPoints; ++i) {
    const float x = static_cast<float>(i % 20) * 0.06f - 0.57f, z = static_cast<float>(i / 20) * 0.06f - 0.57f;
    NearPhoton found[PhotonMap::capacity(200)];
    const Neighbourhood around{{x, 0.01f, z}, {0, 1, 0}, true};
    const std::size_t n = floor.map.nearest(around, 1, 200, found);
    REQUIRE_EQ(n, 200);
    const LocalEstimate e = local_linear(floor.map, {found, n - 1}, floor.area, around, std::sqrt(found[n - 1].distance2));
    sum += static_cast<double>(e.E.x);
    sum2 += static_cast<double>(e.E.x * e.E.x);
    variance += static_cast<double>(e.sigma * e.sigma);
  }
  const double mean = sum / kPoints;
  CHECK(variance / kPoints == doctest::Approx(sum2 / kPoints - mean * mean).epsilon(4 * std::sqrt(2.0 / kPoints)));
}

TEST_CASE("the gradient of an estimate is that of linear light, at borders, too") {
  const Floor floor([](double x) { return 3 + 2 * x / 0.7; }, 200'000);
  constexpr float kRadius = 0.2f;
  for (const float x : {-0.7f, -0.3f, 0.0f, 0.65f}) {
    CAPTURE(x);
    DVec3 sum(0), sum2(0);
    constexpr int kPoints = 7;
    for (int i = 0; i < kPoints; ++i) {
      const Neighbourhood around{{x, 0.01f, 0.2f * static_cast<float>(i) - 0.6f}, {0, 1, 0}, true};
      std::vector<NearPhoton> found;
      floor.map.within(around, sqr(kRadius), [&](const NearPhoton& photon) { found.push_back(photon); });
      const DVec3 gradient(local_linear(floor.map, found, floor.area, around, kRadius).gradient);
      sum += gradient;
      sum2 += gradient * gradient;
    }
    const DVec3 mean = sum / double(kPoints), error = glm::sqrt((sum2 / double(kPoints) - mean * mean) / double(kPoints - 1));
    const double measuring = 0.01 * 2 / 0.7;  // of what a border leaves of the surface
    CHECK(std::abs(mean.x - 2 / 0.7) < measuring + 4 * error.x);
    CHECK(error.x < 0.1);
    CHECK(mean.y == 0);
    CHECK(std::abs(mean.z) < 4 * error.z);
    CHECK(error.z < 0.1);
  }
}

TEST_CASE("without photons it is dark; few photons do no harm") {
  for (const double photons_per_light : {0.0, 1.0, 10.0, 30.0}) {
    const Floor floor([](double) { return 2.0; }, photons_per_light);
    const LocalEstimate e = floor.map.empty() ? LocalEstimate{} : floor.at(0.1f, 0.2f);
    CHECK(is_finite(e.E));
    CHECK(min_component(e.E) >= 0);
    if (floor.map.empty()) CHECK(e.E == Color(0));
  }
}
