#include "ln/program.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <new>
#include <optional>

#include "ln/exr_film.hpp"
#include "ln/film.hpp"
#include "ln/interrupt.hpp"
#include "ln/output_file.hpp"
#include "ln/parallel.hpp"
#include "ln/preview.hpp"
#include "ln/progress.hpp"
#include "ln/render_passes.hpp"
#include "ln/stats.hpp"

namespace ln {

namespace {

constexpr int kFailed = 1, kWrongUsage = 2, kInterrupted = 130;
constexpr double kPreviewInterval = 2;  // [s]

/// If a program is started with a standard stream closed, the next file opened would take its number, and messages would end
/// up in the picture.
void keep_standard_streams() {
  for (int stream = 0; stream < 3; ++stream) {
    if (fcntl(stream, F_GETFD) == -1) (void)!::open("/dev/null", O_RDWR);  // takes the lowest free number
  }
}

std::string base_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

void throw_if_interrupted() {
  if (interrupt_requested()) throw Interrupted{};
}

/// Two outputs under one name, or an input as output, would destroy each other.
void check_names(const Options& options) {
  struct Name {
    const char* option;
    const std::string& path;
    bool is_output;
  };
  const Name names[] = {{"SCENE", options.scene, false},
                        {"--env", options.environment_path, false},
                        {"-o", options.output, true},
                        {"--stats", options.stats_path, true},
                        {"--preview", options.preview_path, true}};
  for (const Name& a : names) {
    for (const Name& b : names) {
      if (&a >= &b || !b.is_output || a.path.empty() || b.path.empty()) continue;
      if (same_file(a.path, b.path)) throw UsageError(std::string(a.option) + " and " + b.option + " are the same file, '" + b.path + "'");
    }
  }
}

void check_outputs(const Options& options) {
  for (const std::string* path : {&options.output, &options.stats_path, &options.preview_path}) {
    if (!path->empty()) check_output(*path);
  }
}

RenderLimits limits_of(const Options& options, double prepare_seconds) {
  RenderLimits limits{options.samples, options.time, options.error};
  if (limits.seconds) *limits.seconds -= prepare_seconds;
  return limits;
}

ExrMetadata metadata_of(const Options& options, const RenderOutcome& outcome) {
  ExrMetadata metadata{{"software", std::string("Lighting Networks")},
                       {"scene", base_name(options.scene)},
                       {"samples", static_cast<std::int32_t>(outcome.samples)},
                       {"seed", std::to_string(options.seed)},
                       {"units", std::string(options.units == Units::photometric ? "photometric" : "radiometric")}};
  if (!options.camera.empty()) metadata.emplace_back("camera", options.camera);
  if (!options.environment_path.empty()) metadata.emplace_back("environment", base_name(options.environment_path));
  if (outcome.most_samples != outcome.samples) metadata.emplace_back("samplesMost", static_cast<std::int32_t>(outcome.most_samples));
  std::string sets;
  for (const std::string& set : options.sets) sets += (sets.empty() ? "" : " ") + set;
  if (!sets.empty()) metadata.emplace_back("parameters", sets);
  return metadata;
}

/// Writes the preview; a failure is a warning while the render runs, said once.
class Preview {
 public:
  explicit Preview(std::string path) : path_(std::move(path)) {}

  void try_write(const Film& film) {
    try {
      write_preview(path_, film);
    } catch (const Error& error) {
      if (!warned_) warning(error.what());
      warned_ = true;
    }
  }

