#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "test_emitters_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

Image make_image(int width, int height, const Color& fill) {
  Image image;
  image.width = width, image.height = height, image.channels = 3;
  for (int i = 0; i < width * height; ++i) image.floats.insert(image.floats.end(), {fill.x, fill.y, fill.z});
  return image;
}
void set(Image& image, int x, int y, const Color& c) {
  for (int i = 0; i < 3; ++i) image.floats[static_cast<std::size_t>((y * image.width + x) * 3 + i)] = c[i];
}
/// A direction by its place in the picture, in pixels.
Vec3 direction_at(const Image& image, float x, float y) {
  const float theta = kPi * y / static_cast<float>(image.height), phi = 2 * kPi * (0.5f - x / static_cast<float>(image.width));
  return {std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi)};
}

Image gradient(int width, int height) {
  Image image = make_image(width, height, Color(0));
  Random random(3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      set(image, x, y, Color(random(), 2 * random(), 3 * random()) * (y < height / 2 ? 1.0f : 0.1f));
  return image;
}

}  // namespace

TEST_CASE("the same radiance everywhere gives the irradiance pi L, exactly on reflectors") {
  const SceneData scene;
  for (const int size : {1, 4}) {
    const Image image = make_image(2 * size, size, Color(1, 2, 3));
    const Emitters emitters(scene, &image);
    CHECK(emitters.has_area());
    CHECK(!emitters.has_delta());
    CHECK(emitters.size() == 1);
    Random random(2);
    for (int i = 0; i < 100; ++i) {
      const Vec3 n = random.direction();
      const LightSample s = emitters.sample(receiver({}, n), n, random(), random.square());
      const Color e = s.radiance * (glm::dot(n, s.wi) / s.pdf_w);
      CHECK(e.y == doctest::Approx(2 * kPi).epsilon(1e-4));
      CHECK(emitters.environment_pdf_w(receiver({}, n), n, s.wi) == doctest::Approx(s.pdf_w).epsilon(1e-4));
      CHECK(!std::isfinite(s.distance));
      CHECK(emitters.environment(s.wi) == Color(1, 2, 3));
      // From any side: uniform.
      CHECK(emitters.sample(receiver({}, n), Vec3(0), random(), random.square()).pdf_w == doctest::Approx(0.25f * kInvPi));
    }
  }
}

TEST_CASE("orientation: y up, +z in the centre, +x a quarter left of it") {
  Image image = make_image(8, 4, Color(0));
  const auto bright = [&](const Vec3& w) { return Environment(image).radiance(glm::normalize(w)).x; };
  for (int x = 0; x < 8; ++x) set(image, x, 0, Color(1));
  CHECK(bright({0, 1, 0}) == 1);
  CHECK(bright({0, -1, 0}) == 0);
  image = make_image(8, 4, Color(0));
  for (int y = 0; y < 4; ++y) set(image, 3, y, Color(1)), set(image, 4, y, Color(1));
  CHECK(bright({0, 0, 1}) == 1);
  CHECK(bright({0, 0, -1}) == 0);
  image = make_image(8, 4, Color(0));
  for (int y = 0; y < 4; ++y) set(image, 1, y, Color(1)), set(image, 2, y, Color(1));
  CHECK(bright({1, 0, 0}) == 1);
  CHECK(bright({-1, 0, 0}) == 0);
}

