#pragma once
// Points with numbers, written as a point cloud (PLY) or as a table (CSV).

#include <string>
#include <vector>

#include "ln/math.hpp"
#include "ln/parallel.hpp"
#include "ln/tap.hpp"

namespace ln {

/// Points in world coordinates, each a row of numbers; the first three are its place.
struct PointTable {
  struct Column {
    std::string name;
    bool integer = false;  // in a PLY: `uint` instead of `float`
  };

  std::string title, units;  // what the points are; what the columns are
  std::string shown;         // what their colours show
  std::vector<Column> columns;
  std::size_t rows = 0;
  FunctionRef<void(std::size_t row, std::vector<double>& values)> fill;  // appends a value a column
  FunctionRef<Color(std::size_t row)> colour;                            // linear, of any brightness; for PLY only
};

/// Writes the file of a tap, by its suffix. In a PLY (binary, little endian) each point has an sRGB colour, too, with an
/// exposure that makes the mean of the largest channels half of white. Numbers of a CSV tell any two floats apart. Throws
/// Error.
void write_points(const TapFile& tap, const PointTable& table);

}  // namespace ln
