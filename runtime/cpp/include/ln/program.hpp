#pragma once
// What a compiled network tells the runtime about itself, and `run_program`, which does everything that all networks share.

#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "ln/letters.hpp"
#include "ln/options.hpp"
#include "ln/render_passes.hpp"

namespace ln {

class Progress;
struct Stats;

/// What a parameter measures. In brackets: the type of the variable behind ParameterSlot::value, and its unit.
enum class ParameterKind : std::uint8_t {
  count,   // [std::int64_t]
  ratio,   // [float, 1]
  length,  // [float, metres of the scene]
  angle,   // [float, radians]
  time,    // [float, seconds]
  number,  // [float]
  flag,    // [bool]
  choice,  // [std::int32_t, index into `choices`]
  text,    // [std::string]
};

/// A parameter of a node that can be set when the program starts (--set NODE.PARAMETER=VALUE). On entry the variable behind
/// `value` holds the default. The range is in the unit of the variable, its ends included.
struct ParameterSlot {
  const char* node;
  const char* name;
  ParameterKind kind;
  void* value;
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  std::span<const char* const> choices = {};
  const char* summary = "";  // one line for --help
};

struct NodeInfo {
  const char* name;
  const char* op;
  int line = 0;  // in the .ln file
};

/// A wire that is written as a layer `name.R`, `name.G`, `name.B` of the picture.
struct LayerInfo {
  const char* name;
  const char* light_paths = "";
  const char* file = nullptr;  // a tap: a picture of its own instead of a layer
  bool is_signed = false;      // it holds negative values, too; taps only
};

/// Two wires that are compared, by the layers that show them.
struct DifferenceInfo {
  const char* name;
  int a, b;
};

/// A wire that is written to a file as it is stored.
struct TapInfo {
  const char* wire;
  const char* light_paths;
  const char* file;
};

/// A wire whose irradiance is measured at the sensors of a file.
struct ProbeInfo {
  const char* wire;          // as the network has it
  const char* sensors;       // file that is read
  const char* file;          // file that is written
  bool on_surfaces = false;  // the wire is known on surfaces only, not in free space
};

/// A wire whose irradiance is baked onto the surfaces.
struct LightmapInfo {
  const char* wire;
  const char* light_paths;
  const char* file;
};

struct ProgramInfo {
  const char* network;
  const char* source_file;  // the .ln file's name without its folder
  const char* image_paths;  // light paths of the picture
  std::span<const ParameterSlot> parameters = {};
  std::span<const NodeInfo> nodes = {};
  std::span<const LayerInfo> layers = {};
  bool subtracts = false;  // some wire is subtracted, so samples may be negative
  std::span<const DifferenceInfo> differences = {};
  bool shows_difference = false;  // the picture is |a - b|
  std::span<const TapInfo> taps = {};
  std::span<const ProbeInfo> probes = {};
  std::span<const LightmapInfo> lightmaps = {};
  bool has_image = true;
  std::span<const SkipRule> skip_rules = {};
  std::span<const int> path_tags = {};      // numbers of the tags that letters tell apart
  const char* compiled_for = nullptr;       // the only scene that the program was compiled for, and those that have no more
  std::span<const LetterNeed> absent = {};  // what that scene does not have

  /// Are there camera rays?
  bool uses_camera() const { return has_image || !layers.empty(); }
};

/// What the parts of a run share.
struct RunContext {
  const ProgramInfo& program;
  const Options& options;
  Workers& workers;
  Progress& progress;
  Stats& stats;
};

/// The part of a program that depends on the network, called in this order, each once but for render_tile.
class RunCallbacks {
 public:
  virtual ~RunCallbacks() = default;

  /// Reads the scene and chooses the camera. Returns the size of the picture: picture_size(options, camera.aspect).
  virtual PictureSize load(RunContext& context) = 0;
  /// Builds what rays and emitters need (Embree, light tree).
  virtual void build(RunContext& context) = 0;
  /// Work of the operators before the picture; name each with context.progress.phase("prepare", node).
  virtual void prepare(RunContext& context) = 0;
  /// Results other than pictures, each written when it is done, within `limits`. Returns how far they came.
  virtual RenderOutcome measure(RunContext&, const RenderLimits&) { return {}; }
  /// Instead of preparing and rendering (--verify-paths): compares every wire with its light paths and prints what was found.
  /// Returns whether all is well.
  virtual bool verify(RunContext&) { throw UsageError("--verify-paths: this program has no wires"); }
  /// Adds samples [tile.first_sample, tile.first_sample + tile.sample_count) of the tile's pixels to the film; called from
  /// many threads. What it adds must depend on pixel and sample number only, never on tile, worker or order. It returns early,
  /// between two samples of a pixel, when tile.stopped().
  virtual void render_tile(const Tile& tile, Film& film) = 0;
  /// After all other results: taps. Called after an interrupt too. `film` is null if there are no camera rays.
  virtual void finish(RunContext&, const Film*) {}
  /// Fills scene, rays and nodes; seconds, samples and peak_bytes are filled already.
  virtual void collect(Stats& stats) = 0;
};

/// Runs the program from the command line to the exit status. Never throws; prints one line if it fails.
int run_program(int argc, char** argv, const ProgramInfo& program, RunCallbacks& callbacks);

}  // namespace ln
