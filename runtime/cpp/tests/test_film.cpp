#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "ln/error.hpp"
#include "ln/film.hpp"
#include "ln/interrupt.hpp"
#include "ln/progress.hpp"
#include "ln/render_passes.hpp"
#include "ln/stats.hpp"

namespace {

using namespace ln;

std::uint32_t hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

/// In [0, 1).
float noise(int x, int y, std::uint32_t sample) {
  return static_cast<float>(hash(hash(hash(static_cast<std::uint32_t>(x)) + static_cast<std::uint32_t>(y)) + sample) >> 8) *
         0x1p-24f;
}

/// Mean 1, variance of a sample 1/3 in each channel.
void render_noise(const Tile& tile, Film& film) {
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      if (tile.stopped()) return;
      for (std::uint32_t i = 0; i < tile.sample_count; ++i) {
        const std::uint32_t sample = tile.first_sample + i;
        film.add(x, y, sample,
                 Color(2 * noise(x, y, 3 * sample), 2 * noise(x, y, 3 * sample + 1), 2 * noise(x, y, 3 * sample + 2)));
        if (film.layer_count() > 0) film.add_layer(0, x, y, Color(noise(x, y, sample)));
      }
    }
  }
}

std::vector<float> pixels(const Film& film) {
  std::vector<float> values;
  for (int layer = Film::kPicture; layer < film.layer_count(); ++layer) {
    for (int y = 0; y < film.height(); ++y) {
      for (int x = 0; x < film.width(); ++x) {
        const Color c = film.mean(x, y, layer);
        values.insert(values.end(), {c.x, c.y, c.z});
      }
    }
  }
  return values;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

struct Rendered {
  std::unique_ptr<Film> film;
  RenderOutcome outcome;
};

template <class TileFunction>
Rendered render(int width, int height, const RenderLimits& limits, int threads, TileFunction&& tile_function, int layers = 0) {
  Rendered result{std::make_unique<Film>(width, height, layers), {}};
  Workers workers(threads);
  Progress progress(ProgressMode::none);
  result.outcome = render_passes(*result.film, limits, workers, progress, tile_function);
  return result;
}

TEST_CASE("means, counts and layers") {
  Film film(5, 3, 2);
  CHECK(film.mean(4, 2) == Color(0));
  film.add(4, 2, 0, Color(1, 2, 3));
  film.add_layer(1, 4, 2, Color(6));
  film.add(4, 2, 1, Color(2, 4, 6));
  CHECK(film.mean(4, 2) == Color(1.5f, 3, 4.5f));
  CHECK(film.mean(4, 2, 0) == Color(0));
  CHECK(film.mean(4, 2, 1) == Color(3));
  CHECK(film.samples(4, 2) == 2);
  CHECK(film.sample_range().least == 0);
  CHECK(film.sample_range().most == 2);
}

TEST_CASE("values that no picture may hold are repaired and counted") {
  Film film(1, 1, 1);
  film.add(0, 0, 0, Color(NAN, 1, 1));
  film.add(0, 0, 1, Color(1, kInfinity, -2));
  film.add(0, 0, 2, Color(-0.0f, 0, 0));
  film.add(0, 0, 3, Color(3));
  CHECK(film.mean(0, 0) == Color(1));
  CHECK(film.non_finite_samples() == 2);
  CHECK(film.negative_samples() == 1);
  film.add_layer(0, 0, 0, Color(-kInfinity));
  CHECK(film.non_finite_samples() == 3);
  CHECK(film.mean(0, 0, 0) == Color(0));
}

TEST_CASE("samples of differences keep their sign, means do not") {
  Film film(2, 1, 0, Film::Samples::signed_values);
  for (std::uint32_t i = 0; i < 4; ++i) {
    film.add(0, 0, i, Color(i % 2 == 0 ? 3.0f : -1.0f));
    film.add(1, 0, i, Color(i % 2 == 0 ? 1.0f : -3.0f));
  }
  CHECK(film.mean(0, 0) == Color(1));
  CHECK(film.mean(1, 0) == Color(0));
  CHECK(film.negative_samples() == 0);
  CHECK(std::isfinite(film.estimate_error().rel_mse));
}

TEST_CASE("radiances from 1e-38 to the largest float keep their digits") {
  for (const float value : {1e-38f, 1e-30f, 1e-6f, 1.0f, 1e30f, std::numeric_limits<float>::max()}) {
    Film film(1, 1);
    for (std::uint32_t i = 0; i < 1000; ++i) film.add(0, 0, i, Color(value));
    CHECK(film.mean(0, 0).x == doctest::Approx(value).epsilon(1e-6));
    CHECK(std::isfinite(film.mean(0, 0).x));
  }
}

TEST_CASE("halves of the samples are balanced wherever a pass may end") {
  int count[2] = {0, 0};
  for (std::uint32_t i = 0; i < 4096; ++i) {
    ++count[film_half(i)];
    const std::uint32_t n = i + 1;
    if (n < 4) continue;
    CHECK(std::abs(count[0] - count[1]) <= static_cast<int>(n / 4) + 1);
    const std::uint32_t power = std::bit_floor(n);
    if (n == power || (n >= 8 && 2 * n == 3 * power)) CHECK(count[0] == count[1]);
  }
}

TEST_CASE("a picture has the same bits with any number of threads, and whatever passes led to it") {
  const Rendered expected = render(37, 23, {.samples = 37, .seconds = {}, .error = {}}, 1, render_noise, 1);
  CHECK(expected.outcome.samples == 37);
  CHECK(expected.outcome.most_samples == 37);
  for (const int threads : {2, 3, 5, 16}) {
    const Rendered other = render(37, 23, {.samples = 37, .seconds = {}, .error = {}}, threads, render_noise, 1);
    CHECK(same_bits(pixels(*expected.film), pixels(*other.film)));
  }
  // One pixel after the other, in one go.
  Film film(37, 23, 1);
  for (int y = 22; y >= 0; --y) {
    for (int x = 36; x >= 0; --x) {
      Tile tile;
      tile.x0 = x, tile.x1 = x + 1, tile.y0 = y, tile.y1 = y + 1;
      tile.sample_count = 37;
      render_noise(tile, film);
    }
  }
  CHECK(same_bits(pixels(*expected.film), pixels(film)));
}

TEST_CASE("a limit of time gives the picture of its sample count") {
  const auto slow = [](const Tile& tile, Film& film) {
    render_noise(tile, film);
    std::this_thread::sleep_for(std::chrono::microseconds(20 * tile.sample_count));
  };
  const Rendered timed = render(64, 48, {.samples = {}, .seconds = 0.3, .error = {}}, 2, slow, 1);
  CHECK(timed.outcome.samples > 1);
  CHECK(timed.outcome.samples == timed.outcome.most_samples);
  CHECK(timed.outcome.seconds < 0.6);
  const Rendered counted = render(64, 48, {.samples = timed.outcome.samples, .seconds = {}, .error = {}}, 3, render_noise, 1);
  CHECK(same_bits(pixels(*timed.film), pixels(*counted.film)));
}

TEST_CASE("every pixel gets a sample even if there is no time left") {
  const Rendered rendered = render(20, 10, {.samples = {}, .seconds = -1, .error = {}}, 2, render_noise);
  CHECK(rendered.outcome.samples == 1);
}

TEST_CASE("the first limit reached ends the render") {
  CHECK(render(20, 10, {.samples = 5, .seconds = 100, .error = 1e-9}, 2, render_noise).outcome.samples == 5);
  CHECK(render(64, 64, {.samples = 100'000'000, .seconds = 100, .error = 0.1}, 2, render_noise).outcome.samples <= 32);
}

/// relMSE of the noise picture against its true mean, 1.
double true_error(const Film& film) {
  double sum = 0;
  for (const float value : pixels(film)) sum += (value - 1) * (value - 1) / 1.01;
  return sum / static_cast<double>(3 * film.width() * film.height());
}

TEST_CASE("the estimate of the error agrees with the truth") {
  for (const std::uint32_t samples : {16u, 24u, 37u, 64u, 100u}) {
    const Rendered rendered = render(160, 100, {.samples = samples, .seconds = {}, .error = {}}, 2, render_noise);
    const ErrorEstimate estimate = rendered.film->estimate_error();
    const double truth = true_error(*rendered.film);
    CHECK(truth == doctest::Approx(1.0 / 3 / samples / 1.01).epsilon(0.05));
    // Never below by more than its noise; above by the convexity that film.cpp speaks of.
    CHECK(estimate.rel_mse > truth - 4 * estimate.standard_error);
    CHECK(estimate.rel_mse < 1.2 * truth + 4 * estimate.standard_error);
  }
}

TEST_CASE("a render with a limit of error keeps its promise without much waste") {
  for (const double limit : {0.02, 0.005, 0.001}) {
    const Rendered rendered = render(80, 50, {.samples = {}, .seconds = {}, .error = limit}, 2, render_noise);
    const double truth = true_error(*rendered.film);
    CHECK(truth < limit);
    CHECK(truth > 0.6 * limit);
    REQUIRE(rendered.outcome.error);
    CHECK(rendered.outcome.error->rel_mse <= limit);
  }
}

TEST_CASE("rare bright samples make the estimate grow, not vanish") {
  // One sample in 50 is 50, the others are 0: mean 1, variance 49.
  const auto spikes = [](const Tile& tile, Film& film) {
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        for (std::uint32_t i = tile.first_sample; i < tile.first_sample + tile.sample_count; ++i) {
          film.add(x, y, i, Color(noise(x, y, i) < 0.02f ? 50.0f : 0.0f));
        }
      }
    }
  };
  const Rendered rendered = render(80, 50, {.samples = {}, .seconds = {}, .error = 0.5}, 2, spikes);
  CHECK(rendered.outcome.samples >= 49 / 0.5 * 0.9);
}

