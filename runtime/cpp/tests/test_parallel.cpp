#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "ln/error.hpp"
#include "ln/interrupt.hpp"
#include "ln/parallel.hpp"

namespace {

using namespace ln;

constexpr int kThreadCounts[] = {1, 2, 3, 5, 16};

TEST_CASE("every index is visited once") {
  for (const int threads : kThreadCounts) {
    Workers workers(threads);
    CHECK(workers.count() == threads);
    for (const std::size_t n : {0u, 1u, 7u, 1000u, 4096u}) {
      for (const std::size_t grain : {1u, 3u, 64u, 10000u}) {
        std::vector<int> visits(n, 0);
        workers.parallel_for(n, grain, [&](std::size_t i) { ++visits[i]; });
        CHECK(visits == std::vector<int>(n, 1));
      }
    }
  }
}

TEST_CASE("worker indices are within bounds and not shared") {
  Workers workers(4);
  std::atomic<int> inside[4] = {};
  workers.for_chunks(10000, 1, [&](std::size_t, std::size_t, int worker) {
    REQUIRE(worker >= 0);
    REQUIRE(worker < 4);
    REQUIRE(inside[worker]++ == 0);
    --inside[worker];
  });
  std::atomic<int> runs{0};
  workers.run([&](int) { ++runs; });
  CHECK(runs == 4);
}

TEST_CASE("sums of floats have the same bits with any number of threads") {
  const auto sum = [](int threads) {
    Workers workers(threads);
    return workers.reduce(
        100'003, 97, 0.0f,
        [](std::size_t begin, std::size_t end) {
          float part = 0;
          for (std::size_t i = begin; i < end; ++i) part += 1.0f / static_cast<float>(i + 1);
          return part;
        },
        [](float a, float b) { return a + b; });
  };
  const float expected = sum(1);
  CHECK(expected == doctest::Approx(12.09).epsilon(0.01));
  for (const int threads : kThreadCounts) CHECK(sum(threads) == expected);
}

TEST_CASE("the exception of the lowest chunk comes out, and the pool lives on") {
  for (const int threads : kThreadCounts) {
    Workers workers(threads);
    for (int repeat = 0; repeat < 20; ++repeat) {
      std::string message;
      try {
        workers.parallel_for(1000, 1, [](std::size_t i) {
          if (i >= 137) throw std::runtime_error(std::to_string(i));
        });
      } catch (const std::runtime_error& error) {
        message = error.what();
      }
      CHECK(message == "137");
    }
    std::atomic<int> count{0};
    workers.parallel_for(100, 1, [&](std::size_t) { ++count; });
    CHECK(count == 100);
  }
}

TEST_CASE("loops inside loops run on the worker that meets them") {
  Workers workers(3);
  std::vector<std::uint64_t> sums(50);
  workers.for_chunks(50, 1, [&](std::size_t i, std::size_t, int outer) {
    workers.for_chunks(100, 7, [&](std::size_t begin, std::size_t end, int inner) {
      REQUIRE(inner == outer);
      for (std::size_t k = begin; k < end; ++k) sums[i] += k;
    });
  });
  CHECK(std::accumulate(sums.begin(), sums.end(), std::uint64_t{0}) == 50 * 4950);
}

TEST_CASE("an interrupt ends a loop") {
  install_interrupt_handlers();
  Workers workers(2);
  std::atomic<int> count{0};
  CHECK_THROWS_AS(workers.parallel_for(100'000, 1,
                                       [&](std::size_t i) {
                                         if (i == 10) std::raise(SIGTERM);
                                         ++count;
                                       }),
                  Interrupted);
  CHECK(count < 100'000);
  CHECK(interrupt_requested());
  detail::interrupt_signal = 0;
  CHECK_NOTHROW(workers.parallel_for(10, 1, [](std::size_t) {}));
}

}  // namespace
