#include "ln/sensors.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "gltf_files.hpp"
#include "ln/error.hpp"
#include "ln/text.hpp"

namespace ln {

namespace {

constexpr std::array<std::string_view, 6> kColumns{"x", "y", "z", "nx", "ny", "nz"};
constexpr const char* kWanted = "a sensor needs x,y,z,nx,ny,nz";

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// What stands between the quotation marks of a field, if there are any.
std::string_view unquoted(std::string_view field) {
  return field.size() >= 2 && field.front() == '"' && field.back() == '"' ? trimmed(field.substr(1, field.size() - 2)) : field;
}

std::optional<double> parse_number(std::string_view field) {
  std::string_view text = unquoted(field);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class Reader {
 public:
  explicit Reader(const std::string& path) { file_.path = path; }

  SensorFile read(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    while (!text.empty()) {
      ++line_;
      const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
      read_line(trimmed(text.substr(0, end)));
      text.remove_prefix(end);
      if (!text.empty()) text.remove_prefix(text.starts_with("\r\n") ? 2 : 1);
    }
    if (file_.sensors.empty()) throw Error(printable(file_.path) + ": holds no sensors; each row is one: x,y,z,nx,ny,nz");
    return std::move(file_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw Error(printable(file_.path) + ":" + std::to_string(line_) + ": " + message);
  }

  void read_line(std::string_view line) {
    if (line.empty() || line[0] == '#') return;
    split(line);
    if (!named_) {
      named_ = true;
      if (std::none_of(fields_.begin(), fields_.end(), parse_number)) return read_header();
      if (fields_.size() != kColumns.size())
        fail(count_text(fields_.size(), "value") + " without a row of names above; " + kWanted);
      use_columns({kColumns.begin(), kColumns.end()});
      file_.header = "x,y,z,nx,ny,nz";
    }
    read_row();
  }

  /// Fields at the commas that are not in quotation marks.
  void split(std::string_view line) {
    fields_.clear();
    std::size_t begin = 0;
    bool quoted = false;
    for (std::size_t i = 0; i <= line.size(); ++i) {
      if (i < line.size() && line[i] == '"') quoted = !quoted;
      if (i < line.size() && (quoted || line[i] != ',')) continue;
      fields_.push_back(trimmed(line.substr(begin, i - begin)));
      begin = i + 1;
    }
    if (quoted) fail("a quotation mark is not closed on its line");
    if (fields_.size() == 1 && line.find_first_of(";\t ") != std::string_view::npos)
      fail(std::string("columns are separated by commas; ") + kWanted);
  }

  void read_header() {
    std::vector<std::string_view> names;
    for (const std::string_view field : fields_) names.push_back(unquoted(field));
    use_columns(names);
    file_.header = kept_text();
  }

  void use_columns(const std::vector<std::string_view>& names) {
    const auto same = [](std::string_view a, std::string_view b) {
      return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char p, char q) { return (p | 0x20) == (q | 0x20); });
    };
    place_.fill(kNone);
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (std::size_t k = 0; k < kColumns.size(); ++k) {
        if (!same(names[i], kColumns[k])) continue;
        if (place_[k] != kNone) fail("two columns are called " + quoted(kColumns[k]));
        place_[k] = i;
      }
      kept_.push_back(std::find(std::begin(kResultColumns), std::end(kResultColumns), names[i]) == std::end(kResultColumns));
    }
    std::string missing;
    for (std::size_t k = 0; k < kColumns.size(); ++k)
      if (place_[k] == kNone) missing += (missing.empty() ? "" : ", ") + std::string(kColumns[k]);
    if (!missing.empty()) fail("no column is called " + missing + "; " + kWanted);
  }

  std::string kept_text() const {
    std::string text;
    bool first = true;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (!kept_[i]) continue;
      text += (first ? "" : ",") + std::string(fields_[i]);
      first = false;
    }
    return text;
  }

  void read_row() {
    if (fields_.size() != kept_.size())
      fail(count_text(fields_.size(), "value") + " where there are " + count_text(kept_.size(), "column"));
    double values[kColumns.size()];
    for (std::size_t k = 0; k < kColumns.size(); ++k) {
      const std::string_view field = fields_[place_[k]];
      const std::optional<double> number = parse_number(field);
      if (!number || !std::isfinite(*number)) fail(std::string(kColumns[k]) + " must be a finite number, not " + quoted(field));
      values[k] = *number;
    }
    const DVec3 normal(values[3], values[4], values[5]);
    const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
    if (largest == 0) fail("the normal nx,ny,nz is zero; it says which way the sensor looks");
    const Vec3 unit(glm::normalize(normal / largest));
    file_.sensors.push_back({DVec3(values[0], values[1], values[2]), unit, line_, kept_text()});
  }

  static std::string count_text(std::size_t n, const char* what) {
    return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  SensorFile file_;
  std::size_t line_ = 0;
  bool named_ = false;
  std::vector<std::string_view> fields_;              // of the present line
  std::array<std::size_t, kColumns.size()> place_{};  // of x, y, ... among them
  std::vector<bool> kept_;                            // by field
};

}  // namespace

SensorFile read_sensors(const std::string& path) {
  gltf::MemoryBudget memory(0);
  const gltf::Bytes bytes = gltf::read_file(path, memory);
  return Reader(path).read(bytes.text());
}

}  // namespace ln