TEST_CASE("an interrupt ends a long pass soon, and every pixel is the mean of its own samples") {
  install_interrupt_handlers();
  std::atomic<int> tiles{0};
  const auto constant = [&](const Tile& tile, Film& film) {
    if (++tiles == 500) std::raise(SIGINT);
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        if (tile.stopped()) return;
        for (std::uint32_t i = 0; i < tile.sample_count; ++i) film.add(x, y, tile.first_sample + i, Color(1));
      }
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  };
  const Stopwatch watch;
  const Rendered rendered = render(200, 120, {.samples = 1'000'000, .seconds = {}, .error = {}}, 2, constant);
  detail::interrupt_signal = 0;
  CHECK(rendered.outcome.interrupted);
  CHECK(rendered.outcome.samples >= 1);
  CHECK(rendered.outcome.most_samples < 1'000'000);
  CHECK(watch.seconds() < 5);
  for (const float value : pixels(*rendered.film)) REQUIRE(value == 1);
}

TEST_CASE("an exception in a tile comes out") {
  const auto broken = [](const Tile& tile, Film&) {
    if (tile.x0 > 0) throw Error("no");
  };
  CHECK_THROWS_AS(render(100, 100, {.samples = 4, .seconds = {}, .error = {}}, 3, broken), Error);
}

TEST_CASE("a picture that does not fit into memory is refused before anything is allocated") {
  const Stopwatch watch;
  CHECK_THROWS_AS(Film(1 << 20, 1 << 20, 10), Error);
  CHECK(watch.seconds() < 1);
}

}  // namespace
