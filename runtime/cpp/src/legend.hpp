#pragma once
// A colour bar with numbers, beside pictures whose colours stand for values.

#include <string>
#include <vector>

#include "ln/math.hpp"
#include "ln/parallel.hpp"

namespace ln {

/// Rows of (r, g, b) bytes, top first.
struct BytePicture {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;

  BytePicture(int width, int height)
      : width(width), height(height), rgb(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}
  unsigned char* at(int x, int y) {
    return &rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x))];
  }
};

/// The smallest of 1, 2, 4, 5, 8 times a power of ten that is not below `value`, as quarters of these are short numbers.
double round_up(double value);

/// The picture with a colour bar at its right: from `colour(0)` at the bottom, for the value 0, to `colour(1)` for `top`, with
/// four equal steps. `title` and `unit` stand above. A low picture gets black below it.
BytePicture with_legend(const BytePicture& picture, FunctionRef<Color(float)> colour, double top, const std::string& title,
                        const std::string& unit);

}  // namespace ln
