#pragma once
// What a run cost, for --stats.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ln/film.hpp"

namespace ln {

struct RayCounts {
  std::uint64_t camera = 0;  // camera rays and their specular continuation
  std::uint64_t shadow = 0;  // visibility only
  std::uint64_t gather = 0;  // other rays from surfaces
  std::uint64_t photon = 0;  // from emitters
  std::uint64_t total = 0;   // every query

  RayCounts& operator+=(const RayCounts& other);
};

struct NodeStats {
  std::string name, op;
  double seconds = 0;
  std::uint64_t rays = 0;
  std::optional<std::string> skipped;  // the reason
};

/// Two wires that were compared.
struct DifferenceStats {
  std::string name;
  Comparison found;
};

struct Stats {
  std::string network;
  std::string scene_file;
  std::vector<std::pair<std::string, std::uint64_t>> scene_counts;  // {"triangles", 36}, ...
  struct Seconds {
    double load = 0, build = 0, prepare = 0, render = 0;
    double total = 0;  // from process start to the renamed file
  } seconds;
  RayCounts rays;
  std::vector<NodeStats> nodes;
  std::uint64_t samples = 0;  // per pixel, of the pixel that has least
  std::uint64_t peak_bytes = 0;

  // Beyond the contract:
  int width = 0, height = 0, threads = 0;
  std::uint64_t seed = 0;
  bool interrupted = false;
  std::optional<double> error_estimate;
  std::uint64_t repaired_samples = 0;
  std::vector<DifferenceStats> differences;
};

/// The text of the --stats file.
std::string stats_json(const Stats& stats);

/// Wall seconds since the process started (dynamic linking included), and since some fixed time before that.
double seconds_since_start();
double wall_seconds();

/// Most memory that this process has had resident [bytes].
std::uint64_t peak_memory_bytes();

/// Memory that could be had now without swapping [bytes].
std::uint64_t available_memory_bytes();

/// Wall time since its making.
class Stopwatch {
 public:
  double seconds() const { return wall_seconds() - start_; }

 private:
  double start_ = wall_seconds();
};

}  // namespace ln
