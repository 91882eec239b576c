#include "ln/options.hpp"

#include <sched.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <thread>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#pragma GCC diagnostic pop

#include "ln/program.hpp"
#include "ln/text.hpp"

#ifndef LN_VERSION
#define LN_VERSION "0.1.0"
#endif

namespace ln {

namespace {

constexpr std::uint32_t kMostSamples = 1'000'000'000;
constexpr int kMostThreads = 1024;

// --- Numbers with units ---------------------------------------------------------------------------------------------

struct Unit {
  std::string_view name;
  double factor;
};

constexpr std::array kCountUnits{Unit{"", 1}, Unit{"k", 1e3}, Unit{"M", 1e6}, Unit{"G", 1e9}};
constexpr std::array kRatioUnits{Unit{"", 1}, Unit{"%", 0.01}};
// The same as in the language: lengths, angles and times need a unit there, and so they do in --set.
constexpr std::array kLengthUnits{Unit{"m", 1}, Unit{"cm", 0.01}, Unit{"mm", 1e-3}, Unit{"um", 1e-6}, Unit{"km", 1e3}};
constexpr std::array kAngleUnits{Unit{"deg", 3.14159265358979323846 / 180}, Unit{"rad", 1}};
constexpr std::array kTimeUnits{Unit{"s", 1}, Unit{"ms", 1e-3}, Unit{"min", 60}, Unit{"h", 3600}};

std::span<const Unit> units_of(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::count: return kCountUnits;
    case ParameterKind::ratio: return kRatioUnits;
    case ParameterKind::length: return kLengthUnits;
    case ParameterKind::angle: return kAngleUnits;
    case ParameterKind::time: return kTimeUnits;
    default: return kCountUnits;
  }
}

const char* examples_of(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::count: return "a whole number such as 64 or 200k";
    case ParameterKind::ratio: return "a ratio such as 0.01 or 1%";
    case ParameterKind::length: return "a length such as 5cm or 1.5m";
    case ParameterKind::angle: return "an angle such as 30deg or 0.5rad";
    case ParameterKind::time: return "a time such as 10s, 500ms or 2min";
    case ParameterKind::number: return "a number such as 0.5";
    case ParameterKind::flag: return "true or false";
    case ParameterKind::choice: return "one of its names";
    case ParameterKind::text: return "a text";
  }
  return "";
}

std::string quote(std::string_view text) { return "'" + printable(text) + "'"; }

/// "'name' must be ..., not 'text'".
[[noreturn]] void refuse(std::string_view name, std::string_view wanted, std::string_view text) {
  throw UsageError(std::string(name) + " must be " + std::string(wanted) + ", not " + quote(text));
}

std::optional<double> parse_decimal(std::string_view text, std::string_view& rest) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  rest = text.substr(static_cast<std::size_t>(end - text.data()));
  return value;
}

/// The value in the unit of the kind's variable.
double parse_quantity(std::string_view name, ParameterKind kind, std::string_view text) {
  std::string_view unit;
  const std::optional<double> number = parse_decimal(text, unit);
  if (!number) refuse(name, examples_of(kind), text);
  for (const Unit& candidate : units_of(kind)) {
    if (candidate.name == unit) return *number * candidate.factor;
  }
  if (unit.empty() && *number == 0) return 0;
  refuse(name, examples_of(kind), text);
}

std::int64_t parse_count(std::string_view name, std::string_view text) {
  // Plain whole numbers exactly, however large.
  std::int64_t whole = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), whole);
  if (error == std::errc() && end == text.data() + text.size()) return whole;
  const double value = std::round(parse_quantity(name, ParameterKind::count, text) * 1e6) / 1e6;
  if (value != std::floor(value) || std::abs(value) > 0x1p53) refuse(name, examples_of(ParameterKind::count), text);
  return static_cast<std::int64_t>(value);
}

