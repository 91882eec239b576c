#include "ln/render_passes.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "ln/progress.hpp"
#include "ln/stats.hpp"

namespace ln {

namespace {

constexpr double kLongestPass = 10;            // [s]
constexpr double kPatience = 1;                // after an interrupt, for the end of a pass [s]
constexpr std::uint32_t kSamplesToTrust = 16;  // before an estimate of the error may end the render
constexpr double kStandardErrors = 2;

/// Even bits of `code`.
std::uint32_t compact_bits(std::uint32_t code) {
  code &= 0x55555555;
  code = (code | code >> 1) & 0x33333333;
  code = (code | code >> 2) & 0x0f0f0f0f;
  code = (code | code >> 4) & 0x00ff00ff;
  return (code | code >> 8) & 0x0000ffff;
}

/// Tiles in Z-order, so that neighbours in time are neighbours in the picture; small enough to keep all workers busy.
std::vector<Tile> make_tiles(int width, int height, int workers) {
  int side = 16;
  const auto count = [&] { return static_cast<long>((width + side - 1) / side) * ((height + side - 1) / side); };
  while (side > 4 && count() < 32L * workers) side /= 2;
  const int columns = (width + side - 1) / side, rows = (height + side - 1) / side;
  std::vector<Tile> tiles;
  tiles.reserve(static_cast<std::size_t>(count()));
  // Z-order within squares of 2^k tiles along the longer side, so that long pictures do not walk through empty codes.
  constexpr int kSquare = 16;
  for (int row0 = 0; row0 < rows; row0 += kSquare) {
    for (int column0 = 0; column0 < columns; column0 += kSquare) {
      for (std::uint32_t code = 0; code < kSquare * kSquare; ++code) {
        const int column = column0 + static_cast<int>(compact_bits(code)),
                  row = row0 + static_cast<int>(compact_bits(code >> 1));
        if (column >= columns || row >= rows) continue;
        Tile tile;
        tile.x0 = column * side;
        tile.y0 = row * side;
        tile.x1 = std::min(width, tile.x0 + side);
        tile.y1 = std::min(height, tile.y0 + side);
        tiles.push_back(tile);
      }
    }
  }
  return tiles;
}

/// One walk over all tiles.
class Pass final : public PassControl {
 public:
  Pass(const std::vector<Tile>& tiles, std::uint32_t first_sample, std::uint32_t sample_count)
      : tiles_(tiles), first_sample_(first_sample), sample_count_(sample_count) {}

  /// After an interrupt: goes on if the end is near, and for a second at most.
  bool stopped() const override {
    if (stop_.load(std::memory_order_relaxed)) return true;
    if (!interrupt_requested()) return false;
    const double now = wall_seconds();
    double seen = -1;
    if (!interrupt_seen_.compare_exchange_strong(seen, now)) return give_up(now - seen > kPatience);
    const double done = fraction();
    return give_up(!(done > 0) || watch_.seconds() * (1 - done) / done > kPatience);
  }

  /// Returns false if the pass was given up.
  bool run(Film& film, Workers& workers, FunctionRef<void(const Tile&, Film&)> render_tile, FunctionRef<void(double)> report) {
    workers.run([&](int worker) {
      try {
        work(worker, film, render_tile, report);
      } catch (...) {
        stop_ = true;
        throw;
      }
    });
    return !stop_;
  }

  double seconds() const { return watch_.seconds(); }

 private:
  double fraction() const {
    return static_cast<double>(tiles_done_.load(std::memory_order_relaxed)) / static_cast<double>(tiles_.size());
  }

  bool give_up(bool give_up) const {
    if (give_up) stop_.store(true, std::memory_order_relaxed);
    return give_up;
  }

  void work(int worker, Film& film, FunctionRef<void(const Tile&, Film&)> render_tile, FunctionRef<void(double)> report) {
    while (!stopped()) {
      const std::size_t index = next_tile_.fetch_add(1, std::memory_order_relaxed);
      if (index >= tiles_.size()) return;
      Tile tile = tiles_[index];
      tile.first_sample = first_sample_;
      tile.sample_count = sample_count_;
      tile.worker = worker;
      tile.control = this;
      render_tile(tile, film);
      tiles_done_.fetch_add(1, std::memory_order_relaxed);
      if (worker == 0) report(fraction());
    }
  }

  const std::vector<Tile>& tiles_;
  std::uint32_t first_sample_, sample_count_;
  Stopwatch watch_;
  std::atomic<std::size_t> next_tile_{0}, tiles_done_{0};
  mutable std::atomic<bool> stop_{false};
  mutable std::atomic<double> interrupt_seen_{-1};
};

/// Chooses the passes. It never influences what a sample is worth, only how many are taken.
class PassPlan {
 public:
  explicit PassPlan(const RenderLimits& limits, double longest_pass) : limits_(limits), longest_pass_(longest_pass) {}

