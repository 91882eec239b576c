#pragma once
// Eight numbers at once, in one register where the processor has such.

#include <cstdint>

namespace ln {

inline constexpr std::uint32_t kLanes = 8;

using Lanes = float __attribute__((vector_size(4 * kLanes)));
using LaneMask = std::int32_t __attribute__((vector_size(4 * kLanes)));

inline Lanes load(const float* values) {
  Lanes lanes;
  __builtin_memcpy(&lanes, values, sizeof lanes);
  return lanes;
}

/// Bit i: is lane i of the mask set?
inline unsigned lane_bits(const LaneMask& mask) {
#if defined(__AVX__)
  return static_cast<unsigned>(__builtin_ia32_movmskps256(__builtin_bit_cast(Lanes, mask)));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < kLanes; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
#endif
}

/// Sum of all lanes, always in the same order.
inline float sum(const Lanes& lanes) {
  float total = 0;
  for (std::uint32_t i = 0; i < kLanes; ++i) total += lanes[i];
  return total;
}

}  // namespace ln
