#pragma once
// The command line of a compiled network.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ln/error.hpp"

namespace ln {

struct ProgramInfo;
struct ParameterSlot;

enum class ProgressMode : std::uint8_t { automatic, plain, json, none };
enum class Units : std::uint8_t { radiometric, photometric };

struct Options {
  std::string scene;
  std::string output = "out.exr";
  int width = 0, height = 0;  // 0: not given, see picture_size
  std::string camera;         // empty: the first of the scene
  // The first limit reached ends the render. None given: kDefaultSamples.
  std::optional<std::uint32_t> samples;  // camera paths per pixel
  std::optional<double> time;            // wall seconds of prepare and render
  std::optional<double> error;           // estimated relMSE of the picture
  bool default_samples = false;          // none was given
  std::uint64_t seed = 0;
  int threads = 1;                                         // parse_options: all processors that this process may use
  std::vector<std::string> sets;                           // "node.parameter=value" as given; the slots hold the values already
  std::string stats_path, preview_path, environment_path;  // empty: none
  bool verify_paths = false;                               // no picture: compare the wires with their light paths
  ProgressMode progress = ProgressMode::automatic;
  Units units = Units::radiometric;
  int lightmap_side = 512;          // texels
  bool print_letters = false;       // instead of rendering: for `lnc compile --scene`
  std::vector<const char*> unused;  // options that were given, though this network has nothing to do with them
};

inline constexpr std::uint32_t kDefaultSamples = 64, kDefaultProbeSamples = 1024;
inline constexpr int kDefaultSide = 640;
inline constexpr int kLargestSide = 65'536, kLargestLightmap = 16'384;
inline constexpr std::int64_t kMostPixels = std::int64_t{1} << 28;

/// Thrown by parse_options for --help and --version: print `text` on standard output and exit with 0.
struct HelpRequest {
  std::string text;
};

/// Reads the command line and stores the values of --set into the slots of `program`.
/// Throws UsageError (one line that says what was found, what was wanted and the nearest legal thing) and HelpRequest.
/// Does not look at any file.
Options parse_options(int argc, const char* const* argv, const ProgramInfo& program);

struct PictureSize {
  int width = 0, height = 0;
};

/// --size if given. Otherwise the longer side has 640 pixels and the other follows the camera's aspect (width / height);
/// 640x480 for a camera without one (`aspect` 0 or not a sane number).
PictureSize picture_size(const Options& options, float aspect);

/// Stores "value" into the slot after checking unit and range; throws UsageError.
///   count   200000, 200k, 1.5M, 2G    number  0.5, -1e-3, 2k    ratio   0.01, 1%
///   length  5cm, 2mm, 1.5m, 1km, 3um  angle   30deg, 0.5rad     time    2s, 50ms, 1min, 1h    (these need a unit unless 0)
///   flag    true, false, yes, no, on, off, 1, 0                 choice  one of its names      text  anything
void set_parameter(const ParameterSlot& slot, std::string_view value);

/// The slot's present value as one would write it ("200k", "1%", "5cm", "30deg", "true").
std::string parameter_text(const ParameterSlot& slot);

/// The candidate that `word` was probably meant to be, or an empty string.
std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace ln
