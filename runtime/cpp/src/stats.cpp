#include "ln/stats.hpp"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

namespace ln {

namespace {

double clock_seconds(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The number behind "Name:" in a file of /proc [kB], 0 if there is none.
std::uint64_t proc_kilobytes(const char* file, const char* name) {
  std::FILE* stream = std::fopen(file, "re");
  if (!stream) return 0;
  char line[256];
  unsigned long long value = 0;
  const std::size_t length = std::strlen(name);
  while (std::fgets(line, sizeof line, stream)) {
    if (std::strncmp(line, name, length) == 0 && std::sscanf(line + length, ": %llu", &value) == 1) break;
  }
  std::fclose(stream);
  return value;
}

/// When the kernel says that this process was started, in ticks since boot [s]; below 0: unknown.
double start_after_boot() {
  std::FILE* stream = std::fopen("/proc/self/stat", "re");
  if (!stream) return -1;
  char text[1024];
  const std::size_t size = std::fread(text, 1, sizeof text - 1, stream);
  std::fclose(stream);
  text[size] = 0;
  const char* after_name = std::strrchr(text, ')');
  unsigned long long ticks = 0;
  // starttime is field 22; the name is field 2.
  if (!after_name ||
      std::sscanf(after_name + 1, " %*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %*u %*u %*d %*d %*d %*d %*d %*d %llu",
                  &ticks) != 1) {
    return -1;
  }
  return static_cast<double>(ticks) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

/// Seconds that the process had been running when its static objects were made. The kernel tells the start in steps of 10 ms;
/// its processor time is exact, but leaves out waiting for the disk. Neither is too much.
double seconds_before_main() {
  const double start = start_after_boot();
  const double step = 1 / static_cast<double>(sysconf(_SC_CLK_TCK));
  const double by_ticks = start < 0 ? 0 : clock_seconds(CLOCK_BOOTTIME) - start - step;
  return std::max(by_ticks, clock_seconds(CLOCK_PROCESS_CPUTIME_ID));
}

const double main_start = clock_seconds(CLOCK_MONOTONIC);
const double before_main = seconds_before_main();

}  // namespace

double wall_seconds() { return clock_seconds(CLOCK_MONOTONIC); }

double seconds_since_start() { return wall_seconds() - main_start + before_main; }

std::uint64_t peak_memory_bytes() {
  const std::uint64_t peak = proc_kilobytes("/proc/self/status", "VmHWM");
  if (peak > 0) return peak * 1024;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t available_memory_bytes() {
  const std::uint64_t available = proc_kilobytes("/proc/meminfo", "MemAvailable");
  if (available > 0) return available * 1024;
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

RayCounts& RayCounts::operator+=(const RayCounts& other) {
  camera += other.camera;
  shadow += other.shadow;
  gather += other.gather;
  photon += other.photon;
  total += other.total;
  return *this;
}

std::string stats_json(const Stats& stats) {
  using Json = nlohmann::ordered_json;
  const auto or_null = [](const auto& value) { return value ? Json(*value) : Json(nullptr); };

  Json scene{{"file", stats.scene_file}};
  for (const auto& [name, count] : stats.scene_counts) scene[name] = count;

  Json nodes = Json::array();
  for (const NodeStats& node : stats.nodes) {
    nodes.push_back({{"name", node.name},
                     {"op", node.op},
                     {"seconds", node.seconds},
                     {"rays", node.rays},
                     {"skipped", or_null(node.skipped)}});
  }

  Json differences = Json::array();
  for (const DifferenceStats& each : stats.differences)
    differences.push_back({{"name", each.name},
                           {"mean", each.found.mean},
                           {"RMSE", each.found.rmse},
                           {"relMSE", each.found.rel_mse},
                           {"bias", each.found.bias},
                           {"max", each.found.largest}});

  const Json json{{"network", stats.network},
                  {"scene", scene},
                  {"seconds",
                   {{"load", stats.seconds.load},
                    {"build", stats.seconds.build},
                    {"prepare", stats.seconds.prepare},
                    {"render", stats.seconds.render},
                    {"total", stats.seconds.total}}},
                  {"rays",
                   {{"camera", stats.rays.camera},
                    {"shadow", stats.rays.shadow},
                    {"gather", stats.rays.gather},
                    {"photon", stats.rays.photon},
                    {"total", stats.rays.total}}},
                  {"nodes", nodes},
                  {"samples", stats.samples},
                  {"peak_bytes", stats.peak_bytes},
                  {"width", stats.width},
                  {"height", stats.height},
                  {"threads", stats.threads},
                  {"seed", stats.seed},
                  {"interrupted", stats.interrupted},
                  {"error_estimate", or_null(stats.error_estimate)},
                  {"repaired_samples", stats.repaired_samples},
                  {"differences", differences}};
  // File names need not be UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ln
