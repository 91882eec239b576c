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
#include "ln/lightmap.hpp"
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

struct NamedFile {
  const char* option;
  std::string path;
  bool is_output;
};

/// Every file that the run reads or writes, but for those that the scene names.
std::vector<NamedFile> files_of(const Options& options, const ProgramInfo& program) {
  std::vector<NamedFile> names{{"SCENE", options.scene, false},
                               {"--env", options.environment_path, false},
                               {"-o", program.has_image ? options.output : "", true},
                               {"--stats", options.stats_path, true},
                               {"--preview", program.has_image ? options.preview_path : "", true}};
  for (const ProbeInfo& probe : program.probes) {
    names.push_back({"the probe's sensors", probe.sensors, false});
    names.push_back({"a probe", probe.file, true});
  }
  for (const LightmapInfo& lightmap : program.lightmaps) {
    names.push_back({"a lightmap", lightmap.file, true});
    names.push_back({"a lightmap's texture", atlas_file(lightmap.file), true});
  }
  for (const TapInfo& tap : program.taps) names.push_back({"a tap", tap.file, true});
  for (const LayerInfo& layer : program.layers)
    if (layer.file) names.push_back({"a tap", layer.file, true});
  return names;
}

/// Two outputs under one name, or an input as output, would destroy each other. And what cannot be written is said before
/// the work begins.
void check_files(const std::vector<NamedFile>& names) {
  for (const NamedFile& a : names) {
    for (const NamedFile& b : names) {
      if (&a >= &b || !(a.is_output || b.is_output) || a.path.empty() || b.path.empty()) continue;
      if (same_file(a.path, b.path))
        throw UsageError(std::string(a.option) + " and " + b.option + " are the same file, '" + b.path + "'");
    }
  }
  for (const NamedFile& file : names)
    if (file.is_output && !file.path.empty()) check_output(file.path);
}

RenderLimits limits_of(const Options& options, double prepare_seconds) {
  RenderLimits limits{options.samples, options.time, options.error};
  if (limits.seconds) *limits.seconds -= prepare_seconds;
  return limits;
}

std::string comparison_text(const Comparison& found) {
  char text[160];
  std::snprintf(text, sizeof text, "relMSE %.4g, RMSE %.4g, mean %.4g (bias %.3g %%), largest difference %.4g", found.rel_mse,
                found.rmse, found.mean, 100 * found.bias, found.largest);
  return text;
}

ExrMetadata metadata_of(const Options& options, const RenderOutcome& outcome, const Stats& stats) {
  ExrMetadata metadata{{"software", std::string("Lighting Networks")},
                       {"scene", base_name(options.scene)},
                       {"samples", static_cast<std::int32_t>(outcome.samples)},
                       {"seed", std::to_string(options.seed)},
                       {"units", std::string(options.units == Units::photometric ? "photometric" : "radiometric")}};
  if (!options.camera.empty()) metadata.emplace_back("camera", options.camera);
  if (!options.environment_path.empty()) metadata.emplace_back("environment", base_name(options.environment_path));
  if (outcome.most_samples != outcome.samples)
    metadata.emplace_back("samplesMost", static_cast<std::int32_t>(outcome.most_samples));
  std::string sets;
  for (const std::string& set : options.sets) sets += (sets.empty() ? "" : " ") + set;
  if (!sets.empty()) metadata.emplace_back("parameters", sets);
  for (const DifferenceStats& each : stats.differences)
    metadata.emplace_back("difference." + each.name, comparison_text(each.found));
  return metadata;
}

/// Writes the preview; a failure is a warning while the render runs, said once.
class Preview {
 public:
  Preview(std::string path, Units units) : path_(std::move(path)), units_(units) {}

  void try_write(const Film& film) {
    try {
      write(film);
    } catch (const Error& error) {
      if (!warned_) warning(error.what());
      warned_ = true;
    }
  }

  void write(const Film& film) const { write_preview(path_, film, units_); }

 private:
  std::string path_;
  Units units_;
  bool warned_ = false;
};