TEST_CASE("samples follow the density, which covers all light and integrates to one") {
  for (const auto& [width, height] : {std::pair(5, 3), std::pair(16, 8), std::pair(1, 2), std::pair(37, 21)}) {
    CAPTURE(width);
    const Image image = gradient(width, height);
    const Environment env(image);
    constexpr int kX = 32, kY = 16, kSub = 24;
    std::vector<double> expected(kX * kY), observed(kX * kY);
    double integral = 0;
    int uncovered = 0, wrong = 0;
    constexpr int kCount = 200000;
    for (int y = 0; y < kY * kSub; ++y) {
      for (int x = 0; x < kX * kSub; ++x) {
        const double theta = kPi * (y + 0.5) / (kY * kSub),
                     cell = 2 * kPi / (kX * kSub) * (kPi / (kY * kSub)) * std::sin(theta);
        const double phi = 2 * kPi * (x + 0.5) / (kX * kSub);
        const Vec3 w(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
        const double p = static_cast<double>(env.pdf_w(w)) * cell;
        integral += p;
        expected[static_cast<std::size_t>(y / kSub * kX + x / kSub)] += p * kCount;
        uncovered += !is_black(env.radiance(w)) && !(p > 0) ? 1 : 0;
      }
    }
    CHECK(uncovered == 0);
    CHECK(integral == doctest::Approx(1).epsilon(2e-3));
    Random random(4);
    glm::dvec3 sum(0);
    for (int i = 0; i < kCount; ++i) {
      const Environment::Sample s = env.sample(random.square());
      wrong += std::abs(glm::length(s.w) - 1) < 1e-5f ? 0 : 1;
      double phi = std::atan2(s.w.x, s.w.z);
      if (phi < 0) phi += 2 * kPi;
      const int x = std::min(static_cast<int>(phi / (2 * kPi) * kX), kX - 1);
      const int y = std::min(static_cast<int>(std::acos(std::clamp(s.w.y, -1.0f, 1.0f)) / kPi * kY), kY - 1);
      observed[static_cast<std::size_t>(y * kX + x)] += 1;
      if (i < 20000) CHECK(env.pdf_w(s.w) == doctest::Approx(s.pdf_w).epsilon(1e-3).scale(1));
      sum += glm::dvec3(env.radiance(s.w)) / static_cast<double>(s.pdf_w);
    }
    // The other pictures' pixels are not made up of the test's cells, whose integrals then have an error.
    if (width == 16) CHECK(chi_square_accepts(observed, expected));
    CHECK(wrong == 0);
    const Color mean(sum / (4.0 * kPi * kCount));
    CHECK(mean.x == doctest::Approx(env.mean().x).epsilon(5e-3));
    CHECK(mean.z == doctest::Approx(env.mean().z).epsilon(5e-3));
  }
}

TEST_CASE("the mean radiance is that of the interpolated picture") {
  const Image image = gradient(6, 3);
  const Environment env(image);
  glm::dvec3 sum(0);
  constexpr int kX = 1200, kY = 600;
  for (int y = 0; y < kY; ++y) {
    for (int x = 0; x < kX; ++x) {
      const Vec3 w = direction_at(image, 6 * (static_cast<float>(x) + 0.5f) / kX, 3 * (static_cast<float>(y) + 0.5f) / kY);
      const double theta = kPi * (y + 0.5) / kY;
      sum += glm::dvec3(env.radiance(w)) * std::sin(theta);
    }
  }
  sum *= 2 * kPi / kX * kPi / kY / (4 * kPi);
  for (int i = 0; i < 3; ++i) CHECK(env.mean()[i] == doctest::Approx(sum[i]).epsilon(1e-3));
}

TEST_CASE("one bright pixel: irradiance, and no noise to speak of") {
  Image image = make_image(256, 128, Color(0.01f));
  set(image, 100, 20, Color(1e4f, 2e4f, 3e4f));
  const SceneData scene;
  const Emitters emitters(scene, &image);
  const Vec3 n(0, 1, 0);
  // Reference: midpoint rule around the pixel, plus the rest.
  glm::dvec3 e(0);
  constexpr int kSub = 64;
  for (int y = 0; y < 3 * kSub; ++y) {
    for (int x = 0; x < 3 * kSub; ++x) {
      const float px = 99 + (static_cast<float>(x) + 0.5f) / kSub, py = 19 + (static_cast<float>(y) + 0.5f) / kSub;
      const double theta = kPi * static_cast<double>(py) / 128;
      const Vec3 w = direction_at(image, px, py);
      e += glm::dvec3(emitters.environment(w) - Color(0.01f)) * static_cast<double>(w.y) * std::sin(theta) *
           (2.0 * kPi / 256 / kSub) * (1.0 * kPi / 128 / kSub);
    }
  }
  e += glm::dvec3(0.01 * kPi);
  const Color estimate = irradiance(emitters, {}, n, 256, 5);
  for (int i = 0; i < 3; ++i) CHECK(estimate[i] == doctest::Approx(e[i]).epsilon(2e-3));
}

TEST_CASE("pixels that are no light: negative, infinite, NaN; grey and 8-bit pictures") {
  Image image = make_image(4, 2, Color(1));
  set(image, 0, 0, Color(std::nanf(""), -1, kInfinity));
  const Environment env(image);
  Random random(8);
  for (int i = 0; i < 1000; ++i) {
    const Environment::Sample s = env.sample(random.square());
    CHECK(is_finite(env.radiance(s.w)));
    CHECK(min_component(env.radiance(s.w)) >= 0);
    CHECK(s.pdf_w > 0);
  }
  CHECK(is_finite(env.mean()));

  Image black = make_image(4, 2, Color(0));
  const SceneData scene;
  CHECK(Emitters(scene, &black).empty());

  Image grey;
  grey.width = 2, grey.height = 1, grey.channels = 1;
  grey.bytes = {255, 255};
  grey.srgb = true;
  CHECK(Environment(grey).radiance({0, 1, 0}) == Color(1));
}

TEST_CASE("environment beside surfaces: shares of the choice add up, pdfs agree with samples") {
  SceneOfLights scene;
  scene.add_quad({-0.2f, -0.2f, 0.9f}, {0, 0.4f, 0}, {0.4f, 0, 0}, Color(20));
  scene.add_directional({0, -1, -1}, Color(2));
  const Image image = gradient(8, 4);
  const Emitters emitters(scene.data, &image);
  CHECK(emitters.size() == 3);
  const Vec3 n(0, 0, 1);
  const SurfacePosition at = receiver({0.1f, 0, -0.5f});
  Random random(9);
  int found[3] = {};
  double expected_environment = 0;
  for (int i = 0; i < 20000; ++i) {
    const LightSample s = emitters.sample(at, n, random(), random.square());
    CHECK(s.pdf_w > 0);
    if (s.delta) {
      ++found[0];
    } else if (std::isfinite(s.distance)) {
      ++found[1];
      CHECK(emitters.pdf_w(at, n, Hit{s.distance, 0, 0.3f, 0.3f}, s.wi) == doctest::Approx(s.pdf_w).epsilon(1e-5));
    } else {
      ++found[2];
      CHECK(emitters.environment_pdf_w(at, n, s.wi) == doctest::Approx(s.pdf_w).epsilon(1e-3));
      expected_environment = static_cast<double>(emitters.environment_pdf_w(at, n, s.wi) / Environment(image).pdf_w(s.wi));
    }
  }
  for (const int count : found) CHECK(count > 1500);
  CHECK(found[2] / 20000.0 == doctest::Approx(expected_environment).epsilon(0.03));
}
