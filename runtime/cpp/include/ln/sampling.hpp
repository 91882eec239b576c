#pragma once
// Random numbers: Owen-scrambled Sobol points, addressed by what they are for.
//
// A stream belongs to one pixel (or one particle tracer) and one sample of it. Nothing is drawn in sequence: a number is
// asked for by its dimension, so that a dimension keeps its meaning whatever else was computed, and pictures depend
// neither on threads nor on tiles.

#include "ln/math.hpp"

namespace ln {

/// A well-mixed 32-bit hash (Wellons' lowbias32).
constexpr std::uint32_t hash32(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x21f0aaadu;
  x ^= x >> 15;
  x *= 0xd35a2d97u;
  x ^= x >> 15;
  return x;
}
constexpr std::uint32_t hash32(std::uint32_t a, std::uint32_t b) { return hash32(a * 0x9e3779b9u + hash32(b)); }

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

/// Owen scrambling of a bit-reversed number: each bit is flipped depending on the lower ones (Vegdahl's improved constants
/// of the Laine-Karras hash; Burley 2020, "Practical Hash-based Owen Scrambling").
constexpr std::uint32_t owen_hash(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// The second Sobol coordinate of point `i`, bit-reversed: i times Pascal's triangle modulo 2.
constexpr std::uint32_t sobol_second_reversed(std::uint32_t i) {
  i ^= (i >> 16);
  i ^= (i & 0xff00ff00u) >> 8;
  i ^= (i & 0xf0f0f0f0u) >> 4;
  i ^= (i & 0xccccccccu) >> 2;
  i ^= (i & 0xaaaaaaaau) >> 1;
  return i;
}

/// [0, 1) from the 24 upper bits.
constexpr float to_unit_float(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

/// The random numbers of one sample.
class SampleStream {
 public:
  SampleStream() = default;
  /// `key`: hash of the pixel and the seed. `index`: number of the sample; the first 2^k are well distributed for every k.
  SampleStream(std::uint32_t key, std::uint32_t index) : key_(key), index_(index) {}

  /// A point of the unit square for dimension `d`; point `j` of `n` where a sample draws several.
  Vec2 get2(std::uint32_t d, std::uint32_t j = 0, std::uint32_t n = 1) const {
    const std::uint32_t seed = hash32(key_, d);
    const std::uint32_t shuffled = reverse_bits(owen_hash(reverse_bits(index_ * n + j), seed));
    const std::uint32_t x = reverse_bits(owen_hash(shuffled, seed * 0x9e3779b9u + 0x68bc21ebu));
    const std::uint32_t y = reverse_bits(owen_hash(sobol_second_reversed(shuffled), seed * 0x85ebca6bu + 0x02e5be93u));
    return {to_unit_float(x), to_unit_float(y)};
  }

  float get1(std::uint32_t d, std::uint32_t j = 0, std::uint32_t n = 1) const {
    const std::uint32_t seed = hash32(key_, d);
    const std::uint32_t shuffled = reverse_bits(owen_hash(reverse_bits(index_ * n + j), seed));
    return to_unit_float(reverse_bits(owen_hash(shuffled, seed * 0x9e3779b9u + 0x68bc21ebu)));
  }

  /// A number that need not be well distributed, only different: coverage decisions.
  std::uint32_t bits(std::uint32_t d) const { return hash32(hash32(key_, d), index_); }

  std::uint32_t index() const { return index_; }

 private:
  std::uint32_t key_ = 0, index_ = 0;
};

}  // namespace ln
