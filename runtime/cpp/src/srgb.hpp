#pragma once
// Colours for pictures that hold bytes.

#include <algorithm>
#include <cmath>

namespace ln {

/// A linear value in the encoding of IEC 61966-2-1, cut off at 0 and 1.
inline unsigned char srgb_byte(float linear) {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  const float encoded = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
  return static_cast<unsigned char>(encoded * 255 + 0.5f);
}

}  // namespace ln
