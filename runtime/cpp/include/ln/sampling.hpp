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

/// Point `index` of dimension `d` of the stream with this key.
constexpr Vec2 sobol_point(std::uint32_t key, std::uint32_t d, std::uint32_t index) {
  const std::uint32_t seed = hash32(key, d);
  const std::uint32_t shuffled = reverse_bits(owen_hash(reverse_bits(index), seed));
  const std::uint32_t x = reverse_bits(owen_hash(shuffled, seed * 0x9e3779b9u + 0x68bc21ebu));
  const std::uint32_t y = reverse_bits(owen_hash(sobol_second_reversed(shuffled), seed * 0x85ebca6bu + 0x02e5be93u));
  return {to_unit_float(x), to_unit_float(y)};
}

/// Points of consecutive samples of one stream, computed together with vector instructions when the first is asked for:
/// the same numbers as sobol_point's at a fraction of the cost. One a thread.
class SampleBlock {
 public:
  static constexpr std::uint32_t kSamples = 16;
  static constexpr std::uint32_t kVertices = 8, kOwnDimensions = 16;  // the first ones, of a path and of each vertex
  static constexpr std::uint32_t kDimensions = kVertices * kOwnDimensions;

  /// Serves samples [first, first + kSamples) of the stream with this key from now on.
  void begin(std::uint32_t key, std::uint32_t first) {
    key_ = key;
    first_ = first;
    filled_[0] = filled_[1] = 0;
  }

  /// `slot` < kDimensions: place of dimension `d` in the block.
  LN_INLINE Vec2 point(std::uint32_t slot, std::uint32_t d, std::uint32_t index) {
    if (!(filled_[slot / 64] >> (slot % 64) & 1)) fill(slot, d);
    return {x_[slot][index - first_], y_[slot][index - first_]};
  }

 private:
  LN_NOINLINE void fill(std::uint32_t slot, std::uint32_t d) {
    filled_[slot / 64] |= std::uint64_t{1} << (slot % 64);
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const Vec2 p = sobol_point(key_, d, first_ + i);
      x_[slot][i] = p.x;
      y_[slot][i] = p.y;
    }
  }

  std::uint32_t key_ = 0, first_ = 0;
  std::uint64_t filled_[kDimensions / 64] = {};
  alignas(64) float x_[kDimensions][kSamples];
  alignas(64) float y_[kDimensions][kSamples];
};

/// Dimensions of the random numbers that belong to one vertex of a path. `kOwn` and above are the operators' own.
enum Dimension : std::uint32_t { kBsdfDirection, kBsdfLobe, kRoulette, kCoverage, kOwn = 8, kPerVertex = 64 };

/// The random numbers of one sample.
class SampleStream {
 public:
  SampleStream() = default;
  /// `key`: hash of the pixel and the seed. `index`: number of the sample; the first 2^k are well distributed for every k.
  /// `block`: optional; must serve this key and index.
  SampleStream(std::uint32_t key, std::uint32_t index, SampleBlock* block = nullptr)
      : key_(key), index_(index), block_(block) {}

  /// A point of the unit square: dimension `own` of vertex `vertex` of the path.
  LN_INLINE Vec2 get2(std::uint32_t vertex, std::uint32_t own) const {
    if (block_ && vertex < SampleBlock::kVertices && own < SampleBlock::kOwnDimensions)
      return block_->point(vertex * SampleBlock::kOwnDimensions + own, vertex * kPerVertex + own, index_);
    return scalar_point(vertex * kPerVertex + own);
  }
  /// Point `j` of the `n` that each sample draws.
  LN_INLINE Vec2 get2(std::uint32_t vertex, std::uint32_t own, std::uint32_t j, std::uint32_t n) const {
    return n == 1 ? get2(vertex, own) : sobol_point(key_, vertex * kPerVertex + own, index_ * n + j);
  }

  /// The same by the dimension's number, vertex * kPerVertex + own.
  Vec2 get2(std::uint32_t d) const { return get2(d / kPerVertex, d % kPerVertex); }
  Vec2 get2(std::uint32_t d, std::uint32_t j, std::uint32_t n) const { return get2(d / kPerVertex, d % kPerVertex, j, n); }
  float get1(std::uint32_t d) const { return get2(d).x; }
  float get1(std::uint32_t d, std::uint32_t j, std::uint32_t n) const { return get2(d, j, n).x; }

  LN_INLINE float get1(std::uint32_t vertex, std::uint32_t own) const { return get2(vertex, own).x; }
  LN_INLINE float get1(std::uint32_t vertex, std::uint32_t own, std::uint32_t j, std::uint32_t n) const {
    return get2(vertex, own, j, n).x;
  }

  /// A number that differs from any other of the stream, to be hashed where it is used: coverage decisions.
  std::uint32_t bits(std::uint32_t d) const { return bits(d / kPerVertex, d % kPerVertex); }
  std::uint32_t bits(std::uint32_t vertex, std::uint32_t own) const {
    return key_ + (vertex * kPerVertex + own) * 0x9e3779b9u + index_ * 0x85ebca6bu;
  }

  /// The stream of branch `j` of the `n` that a path splits into at `vertex`: branches are as well distributed among each other
  /// as samples are.
  SampleStream branch(std::uint32_t vertex, std::uint32_t j, std::uint32_t n) const {
    return {hash32(key_, vertex), index_ * n + j};
  }

  std::uint32_t index() const { return index_; }

 private:
  LN_NOINLINE Vec2 scalar_point(std::uint32_t d) const { return sobol_point(key_, d, index_); }

  std::uint32_t key_ = 0, index_ = 0;
  SampleBlock* block_ = nullptr;
};

}  // namespace ln
