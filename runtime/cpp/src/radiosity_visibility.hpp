#pragma once
// How much two things of radiosity see of each other, by rays between points of them.
//
// Few rays are cast. Each ends at points that are picked from several times as many by what they exchange: near things count
// more, and see more of each other; what is bright sees other things than what lies in the same shadow.

#include <algorithm>

#include "ln/math.hpp"
#include "ln/sampling.hpp"
#include "radiosity_hierarchy.hpp"

namespace ln::radiosity {

inline constexpr std::uint32_t kMostRays = 16;
/// Number of rays for a link that carries `importance` times what it may err, if one that carries just that gets
/// `rays_of_error`.
inline std::uint32_t rays_of(float importance, float rays_of_error) {
  return static_cast<std::uint32_t>(std::clamp(rays_of_error * importance, 1.0f, static_cast<float>(kMostRays)));
}

/// What points that are picked by area exchange, up to a factor: `way` goes from the receiver, of the normal `n`, to the
/// source. `softening` is a squared distance: nearer ones do not exchange much more.
inline float exchange(const Vec3& way, const Vec3& n, const Vec3& source_n, float softening) {
  const float facing = glm::dot(way, n), source_facing = -glm::dot(way, source_n), distance2 = glm::dot(way, way);
  return facing > 0 && source_facing > 0 ? facing * source_facing / (distance2 * (distance2 + softening)) : 0.0f;
}
/// The same of points on the source that are picked by their directions, with this density [1/sr].
inline float exchange_by_direction(const Vec3& way, const Vec3& n, const Vec3& source_n, float density) {
  const float facing = glm::dot(way, n);
  return facing > 0 && glm::dot(way, source_n) < 0 && density > 0 ? facing / (glm::length(way) * density) : 0.0f;
}
/// For a cluster of this radius: points of it that are very near would drown all others.
inline float softening_of(float radius) { return 0.25f * sqr(radius); }

/// Candidates for rays, numbered from 0.
class Candidates {
 public:
  static constexpr std::uint32_t kMost = 4 * kMostRays;

  /// `wanted`: number of candidates, `most`: if none exchange anything until then; at most kMost count.
  Candidates(std::uint32_t rays, std::uint32_t wanted, std::uint32_t most)
      : rays_(rays), wanted_(std::min(wanted, kMost)), most_(std::clamp(most, wanted_, kMost)) {}

  std::uint32_t count() const { return count_; }
  bool enough() const { return count_ >= (sum_ > 0 ? wanted_ : most_); }
  void add(float exchanged) { up_to_[count_++] = sum_ += exchanged; }

  /// Share of the rays for which `visible`(candidate).
  template <class Visible>
  float visible_share(Visible&& visible) const {
    if (!(sum_ > 0)) return 0;
    std::uint32_t seen = 0, last = kMost;
    bool last_seen = false;
    for (std::uint32_t j = 0; j < rays_; ++j) {
      const float target = sum_ * (static_cast<float>(j) + 0.5f) / static_cast<float>(rays_);
      const auto above = static_cast<std::uint32_t>(std::upper_bound(up_to_, up_to_ + count_, target) - up_to_);
      const std::uint32_t i = std::min(above, count_ - 1);
      if (i != last) last_seen = visible(i);
      last = i;
      seen += last_seen ? 1 : 0;
    }
    return static_cast<float>(seen) / static_cast<float>(rays_);
  }

 private:
  std::uint32_t rays_, wanted_, most_, count_ = 0;
  float up_to_[kMost];  // sums of what they exchange
  float sum_ = 0;
};

/// Random numbers for a point of each of two things.
struct PairOfPoints {
  Vec2 pick, u, v;
};
/// Evenly distributed pairs: the additive recurrence of Roberts 2018, "The Unreasonable Effectiveness of Quasirandom
/// Sequences", in six dimensions, shifted at random. Costs a fraction of Sobol points, and few are looked at.
class PairSequence {
 public:
  explicit PairSequence(std::uint32_t key) {
    for (std::uint32_t k = 0; k < 6; ++k) shift_[k] = hash32(key, k);
  }

  PairOfPoints operator[](std::uint32_t i) const {
    // 2^32 / g^k with g^7 = g + 1, so that products are their own fractional parts.
    constexpr std::uint32_t kStep[6] = {0xe60e2b72u, 0xcebd76d9u, 0xb9c9aa3au, 0xa6f5777fu, 0x9609c71eu, 0x86d516e5u};
    float x[6];
    for (std::uint32_t k = 0; k < 6; ++k) x[k] = to_unit_float(shift_[k] + i * kStep[k]);
    return {{x[0], x[1]}, {x[2], x[3]}, {x[4], x[5]}};
  }

 private:
  std::uint32_t shift_[6];
};

}  // namespace ln::radiosity