bool parse_flag(std::string_view name, std::string_view text) {
  for (const char* word : {"true", "yes", "on", "1"}) {
    if (text == word) return true;
  }
  for (const char* word : {"false", "no", "off", "0"}) {
    if (text == word) return false;
  }
  refuse(name, examples_of(ParameterKind::flag), text);
}

std::string quantity_text(ParameterKind kind, double value) {
  if (!std::isfinite(value)) return value < 0 ? "-inf" : "inf";
  switch (kind) {
    case ParameterKind::count:
      for (std::size_t i = kCountUnits.size(); i-- > 1;) {
        const double scaled = value / kCountUnits[i].factor;
        if (std::abs(scaled) >= 1 && scaled == std::floor(scaled))
          return number_text(scaled) + std::string(kCountUnits[i].name);
      }
      return number_text(value);
    case ParameterKind::ratio: return number_text(std::round(value * 1e8) / 1e6) + "%";
    case ParameterKind::length: return number_text(value) + "m";
    case ParameterKind::angle: return number_text(std::round(value / kAngleUnits[0].factor * 1e5) / 1e5) + "deg";
    case ParameterKind::time: return number_text(value) + "s";
    default: return number_text(value);
  }
}

/// A float's own shortest decimal, so that 0.1f reads "0.1".
double shortest(float value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = static_cast<double>(value);
  std::from_chars(text.data(), end, result);
  return result;
}

std::string range_text(const ParameterSlot& slot) {
  if (slot.kind == ParameterKind::flag || slot.kind == ParameterKind::text) return "";
  const bool above = std::isfinite(slot.minimum), below = std::isfinite(slot.maximum);
  if (above && below)
    return "between " + quantity_text(slot.kind, slot.minimum) + " and " + quantity_text(slot.kind, slot.maximum);
  if (above) return "at least " + quantity_text(slot.kind, slot.minimum);
  if (below) return "at most " + quantity_text(slot.kind, slot.maximum);
  return "";
}

std::string choices_text(const ParameterSlot& slot) {
  std::string text;
  for (const char* choice : slot.choices) text += (text.empty() ? "" : ", ") + std::string(choice);
  return text;
}

std::string slot_name(const ParameterSlot& slot) { return std::string(slot.node) + "." + slot.name; }

template <class T>
void store(const ParameterSlot& slot, const T& value) {
  *static_cast<T*>(slot.value) = value;
}

// --- Did you mean ---------------------------------------------------------------------------------------------------

/// Insertions, removals, changes and swaps of neighbours that turn `a` into `b`.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    std::swap(before_last, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_word(word, candidates);
  return nearest.empty() ? "" : " (did you mean '" + nearest + "'?)";
}

// --- Options --------------------------------------------------------------------------------------------------------

std::int64_t parse_whole(std::string_view option, std::string_view text, std::int64_t least, std::int64_t most) {
  const std::int64_t value = parse_count(option, text);
  if (value < least || value > most) {
    refuse(option,
           "a whole number between " + quantity_text(ParameterKind::count, static_cast<double>(least)) + " and " +
               quantity_text(ParameterKind::count, static_cast<double>(most)),
           text);
  }
  return value;
}

double require_positive(std::string_view option, double value, std::string_view text) {
  if (!(value > 0)) refuse(option, "above 0", text);
  return value;
}

/// Seconds; a plain number is one already.
double parse_time_limit(std::string_view text) {
  std::string_view unit;
  const std::optional<double> plain = parse_decimal(text, unit);
  return require_positive("--time", plain && unit.empty() ? *plain : parse_quantity("--time", ParameterKind::time, text), text);
}

std::uint64_t parse_seed(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    refuse("--seed", "a whole number from 0 to 18446744073709551615", text);
  return value;
}

void parse_size(std::string_view text, Options& options) {
  constexpr const char* kWanted = "WIDTHxHEIGHT such as 640x480, each from 1 to 65536";
  const auto side = [&](std::string_view digits) {
    int value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || value < 1 || value > kLargestSide)
      refuse("--size", kWanted, text);
    return value;
  };
  const std::size_t x = text.find_first_of("xX");
  if (x == std::string_view::npos) refuse("--size", kWanted, text);
  options.width = side(text.substr(0, x));
  options.height = side(text.substr(x + 1));
  if (std::int64_t{options.width} * options.height > kMostPixels) {
    throw UsageError("--size " + std::string(text) + " has more pixels than the " + std::to_string(kMostPixels >> 20) +
                     " million that a picture may have");
  }
}

