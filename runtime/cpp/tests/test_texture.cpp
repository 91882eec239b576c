#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <random>

#include "ln/texture.hpp"

namespace {

using namespace ln;

Image random_image(int width, int height, int channels, bool floats, bool srgb, std::uint32_t seed) {
  std::mt19937 random(seed);
  Image image{width, height, channels, srgb, {}, {}};
  for (int i = 0; i < width * height * channels; ++i) {
    if (floats) {
      image.floats.push_back(static_cast<float>(random() % 1000) / 100);
    } else {
      image.bytes.push_back(static_cast<std::uint8_t>(random() % 256));
    }
  }
  return image;
}

// ---------------------------------------------------------------- a reference, slow and in double

double reference_channel(const Image& image, int x, int y, int c) {
  const int channels = image.channels;
  const bool has_alpha = channels == 2 || channels == 4;
  if (c == 3 && !has_alpha) return 1;
  const int source = c == 3 ? channels - 1 : channels < 3 ? 0 : c;
  const auto at = static_cast<std::size_t>((y * image.width + x) * channels + source);
  if (!image.floats.empty()) return static_cast<double>(image.floats[at]);
  const double v = image.bytes[at] / 255.0;
  if (c == 3 || !image.srgb) return v;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

/// OpenGL's definition of wrapping, for any index.
int reference_wrap(long long i, int size, Wrap wrap) {
  const auto modulo = [](long long a, long long b) { return ((a % b) + b) % b; };
  if (wrap == Wrap::clamp) return static_cast<int>(std::clamp<long long>(i, 0, size - 1));
  if (wrap == Wrap::repeat) return static_cast<int>(modulo(i, size));
  const long long k = modulo(i, 2LL * size) - size;
  return static_cast<int>(size - 1 - (k >= 0 ? k : -(1 + k)));
}

double reference_lookup(const Image& image, const TextureRef& ref, double u, double v, int c) {
  const double x = u * image.width, y = v * image.height;
  const auto at = [&](double i, double j) {
    return reference_channel(image, reference_wrap(static_cast<long long>(i), image.width, ref.wrap_s),
                             reference_wrap(static_cast<long long>(j), image.height, ref.wrap_t), c);
  };
  if (ref.nearest) return at(std::floor(x), std::floor(y));
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5), s = x - 0.5 - left, t = y - 0.5 - top;
  return (at(left, top) * (1 - s) + at(left + 1, top) * s) * (1 - t) +
         (at(left, top + 1) * (1 - s) + at(left + 1, top + 1) * s) * t;
}

}  // namespace

TEST_CASE("lookups agree with the definition, for all wrap modes, filters and formats") {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> coordinate(-3.5f, 3.5f);
  for (const Wrap wrap_s : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
    for (const Wrap wrap_t : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
      for (const bool nearest : {false, true}) {
        for (int channels = 1; channels <= 4; ++channels) {
          const Image image = random_image(5, 3, channels, channels % 2 == 0, true, static_cast<std::uint32_t>(channels));
          TextureRef ref;
          ref.image = 0;
          ref.wrap_s = wrap_s;
          ref.wrap_t = wrap_t;
          ref.nearest = nearest;
          for (int i = 0; i < 200; ++i) {
            const Vec2 uv(coordinate(random), coordinate(random));
            // Beside the border between two texels, float and double may choose differently.
            const double to_border = std::abs(std::remainder(static_cast<double>(uv.x) * 5, 1.0)) + 0.0;
            if (nearest && (to_border < 1e-4 || std::abs(std::remainder(static_cast<double>(uv.y) * 3, 1.0)) < 1e-4)) continue;
            const Vec4 value = lookup(image, ref, uv);
            for (int c = 0; c < 4; ++c) {
              CHECK(static_cast<double>(value[static_cast<std::size_t>(c)]) ==
                    doctest::Approx(reference_lookup(image, ref, uv.x, uv.y, c)).epsilon(1e-4));
            }
          }
        }
      }
    }
  }
}

TEST_CASE("sRGB codes are decoded, alpha is not") {
  Image image{1, 1, 4, true, {188, 0, 255, 128}, {}};
  const Vec4 value = texel(image, 0, 0);
  CHECK(value.x == doctest::Approx(0.502886).epsilon(1e-5));
  CHECK(value.y == 0);
  CHECK(value.z == 1);
  CHECK(value.w == doctest::Approx(128 / 255.0));
  image.srgb = false;
  CHECK(texel(image, 0, 0).x == doctest::Approx(188 / 255.0));
}

TEST_CASE("row 0 of an image is at v = 0") {
  const Image image{1, 2, 1, false, {255, 0}, {}};
  TextureRef ref;
  ref.nearest = true;
  CHECK(lookup(image, ref, {0.5f, 0.25f}).x == 1);
  CHECK(lookup(image, ref, {0.5f, 0.75f}).x == 0);
}

TEST_CASE("the texture transform is applied before wrapping") {
  const Image image = random_image(8, 8, 3, false, false, 3);
  TextureRef plain, moved;
  moved.row0 = {2, 0, 0.25f};
  moved.row1 = {0, -1, 1};
  for (const Vec2 uv : {Vec2(0.1f, 0.2f), Vec2(0.7f, 0.9f)}) {
    const Vec4 a = lookup(image, moved, uv), b = lookup(image, plain, {2 * uv.x + 0.25f, 1 - uv.y});
    for (std::size_t c = 0; c < 4; ++c) CHECK(a[c] == doctest::Approx(b[c]).epsilon(1e-4));
  }
}

TEST_CASE("coordinates that are no numbers or huge read some texel") {
  const Image image = random_image(4, 4, 3, false, false, 5);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
    for (const bool nearest : {false, true}) {
      TextureRef ref;
      ref.wrap_s = ref.wrap_t = wrap;
      ref.nearest = nearest;
      for (const float u : {nan, kInfinity, -kInfinity, 3e38f, -3e38f, 1e9f, 1.0f, 2.0f, -1.0f, -1e-9f, -1e-30f}) {
        const Vec4 value = lookup(image, ref, {u, u});
        for (std::size_t c = 0; c < 4; ++c) CHECK((value[c] >= 0 && value[c] <= 1));
      }
    }
  }
}

TEST_CASE("the range of an image bounds its lookups") {
  for (const bool floats : {false, true}) {
    const Image image = random_image(6, 5, 3, floats, true, 11);
    const ColorRange range = color_range(image);
    CHECK(range.low.w == 1);
    CHECK(range.high.w == 1);
    Vec4 low(kInfinity), high(-kInfinity);
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 6; ++x) {
        low = glm::vec4(std::min(low.x, texel(image, x, y).x), 0, 0, 0);
        high = glm::vec4(std::max(high.x, texel(image, x, y).x), 0, 0, 0);
      }
    }
    CHECK(range.low.x == low.x);
    CHECK(range.high.x == high.x);
    const Vec4 value = lookup(image, {}, {0.37f, 0.61f});
    for (std::size_t c = 0; c < 4; ++c) CHECK((value[c] >= range.low[c] && value[c] <= range.high[c]));
  }
}
