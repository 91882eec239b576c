#pragma once
// The loop over passes, tiles and threads that fills a film until a limit is reached.

#include <cstdint>
#include <functional>
#include <optional>

#include "ln/film.hpp"
#include "ln/interrupt.hpp"
#include "ln/parallel.hpp"

namespace ln {

class Progress;

/// Decides when a pass is given up.
class PassControl {
 public:
  virtual bool stopped() const = 0;

 protected:
  ~PassControl() = default;
};

/// A rectangle of pixels [x0, x1) x [y0, y1) and the samples of each of its pixels that are wanted.
struct Tile {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  std::uint32_t first_sample = 0, sample_count = 0;
  int worker = 0;  // in [0, Workers::count())
  const PassControl* control = nullptr;

  /// True if the rest of the tile is no longer wanted; ask it once per pixel.
  bool stopped() const { return interrupt_requested() && control && control->stopped(); }
};

struct RenderLimits {
  std::optional<std::uint32_t> samples;  // per pixel
  std::optional<double> seconds;         // of wall time from now
  std::optional<double> error;           // relMSE
};

struct RenderOutcome {
  std::uint32_t samples = 0;       // of the pixel that has least
  std::uint32_t most_samples = 0;  // more than `samples` only after an interrupt
  bool interrupted = false;
  double seconds = 0;
  std::optional<ErrorEstimate> error;  // where a limit asked for it
};

/// Renders passes over the whole picture (1, 1, 2, 4, 8, ... samples, none much longer than 10 s) until a limit is reached:
/// - samples: exactly;
/// - seconds: no pass is begun that is not expected to end in time; the first pass is always finished;
/// - error: the estimate plus twice its standard error is below the limit, with 16 samples at least.
/// After an interrupt the pass is finished if that takes less than a second; otherwise pixels keep what they have.
/// `between_passes`, if any, is called about every `pause` seconds, with no thread writing to the film.
RenderOutcome render_passes(Film& film, const RenderLimits& limits, Workers& workers, Progress& progress,
                            FunctionRef<void(const Tile&, Film&)> render_tile,
                            const std::function<void(const Film&)>& between_passes = {}, double pause = 2);

}  // namespace ln