template <class Enum>
Enum parse_choice(std::string_view option, std::string_view text, std::initializer_list<std::pair<const char*, Enum>> choices) {
  std::string names;
  std::vector<std::string> candidates;
  for (const auto& [name, value] : choices) {
    if (text == name) return value;
    names += (names.empty() ? "" : ", ") + std::string(name);
    candidates.emplace_back(name);
  }
  throw UsageError(std::string(option) + " must be one of " + names + ", not " + quote(text) + did_you_mean(text, candidates));
}

int available_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  const int count =
      sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : static_cast<int>(std::thread::hardware_concurrency());
  return std::clamp(count, 1, kMostThreads);
}

void apply_set(std::string_view text, const ProgramInfo& program) {
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.substr(0, std::min(equals, text.size())).rfind('.');
  if (equals == std::string_view::npos || dot == std::string_view::npos || dot == 0 || dot + 1 >= equals) {
    refuse("--set", "NODE.PARAMETER=VALUE", text);
  }
  const std::string_view node = text.substr(0, dot), name = text.substr(dot + 1, equals - dot - 1);

  std::vector<std::string> nodes, names;
  for (const ParameterSlot& slot : program.parameters) {
    if (node == slot.node && name == slot.name) return set_parameter(slot, text.substr(equals + 1));
    nodes.emplace_back(slot.node);
    if (node == slot.node) names.emplace_back(slot.name);
  }
  const std::string network = printable(program.network);
  if (!names.empty()) {
    std::string all;
    for (const std::string& each : names) all += (all.empty() ? "" : ", ") + each;
    const std::string suggestion = did_you_mean(name, names);
    throw UsageError("--set: node '" + printable(node) + "' has no parameter " + quote(name) +
                     (suggestion.empty() ? "; it has " + all : suggestion));
  }
  for (const NodeInfo& info : program.nodes) {
    if (node == info.name) throw UsageError("--set: node '" + printable(node) + "' has no parameters to set");
  }
  if (nodes.empty()) throw UsageError("--set: network '" + network + "' has no parameters to set");
  throw UsageError("--set: network '" + network + "' has no node " + quote(node) + " with parameters" +
                   did_you_mean(node, nodes) + "; see --help");
}

std::string parameters_help(const ProgramInfo& program) {
  if (program.parameters.empty()) return "";
  std::vector<std::array<std::string, 3>> rows;
  std::size_t width[2] = {0, 0};
  for (const ParameterSlot& slot : program.parameters) {
    std::string limits = slot.kind == ParameterKind::choice ? "one of " + choices_text(slot) : range_text(slot);
    std::string summary = slot.summary;
    rows.push_back({slot_name(slot) + "=" + parameter_text(slot), limits, summary});
    for (std::size_t i = 0; i < 2; ++i) width[i] = std::max(width[i], rows.back()[i].size());
  }
  std::string text = "Parameters of the network, with their defaults (--set NODE.PARAMETER=VALUE):\n";
  const char* previous = "";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ParameterSlot& slot = program.parameters[i];
    if (std::string_view(previous) != slot.node) {
      for (const NodeInfo& node : program.nodes) {
        if (std::string_view(node.name) == slot.node) {
          text += "  " + std::string(node.name) + " = " + node.op +
                  (node.line > 0 ? "  (" + std::string(program.source_file) + ":" + std::to_string(node.line) + ")" : "") +
                  "\n";
        }
      }
      previous = slot.node;
    }
    std::string line = "    " + rows[i][0];
    if (!rows[i][1].empty() || !rows[i][2].empty()) line += std::string(width[0] - rows[i][0].size() + 2, ' ') + rows[i][1];
    if (!rows[i][2].empty()) line += std::string(width[1] - rows[i][1].size() + 2, ' ') + rows[i][2];
    text += line + "\n";
  }
  return text;
}

