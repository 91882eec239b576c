#pragma once
// Independent random numbers, drawn in sequence: for what must be plain and have honest standard errors. Pictures use
// sampling.hpp, which converges faster.

#include "ln/sampling.hpp"

namespace ln {

/// splitmix64 (Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number Generators").
class Random {
 public:
  /// Sequences of different keys and numbers are independent.
  Random(std::uint32_t key, std::uint64_t number)
      : state_((std::uint64_t{hash32(key, static_cast<std::uint32_t>(number >> 32))} << 32 |
                hash32(key ^ 0x9e3779b9u, static_cast<std::uint32_t>(number)))) {}

  std::uint32_t bits() {
    std::uint64_t x = state_ += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return static_cast<std::uint32_t>((x ^ (x >> 31)) >> 32);
  }
  float get1() { return to_unit_float(bits()); }
  Vec2 get2() {
    const float x = get1();
    return {x, get1()};
  }

 private:
  std::uint64_t state_;
};

}  // namespace ln
