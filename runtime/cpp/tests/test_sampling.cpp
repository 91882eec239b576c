#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <set>
#include <vector>

#include "ln/sampling.hpp"

using namespace ln;

namespace {

/// The Sobol points by their definition: direction numbers of the first two dimensions.
std::uint32_t sobol(int dimension, std::uint32_t index) {
  std::uint32_t result = 0, v = 1u << 31;
  for (int bit = 0; bit < 32; ++bit) {
    if (dimension == 0) v = 1u << (31 - bit);
    if (index >> bit & 1) result ^= v;
    if (dimension == 1) v ^= v >> 1;
  }
  return result;
}

/// Does each elementary interval of area 1/n hold one of the n = 2^m points?
bool is_net(const std::vector<Vec2>& points, int m) {
  for (int i = 0; i <= m; ++i) {
    const int columns = 1 << i, rows = 1 << (m - i);
    std::set<std::pair<int, int>> cells;
    for (const Vec2& p : points)
      if (!cells.emplace(static_cast<int>(p.x * static_cast<float>(columns)), static_cast<int>(p.y * static_cast<float>(rows)))
               .second)
        return false;
  }
  return true;
}

}  // namespace

TEST_CASE("the second Sobol coordinate is Pascal's triangle modulo 2") {
  for (std::uint32_t i = 0; i < 4096; ++i) CHECK(reverse_bits(sobol_second_reversed(i * 1048583u)) == sobol(1, i * 1048583u));
}

TEST_CASE("the samples of a pixel are a (0, m, 2)-net for every power of two, in every dimension") {
  for (const std::uint32_t dimension : {0u, 7u, 64u, 1000u}) {
    for (const std::uint32_t key : {1u, 0xdeadbeefu}) {
      for (int m = 1; m <= 8; ++m) {
        std::vector<Vec2> points;
        for (std::uint32_t i = 0; i < 1u << m; ++i) points.push_back(SampleStream(key, i).get2(dimension));
        CHECK(is_net(points, m));
      }
    }
  }
}

TEST_CASE("several points of one sample continue the sequence") {
  std::vector<Vec2> points;
  for (std::uint32_t i = 0; i < 16; ++i)
    for (std::uint32_t j = 0; j < 4; ++j) points.push_back(SampleStream(5, i).get2(3, j, 4));
  CHECK(is_net(points, 6));
}

TEST_CASE("numbers lie in [0, 1) and pixels are independent of each other") {
  // Correlation of the first sample between neighbouring keys, over many keys: standard error 1/sqrt(n).
  const int n = 100'000;
  double sum = 0, sum_squares = 0, products = 0;
  float previous = SampleStream(hash32(0, 7), 0).get1(4);
  for (std::uint32_t key = 1; key <= static_cast<std::uint32_t>(n); ++key) {
    const float x = SampleStream(hash32(key, 7), 0).get1(4);
    CHECK_UNARY(x >= 0 && x < 1);
    sum += x;
    sum_squares += x * x;
    products += (x - 0.5) * (previous - 0.5);
    previous = x;
  }
  const double standard_error = 1 / std::sqrt(12.0 * n);
  CHECK(std::abs(sum / n - 0.5) < 4 * standard_error);
  CHECK(std::abs(sum_squares / n - 1.0 / 3) < 4 * std::sqrt(4.0 / 45 / n));
  CHECK(std::abs(products / n * 12) < 4 / std::sqrt(static_cast<double>(n)));
}

TEST_CASE("dimensions of one pixel are not correlated") {
  const int n = 1 << 14;
  for (const auto& [a, b] : {std::pair{0u, 1u}, {8u, 9u}, {8u, 72u}}) {
    double products = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const SampleStream s(12345, i);
      products += (s.get2(a).x - 0.5) * (s.get2(b).x - 0.5);
    }
    CHECK(std::abs(products / n * 12) < 4 / std::sqrt(static_cast<double>(n)));
  }
}

TEST_CASE("a block gives the same bits as the points one by one") {
  SampleBlock block;
  for (const std::uint32_t first : {0u, 48u, 1'000'000u / 16 * 16}) {
    block.begin(77, first);
    for (const std::uint32_t d : {0u, 8u, 15u, 16u, 7u * kPerVertex + 15u, 8u * kPerVertex, 100u * kPerVertex}) {
      for (std::uint32_t i = first; i < first + SampleBlock::kSamples; ++i) {
        const Vec2 expected = SampleStream(77, i).get2(d), found = SampleStream(77, i, &block).get2(d);
        CHECK(found.x == expected.x);
        CHECK(found.y == expected.y);
      }
    }
  }
}