 private:
  std::string path_;
  bool warned_ = false;
};

std::string summary(const Options& options, const Film& film, const RenderOutcome& outcome, const Stats& stats) {
  char text[200];
  const double rate = stats.seconds.render > 0 ? static_cast<double>(stats.rays.total) / (stats.seconds.prepare + stats.seconds.render) * 1e-6 : 0;
  int used = std::snprintf(text, sizeof text, ": %dx%d, %u%s sample%s a pixel, %.2f s", film.width(), film.height(), outcome.samples,
                           outcome.most_samples > outcome.samples ? " or more" : "", outcome.samples == 1 ? "" : "s", stats.seconds.total);
  if (rate > 0) used += std::snprintf(text + used, sizeof text - static_cast<std::size_t>(used), ", %.2f million rays/s", rate);
  return options.output + text + (outcome.interrupted ? ", interrupted" : "");
}

void report_repairs(const Film& film) {
  const std::uint64_t count = film.non_finite_samples() + film.negative_samples();
  if (count == 0) return;
  warning(std::to_string(film.non_finite_samples()) + " samples were not finite and " + std::to_string(film.negative_samples()) +
          " were negative; they count as black. This is a fault of an operator or of the scene's values");
}

int render_program(const Options& options, const ProgramInfo& program, RunCallbacks& callbacks, Progress& progress) {
  check_names(options);
  check_outputs(options);

  Workers workers(options.threads);
  Stats stats;
  stats.network = program.network;
  stats.threads = workers.count();
  stats.seed = options.seed;
  RunContext context{program, options, workers, progress, stats};

  progress.phase("load");
  Stopwatch watch;
  const PictureSize size = callbacks.load(context);
  stats.seconds.load = watch.seconds();
  throw_if_interrupted();

  progress.phase("build");
  watch = Stopwatch();
  callbacks.build(context);
  stats.seconds.build = watch.seconds();
  throw_if_interrupted();

  Film film(size.width, size.height, static_cast<int>(program.layers.size()),
            program.subtracts ? Film::Samples::signed_values : Film::Samples::positive);
  progress.phase("prepare");
  watch = Stopwatch();
  callbacks.prepare(context);
  stats.seconds.prepare = watch.seconds();
  throw_if_interrupted();

  progress.phase("render");
  Preview preview(options.preview_path);
  std::function<void(const Film&)> between_passes;
  if (!options.preview_path.empty()) between_passes = [&](const Film& present) { preview.try_write(present); };
  const RenderOutcome outcome = render_passes(
      film, limits_of(options, stats.seconds.prepare), workers, progress,
      [&](const Tile& tile, Film& target) { callbacks.render_tile(tile, target); }, between_passes, kPreviewInterval);
  if (outcome.most_samples == 0) throw Interrupted{};
  stats.seconds.render = outcome.seconds;
  stats.samples = outcome.samples;
  stats.interrupted = outcome.interrupted;
  if (outcome.error) stats.error_estimate = outcome.error->rel_mse;
  stats.repaired_samples = film.non_finite_samples() + film.negative_samples();
  stats.width = film.width();
  stats.height = film.height();

  progress.phase("write");
  report_repairs(film);
  write_exr(options.output, film, program, metadata_of(options, outcome), workers.count());
  stats.seconds.total = seconds_since_start();
  callbacks.finish(context, film);
  if (!options.preview_path.empty()) write_preview(options.preview_path, film);
  stats.peak_bytes = peak_memory_bytes();
  callbacks.collect(stats);
  if (!options.stats_path.empty()) write_output_file(options.stats_path, stats_json(stats));
  progress.finish(summary(options, film, outcome, stats));
  return outcome.interrupted ? kInterrupted : 0;
}

/// Runs `action` and turns whatever it throws into a line and an exit status.
template <class Action>
int with_exit_status(const std::string& name, Action&& action) noexcept {
  try {
    return action();
  } catch (const HelpRequest& request) {
    std::fputs(request.text.c_str(), stdout);
    return std::fflush(stdout) == 0 ? 0 : kFailed;
  } catch (const UsageError& error) {
    report_error(name, error.what());
    return kWrongUsage;
  } catch (const Error& error) {
    report_error(name, error.what());
    return kFailed;
  } catch (const Interrupted&) {
    report_error(name, "interrupted before the picture was begun; nothing is written");
    return kInterrupted;
  } catch (const std::bad_alloc&) {
    report_error(name, "out of memory: choose a smaller --size, fewer photons or samples in the network, or a smaller scene");
    return kFailed;
  } catch (const std::exception& error) {
    report_error(name, std::string("internal error: ") + error.what());
    return kFailed;
  } catch (...) {
    report_error(name, "internal error of an unknown kind");
    return kFailed;
  }
}

}  // namespace

int run_program(int argc, char** argv, const ProgramInfo& program, RunCallbacks& callbacks) {
  keep_standard_streams();
  install_interrupt_handlers();
  const std::string name = argc > 0 ? base_name(argv[0]) : program.network;
  return with_exit_status(name, [&] {
    const Options options = parse_options(argc, argv, program);
    Progress progress(options.progress);
    // Inside the scope of `progress`, so that the last line has its form.
    return with_exit_status(name, [&] { return render_program(options, program, callbacks, progress); });
  });
}

}  // namespace ln
