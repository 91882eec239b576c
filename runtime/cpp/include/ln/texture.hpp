#pragma once
// Looking up textures: sampling as glTF's samplers say it, without mip levels.

#include <array>
#include <cmath>
#include <cstddef>

#include "ln/scene_data.hpp"

namespace ln {

/// IEC 61966-2-1, from an encoded value in [0, 1] to a linear one.
inline float srgb_to_linear(float x) { return x <= 0.04045f ? x * (1 / 12.92f) : std::pow((x + 0.055f) * (1 / 1.055f), 2.4f); }

/// Linear values of the 256 codes: of sRGB-encoded ones in [1], of plain fractions in [0].
inline const auto kByteToLinear = [] {
  std::array<std::array<float, 256>, 2> table{};
  for (std::size_t i = 0; i < 256; ++i) {
    table[0][i] = static_cast<float>(i) / 255.0f;
    table[1][i] = srgb_to_linear(table[0][i]);
  }
  return table;
}();

/// Texel (x, y) as linear RGBA; what the image does not have is filled up: grey counts for red, green and blue, alpha is 1.
inline Vec4 texel(const Image& image, int x, int y) {
  const std::size_t first =
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)) *
      static_cast<std::size_t>(image.channels);
  const auto rgba = [&](auto color, auto alpha) -> Vec4 {
    switch (image.channels) {
      case 1: return Vec4(Vec3(color(0)), 1);
      case 2: return Vec4(Vec3(color(0)), alpha(1));
      case 3: return {color(0), color(1), color(2), 1};
      default: return {color(0), color(1), color(2), alpha(3)};
    }
  };
  if (image.floats.empty()) {
    const std::uint8_t* bytes = image.bytes.data() + first;
    const auto& color_table = kByteToLinear[image.srgb ? 1 : 0];
    return rgba([&](int c) { return color_table[bytes[c]]; }, [&](int c) { return kByteToLinear[0][bytes[c]]; });
  }
  const float* floats = image.floats.data() + first;
  const auto plain = [&](int c) { return floats[c]; };
  return rgba(plain, plain);
}

/// A coordinate brought into one period of its wrap mode: [0, 1], or [0, 2] for mirrored ones. What is no number becomes 0.
inline float wrap_coordinate(float u, Wrap wrap) {
  const float period = wrap == Wrap::mirror ? 2.0f : 1.0f;
  const float wrapped = wrap == Wrap::clamp ? std::clamp(u, 0.0f, 1.0f) : u - period * std::floor(u / period);
  return wrapped >= 0 && wrapped <= period ? wrapped : 0.0f;
}

/// The texel that index `i` in [-1, size], or in [-1, 2 size] for mirrored ones, stands for.
inline int wrap_texel(int i, int size, Wrap wrap) {
  switch (wrap) {
    case Wrap::repeat: return i < 0 ? i + size : i >= size ? i - size : i;
    case Wrap::clamp: return std::clamp(i, 0, size - 1);
    case Wrap::mirror: break;
  }
  const int there = i < 0 ? -1 - i : i;
  const int back = there < size ? there : 2 * size - 1 - there;
  return back < 0 ? -1 - back : back;
}

/// Texture coordinates after KHR_texture_transform.
inline Vec2 transform_uv(const TextureRef& ref, const Vec2& uv) {
  return {ref.row0.x * uv.x + ref.row0.y * uv.y + ref.row0.z, ref.row1.x * uv.x + ref.row1.y * uv.y + ref.row1.z};
}

/// The linear RGBA value of a texture at mesh coordinates `uv`: nearest texel or bilinear.
inline Vec4 lookup(const Image& image, const TextureRef& ref, const Vec2& uv) {
  const Vec2 at = transform_uv(ref, uv);
  const float x = wrap_coordinate(at.x, ref.wrap_s) * static_cast<float>(image.width);
  const float y = wrap_coordinate(at.y, ref.wrap_t) * static_cast<float>(image.height);
  if (ref.nearest) {
    return texel(image, wrap_texel(static_cast<int>(x), image.width, ref.wrap_s),
                 wrap_texel(static_cast<int>(y), image.height, ref.wrap_t));
  }
  const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
  const float s = x - 0.5f - left, t = y - 0.5f - top;
  const int x0 = wrap_texel(static_cast<int>(left), image.width, ref.wrap_s),
            x1 = wrap_texel(static_cast<int>(left) + 1, image.width, ref.wrap_s);
  const int y0 = wrap_texel(static_cast<int>(top), image.height, ref.wrap_t),
            y1 = wrap_texel(static_cast<int>(top) + 1, image.height, ref.wrap_t);
  return (texel(image, x0, y0) * (1 - s) + texel(image, x1, y0) * s) * (1 - t) +
         (texel(image, x0, y1) * (1 - s) + texel(image, x1, y1) * s) * t;
}

/// Bounds of the linear RGBA values of all texels, and so of all lookups.
struct ColorRange {
  Vec4 low{kInfinity}, high{-kInfinity};
};

inline ColorRange color_range(const Image& image) {
  ColorRange range;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Vec4 value = texel(image, x, y);
      for (std::size_t c = 0; c < 4; ++c) {
        range.low[c] = std::min(range.low[c], value[c]);
        range.high[c] = std::max(range.high[c], value[c]);
      }
    }
  }
  return range;
}

}  // namespace ln