std::string replaced(std::string text, std::string_view before, std::string_view after) {
  if (const std::size_t at = text.find(before); at != std::string::npos) text.replace(at, before.size(), after);
  return text;
}

/// The texts of all options as they were given.
struct RawOptions {
  std::string scene, output, size, camera, samples, time, error, seed, threads, stats, progress, preview, environment, units,
      lightmap_size;
  std::vector<std::string> sets;
  bool version = false, print_letters = false, verify_paths = false;
};

void declare_options(CLI::App& app, RawOptions& raw) {
  app.add_option("SCENE", raw.scene, "glTF 2.0 scene: a .gltf or .glb file")->type_name("");
  const auto add = [&](const char* names, std::string& value, const char* placeholder, const char* text) {
    app.add_option(names, value, text)->type_name(placeholder)->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  };
  add("-o,--output", raw.output, "FILE.exr", "the picture (default: out.exr)");
  add("--size", raw.size, "WxH",
      "pixels; keeps the vertical field of view (default: 640 for the longer side, by the camera's aspect)");
  add("--camera", raw.camera, "NAME", "camera of the scene (default: the first)");
  add("--samples", raw.samples, "N", "stop after N camera paths a pixel (default without any limit: 64)");
  add("--time", raw.time, "SECONDS", "stop after this wall time of prepare and render; every pixel gets one sample at least");
  add("--error", raw.error, "E", "stop when the estimated relative mean squared error of the picture is below E (0.01, 1%)");
  add("--seed", raw.seed, "N", "random numbers; the same seed gives the same picture (default: 0)");
  add("--threads", raw.threads, "N", "threads (default: one for each processor)");
  app.add_option("--set", raw.sets, "set a parameter of the network, see below; may be repeated")
      ->type_name("NODE.PARAM=VALUE")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add("--stats", raw.stats, "FILE.json", "write times, rays and memory");
  add("--progress", raw.progress, "HOW", "auto, plain, json or none (default: auto)");
  add("--preview", raw.preview, "FILE.png", "write a tone-mapped picture every few seconds and at the end");
  add("--env", raw.environment, "FILE.hdr", "environment map that lights the scene");
  add("--units", raw.units, "UNITS", "radiometric or photometric (default: radiometric)");
  add("--lightmap-size", raw.lightmap_size, "N", "texels along each side of a lightmap's texture (default: 512)");
  app.add_flag("--verify-paths", raw.verify_paths,
               "no picture: compare the energy on every wire with its light paths; exit status 1 if one deviates (--samples: "
               "points a batch)");
  app.add_flag("--version", raw.version, "print the version and exit");
  app.add_flag("--print-letters", raw.print_letters)->group("");  // not for users: asked by `lnc compile --scene`
}

/// The long and short names of all options.
std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

[[noreturn]] void refuse_extra(const std::string& extra, const CLI::App& app) {
  if (extra.size() > 1 && extra[0] == '-') {
    const std::string name = extra.substr(0, extra.find('='));
    throw UsageError("unknown option " + quote(name) + did_you_mean(name, option_names(app)) + "; see --help");
  }
  throw UsageError("one scene at a time: " + quote(extra) + " is one too many");
}

/// CLI11's view of what went wrong, in our words.
[[noreturn]] void refuse_parse(const CLI::ParseError& error) {
  std::string text = error.what();
  const std::size_t colon = text.find(':');
  if (error.get_name() == "ArgumentMismatch" && colon != std::string::npos) text = text.substr(0, colon) + " needs a value";
  throw UsageError(printable(text) + "; see --help");
}

void require_suffix(std::string_view option, std::string_view path, std::string_view suffix) {
  if (!path.empty() && !path.ends_with(suffix)) refuse(option, "a file name that ends in " + std::string(suffix), path);
}