std::string summary(const Options& options, const ProgramInfo& program, const RenderOutcome& outcome, const Stats& stats) {
  std::string text;
  if (program.has_image) text = options.output + ": " + std::to_string(stats.width) + "x" + std::to_string(stats.height) + ", ";
  text += std::to_string(outcome.samples) + (outcome.most_samples > outcome.samples ? " or more sample" : " sample") +
          (outcome.samples == 1 ? "" : "s");
  char numbers[80];
  int used =
      std::snprintf(numbers, sizeof numbers, " a %s, %.2f s", program.uses_camera() ? "pixel" : "point", stats.seconds.total);
  if (stats.seconds.render > 0 && stats.rays.total > 0) {
    const double rate = static_cast<double>(stats.rays.total) / (stats.seconds.prepare + stats.seconds.render) * 1e-6;
    std::snprintf(numbers + used, sizeof numbers - static_cast<std::size_t>(used), ", %.2f million rays/s", rate);
  }
  return text + numbers + (outcome.interrupted ? ", interrupted" : "");
}

void report_repairs(const Film& film) {
  const std::uint64_t count = film.non_finite_samples() + film.negative_samples();
  if (count == 0) return;
  warning(std::to_string(film.non_finite_samples()) + " samples were not finite and " +
          std::to_string(film.negative_samples()) +
          " were negative; they count as black. This is a fault of an operator or of the scene's values");
}

/// Says how far the two sides of each Difference are apart.
void compare(const Film& film, const ProgramInfo& program, Stats& stats) {
  for (const DifferenceInfo& info : program.differences) {
    const Comparison found = film.compare(info.a, info.b);
    stats.differences.push_back({info.name, found});
    note(std::string(info.name) + ": " + comparison_text(found));
  }
}

/// Renders what the camera sees into the film and writes it, if it is a picture.
RenderOutcome render_picture(RunContext& context, RunCallbacks& callbacks, const RenderLimits& limits, Film& film) {
  const Options& options = context.options;
  const bool has_image = context.program.has_image;
  context.progress.phase("render");
  Preview preview(options.preview_path, options.units);
  std::function<void(const Film&)> between_passes;
  if (has_image && !options.preview_path.empty()) between_passes = [&](const Film& present) { preview.try_write(present); };
  const RenderOutcome outcome = render_passes(
      film, limits, context.workers, context.progress,
      [&](const Tile& tile, Film& target) { callbacks.render_tile(tile, target); }, between_passes, kPreviewInterval);
  if (outcome.most_samples == 0) throw Interrupted{};
  if (outcome.error) context.stats.error_estimate = outcome.error->rel_mse;
  context.stats.repaired_samples = film.non_finite_samples() + film.negative_samples();
  context.stats.width = film.width();
  context.stats.height = film.height();
  context.stats.seconds.render += outcome.seconds;

  context.progress.phase("write");
  report_repairs(film);
  compare(film, context.program, context.stats);
  if (!has_image) return outcome;
  write_exr(options.output, film, context.program, metadata_of(options, outcome, context.stats), context.workers.count());
  context.stats.seconds.total = seconds_since_start();
  if (!options.preview_path.empty()) preview.write(film);
  return outcome;
}

int render_program(const Options& options, const ProgramInfo& program, RunCallbacks& callbacks, Progress& progress) {
  if (!options.print_letters && !options.verify_paths) check_files(files_of(options, program));
  for (const char* option : options.unused)
    note(std::string(option) +
         " is not used: " + (options.verify_paths ? "--verify-paths writes no files" : "this network has nothing for it"));

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

  if (options.verify_paths) return callbacks.verify(context) ? 0 : kFailed;

  std::optional<Film> film;
  if (program.uses_camera()) {
    film.emplace(size.width, size.height, static_cast<int>(program.layers.size()),
                 program.shows_difference ? Film::Samples::difference
                 : program.subtracts      ? Film::Samples::signed_values
                                          : Film::Samples::positive);
  }
  progress.phase("prepare");
  watch = Stopwatch();
  callbacks.prepare(context);
  stats.seconds.prepare = watch.seconds();
  throw_if_interrupted();

  RenderOutcome outcome = callbacks.measure(context, limits_of(options, stats.seconds.prepare));
  stats.seconds.render = outcome.seconds;
  if (film) {
    throw_if_interrupted();
    outcome = render_picture(context, callbacks, limits_of(options, stats.seconds.prepare + stats.seconds.render), *film);
  }
  callbacks.finish(context, film ? &*film : nullptr);
  if (!program.has_image) stats.seconds.total = seconds_since_start();
  stats.samples = outcome.samples;
  stats.interrupted = outcome.interrupted;
  stats.peak_bytes = peak_memory_bytes();
  callbacks.collect(stats);
  if (!options.stats_path.empty()) write_output_file(options.stats_path, stats_json(stats));
  progress.finish(summary(options, program, outcome, stats));
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
    report_error(name, "interrupted before the picture was begun; no picture is written");
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