  std::uint32_t samples() const { return samples_; }
  double elapsed() const { return watch_.seconds(); }

  /// Samples of the next pass, 0 at the end.
  std::uint32_t next() const {
    if (samples_ == 0) return 1;
    if (error_reached()) return 0;
    double count = limits_.error ? growth_by_error() : samples_;
    if (limits_.samples) count = std::min(count, static_cast<double>(*limits_.samples) - samples_);
    if (limits_.seconds) {
      // Half of what fits, so that a wrong forecast can be mended by the passes after it.
      const double fitting = (*limits_.seconds - elapsed()) / seconds_per_sample_;
      if (fitting < 1) return 0;
      count = std::min(count, std::max(fitting * 0.5, 1.0));
    }
    if (count < 1) return 0;
    count = std::min(count, std::max(longest_pass_ / seconds_per_sample_, 1.0));
    constexpr double kMost = 1 << 30;
    return static_cast<std::uint32_t>(std::min(count, kMost - samples_));
  }

  void finished(std::uint32_t count, double seconds, const Film& film) {
    samples_ += count;
    seconds_per_sample_ = std::max(seconds / count, 1e-9);
    if (limits_.error) estimate_ = film.estimate_error();
  }

  /// Part of the way to the nearest limit, with `part` of a pass of `count` samples done; -1: unknown.
  double fraction(std::uint32_t count, double part) const {
    const double samples = samples_ + count * part;
    double fraction = -1;
    if (limits_.samples) fraction = samples / *limits_.samples;
    if (limits_.seconds) fraction = std::max(fraction, elapsed() / std::max(*limits_.seconds, 1e-9));
    if (limits_.error && samples_ >= 2) fraction = std::max(fraction, samples / samples_for_error());
    return std::min(fraction, 1.0);
  }

  std::optional<double> present_error() const { return limits_.error ? std::optional(estimate_.rel_mse) : std::nullopt; }
  const ErrorEstimate& estimate() const { return estimate_; }

 private:
  double upper_bound() const { return estimate_.rel_mse + kStandardErrors * estimate_.standard_error; }
  bool error_reached() const { return limits_.error && samples_ >= kSamplesToTrust && upper_bound() <= *limits_.error; }

  /// If the error falls as 1 / samples.
  double samples_for_error() const {
    const double bound = upper_bound();
    return std::isfinite(bound) ? std::max<double>(samples_ * bound / *limits_.error, kSamplesToTrust) : kInfinity;
  }

  /// Up to 1.5 or 2 times a power of two, but not far beyond what is expected to do.
  double growth_by_error() const {
    std::uint32_t power = std::bit_floor(samples_);
    const std::uint32_t half_way = samples_ < kSamplesToTrust ? power : power + power / 2;
    const std::uint32_t target = samples_ < half_way ? half_way : 2 * power;
    const double grown = static_cast<double>(target) - samples_;
    const double expected = std::ceil(1.02 * samples_for_error()) - samples_;
    return std::clamp(expected, std::min(grown, std::max(1.0, samples_ / 16.0)), grown);
  }

  RenderLimits limits_;
  double longest_pass_;
  Stopwatch watch_;
  std::uint32_t samples_ = 0;
  double seconds_per_sample_ = 1e-9;
  ErrorEstimate estimate_;
};

}  // namespace

RenderOutcome render_passes(Film& film, const RenderLimits& limits, Workers& workers, Progress& progress,
                            FunctionRef<void(const Tile&, Film&)> render_tile,
                            const std::function<void(const Film&)>& between_passes, double pause) {
  const std::vector<Tile> tiles = make_tiles(film.width(), film.height(), workers.count());
  PassPlan plan(limits, between_passes ? std::min(pause, kLongestPass) : kLongestPass);
  Stopwatch since_pause;
  RenderOutcome outcome;
  while (const std::uint32_t count = plan.next()) {
    if (interrupt_requested()) {
      outcome.interrupted = true;
      break;
    }
    Pass pass(tiles, plan.samples(), count);
    const bool complete = pass.run(film, workers, render_tile, [&](double part) {
      if (progress.due()) progress.update({plan.fraction(count, part), plan.samples(), plan.present_error()});
    });
    if (!complete) {
      outcome.interrupted = true;
      break;
    }
    plan.finished(count, pass.seconds(), film);
    if (between_passes && since_pause.seconds() >= pause) {
      between_passes(film);
      since_pause = Stopwatch();
    }
  }
  const Film::Range range = film.sample_range();
  outcome.samples = range.least;
  outcome.most_samples = range.most;
  outcome.seconds = plan.elapsed();
  if (limits.error) outcome.error = plan.estimate();
  return outcome;
}

}  // namespace ln