/// The picture is OpenEXR whatever its name says; names that say something else are a mistake.
void refuse_other_format(std::string_view path) {
  for (const char* suffix : {".png", ".jpg", ".jpeg", ".hdr", ".tif", ".tiff", ".bmp", ".ppm", ".pfm", ".webp"}) {
    if (path.ends_with(suffix))
      throw UsageError("the picture is an OpenEXR file: -o must end in .exr, not " + quote(path) +
                       " (for a PNG add --preview)");
  }
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr std::size_t kShortest = 3, kLongest = 64;  // anything is near to a shorter word
  if (word.size() < kShortest || word.size() > kLongest) return "";
  std::string nearest;
  std::size_t least = std::max<std::size_t>(word.size() / 3, 1) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = candidate.size() > kLongest ? kLongest : edit_distance(word, candidate);
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  if (!nearest.empty() || word.size() < 4) return nearest;
  for (const std::string& candidate : candidates) {
    if (candidate.starts_with(word)) return candidate;  // cut short
  }
  return "";
}

void set_parameter(const ParameterSlot& slot, std::string_view value) {
  const std::string name = "--set: " + slot_name(slot);
  const auto check_range = [&](double number) {
    if (number < slot.minimum || number > slot.maximum) refuse(name, range_text(slot), value);
  };
  switch (slot.kind) {
    case ParameterKind::count: {
      const std::int64_t count = parse_count(name, value);
      check_range(static_cast<double>(count));
      return store(slot, count);
    }
    case ParameterKind::flag: return store(slot, parse_flag(name, value));
    case ParameterKind::text: return store(slot, std::string(value));
    case ParameterKind::choice:
      for (std::size_t i = 0; i < slot.choices.size(); ++i) {
        if (value == slot.choices[i]) return store(slot, static_cast<std::int32_t>(i));
      }
      refuse(name, "one of " + choices_text(slot), value);
    default: {
      const double number = parse_quantity(name, slot.kind, value);
      if (!(std::abs(number) <= static_cast<double>(std::numeric_limits<float>::max())))
        refuse(name, examples_of(slot.kind), value);
      // A float may round to just beyond its bound.
      check_range(number);
      return store(slot, static_cast<float>(number));
    }
  }
}

std::string parameter_text(const ParameterSlot& slot) {
  switch (slot.kind) {
    case ParameterKind::count:
      return quantity_text(slot.kind, static_cast<double>(*static_cast<const std::int64_t*>(slot.value)));
    case ParameterKind::flag: return *static_cast<const bool*>(slot.value) ? "true" : "false";
    case ParameterKind::text: return *static_cast<const std::string*>(slot.value);
    case ParameterKind::choice: {
      const auto index = static_cast<std::size_t>(*static_cast<const std::int32_t*>(slot.value));
      return index < slot.choices.size() ? slot.choices[index] : "";
    }
    default: return quantity_text(slot.kind, shortest(*static_cast<const float*>(slot.value)));
  }
}

