#include "point_table.hpp"

#include <charconv>

#include "ln/output_file.hpp"
#include "ln/text.hpp"
#include "srgb.hpp"

namespace ln {

namespace {

float exposure(const PointTable& table) {
  double sum = 0;
  for (std::size_t row = 0; row < table.rows; ++row) sum += static_cast<double>(max_component(table.colour(row)));
  return sum > 0 ? static_cast<float>(std::clamp(0.5 * static_cast<double>(table.rows) / sum, 1e-30, 1e30)) : 1.0f;
}

void write_ply(const TapFile& tap, const PointTable& table) {
  const float scale = exposure(table);
  OutputFile file(tap.info.file);
  file.write("ply\nformat binary_little_endian 1.0\ncomment " + table.title + " of '" + printable(tap.info.wire) +
             "' in the network '" + printable(tap.network) + "', light paths " + printable(tap.info.light_paths, 1000) +
             "\ncomment " + table.units + "; colours are sRGB of " + table.shown + " * " +
             number_text(static_cast<double>(scale)) + "\nelement vertex " + std::to_string(table.rows) + "\n");
  for (const PointTable::Column& column : table.columns)
    file.write((column.integer ? "property uint " : "property float ") + column.name + "\n");
  file.write("property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
  std::vector<double> values;
  for (std::size_t row = 0; row < table.rows; ++row) {
    values.clear();
    table.fill(row, values);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto number = static_cast<float>(values[i]);
      const auto integer = static_cast<std::uint32_t>(values[i]);
      table.columns[i].integer ? file.write(&integer, sizeof integer) : file.write(&number, sizeof number);
    }
    const Color c = table.colour(row) * scale;
    const unsigned char bytes[] = {srgb_byte(c.x), srgb_byte(c.y), srgb_byte(c.z)};
    file.write(bytes, sizeof bytes);
  }
  file.commit();
}

void write_csv(const TapFile& tap, const PointTable& table) {
  constexpr int kDigits = 9;  // tell any two floats apart, and numbers below 10^9
  OutputFile file(tap.info.file);
  for (const PointTable::Column& column : table.columns) file.write((&column == table.columns.data() ? "" : ",") + column.name);
  file.write("\n");
  std::vector<double> values;
  std::string line;
  for (std::size_t row = 0; row < table.rows; ++row) {
    values.clear();
    table.fill(row, values);
    line.clear();
    for (const double value : values) {
      char text[32];
      line.append(text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, kDigits).ptr).push_back(',');
    }
    line.back() = '\n';
    file.write(line);
  }
  file.commit();
}

}  // namespace

void write_points(const TapFile& tap, const PointTable& table) {
  tap.is(".csv") ? write_csv(tap, table) : write_ply(tap, table);
}

}  // namespace ln