Options parse_options(int argc, const char* const* argv, const ProgramInfo& program) {
  CLI::App app("Renders a glTF scene with the lighting network '" + std::string(program.network) + "' (" + program.source_file +
                   ").\n" + "Light paths of the picture: " + program.image_paths,
               argc > 0 ? std::string(argv[0]).substr(std::string(argv[0]).rfind('/') + 1) : program.network);
  RawOptions raw;
  declare_options(app, raw);
  app.allow_extras();
  app.get_formatter()->column_width(28);
  app.footer(
      parameters_help(program) + (program.parameters.empty() ? "" : "\n") +
      "Exit status 0: the picture is written; 1: it failed; 2: wrong usage; 130: interrupted, what was rendered is written.");
  try {
    std::vector<std::string> arguments;
    for (int i = argc - 1; i > 0; --i) arguments.emplace_back(argv[i]);  // CLI11 takes them from the back
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    throw HelpRequest{replaced(app.help(), "[OPTIONS] [SCENE]", "SCENE [OPTIONS]")};
  } catch (const CLI::ParseError& error) {
    refuse_parse(error);
  }
  if (raw.version) throw HelpRequest{"lighting network '" + std::string(program.network) + "', runtime " LN_VERSION "\n"};
  for (const std::string& extra : app.remaining()) {
    if (extra != "--") refuse_extra(extra, app);
  }
  for (const CLI::Option* option : app.get_options()) {
    if (option->count() > 0 && option->get_expected_max() > 0 && option->results().back().empty()) {
      throw UsageError(option->get_name() + " needs a value; see --help");
    }
  }
  if (raw.scene.empty()) throw UsageError("no scene given: name a .gltf or .glb file; see --help");

  Options options;
  options.scene = raw.scene;
  if (!raw.output.empty()) options.output = raw.output;
  refuse_other_format(options.output);
  if (!raw.size.empty()) parse_size(raw.size, options);
  options.camera = raw.camera;
  if (!raw.samples.empty())
    options.samples = static_cast<std::uint32_t>(parse_whole("--samples", raw.samples, 1, kMostSamples));
  if (!raw.time.empty()) options.time = parse_time_limit(raw.time);
  if (!raw.error.empty())
    options.error = require_positive("--error", parse_quantity("--error", ParameterKind::ratio, raw.error), raw.error);
  options.default_samples = !options.samples && !options.time && !options.error;
  if (options.default_samples) options.samples = kDefaultSamples;
  if (!raw.seed.empty()) options.seed = parse_seed(raw.seed);
  options.threads =
      raw.threads.empty() ? available_processors() : static_cast<int>(parse_whole("--threads", raw.threads, 1, kMostThreads));
  options.print_letters = raw.print_letters;
  options.stats_path = raw.stats;
  options.preview_path = raw.preview;
  require_suffix("--preview", raw.preview, ".png");
  options.environment_path = raw.environment;
  if (!raw.progress.empty()) {
    options.progress = parse_choice<ProgressMode>("--progress", raw.progress,
                                                  {{"auto", ProgressMode::automatic},
                                                   {"plain", ProgressMode::plain},
                                                   {"json", ProgressMode::json},
                                                   {"none", ProgressMode::none}});
  }
  if (!raw.units.empty()) {
    options.units =
        parse_choice<Units>("--units", raw.units, {{"radiometric", Units::radiometric}, {"photometric", Units::photometric}});
  }
  if (!raw.lightmap_size.empty())
    options.lightmap_side = static_cast<int>(parse_whole("--lightmap-size", raw.lightmap_size, 16, kLargestLightmap));
  const auto unused = [&](const char* name, const std::string& value, bool used) {
    if (!used && !value.empty()) options.unused.push_back(name);
  };
  options.verify_paths = raw.verify_paths;
  if (options.verify_paths && (options.time || options.error)) throw UsageError("--verify-paths is limited by --samples only");
  unused("-o", raw.output, program.has_image && !options.verify_paths);
  unused("--preview", raw.preview, program.has_image && !options.verify_paths);
  unused("--stats", raw.stats, !options.verify_paths);
  unused("--size", raw.size, program.uses_camera());
  unused("--camera", raw.camera, program.uses_camera());
  unused("--lightmap-size", raw.lightmap_size, !program.lightmaps.empty() && !options.verify_paths);
  options.sets = raw.sets;
  for (const std::string& text : raw.sets) apply_set(text, program);
  return options;
}

PictureSize picture_size(const Options& options, float aspect) {
  if (options.width > 0) return {options.width, options.height};
  constexpr float kMostAspect = kDefaultSide;
  if (!(aspect >= 1 / kMostAspect && aspect <= kMostAspect)) return {kDefaultSide, kDefaultSide * 3 / 4};
  const auto scaled = [](float factor) { return std::max(static_cast<int>(std::lround(kDefaultSide * factor)), 1); };
  if (aspect >= 1) return {kDefaultSide, scaled(1 / aspect)};
  return {scaled(aspect), kDefaultSide};
}

}  // namespace ln
