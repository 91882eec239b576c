#include "legend.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace ln {

namespace {

constexpr int kGlyphWidth = 5, kGlyphHeight = 7, kAdvance = kGlyphWidth + 1;

/// A letter as rows of five pixels, the leftmost in bit 4.
struct Glyph {
  char letter;
  unsigned char rows[kGlyphHeight];
};
constexpr Glyph kGlyphs[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},      {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'3', {31, 2, 4, 2, 1, 17, 14}},     {'4', {2, 6, 10, 18, 31, 2, 2}},     {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},       {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},   {'.', {0, 0, 0, 0, 0, 12, 12}},      {'-', {0, 0, 0, 31, 0, 0, 0}},
    {'+', {0, 4, 4, 31, 4, 4, 0}},       {'|', {4, 4, 4, 4, 4, 4, 4}},        {'/', {0, 1, 2, 4, 8, 16, 0}},
    {'(', {2, 4, 8, 8, 8, 4, 2}},        {')', {8, 4, 2, 2, 2, 4, 8}},        {'a', {0, 0, 14, 1, 15, 17, 15}},
    {'b', {16, 16, 22, 25, 17, 17, 30}}, {'c', {0, 0, 14, 16, 16, 17, 14}},   {'d', {1, 1, 13, 19, 17, 17, 15}},
    {'e', {0, 0, 14, 17, 31, 16, 14}},   {'m', {0, 0, 26, 21, 21, 17, 17}},   {'r', {0, 0, 22, 25, 16, 16, 16}},
    {'s', {0, 0, 14, 16, 14, 1, 30}},    {'W', {17, 17, 17, 21, 21, 21, 10}},
};

/// White letters; those without a glyph are blank.
void draw_text(BytePicture& picture, int x, int y, std::string_view text) {
  for (const char letter : text) {
    const auto* glyph =
        std::find_if(std::begin(kGlyphs), std::end(kGlyphs), [&](const Glyph& g) { return g.letter == letter; });
    for (int row = 0; glyph != std::end(kGlyphs) && row < kGlyphHeight; ++row)
      for (int column = 0; column < kGlyphWidth; ++column)
        if (glyph->rows[row] >> (kGlyphWidth - 1 - column) & 1) std::fill_n(picture.at(x + column, y + row), 3, 255);
    x += kAdvance;
  }
}

}  // namespace

double round_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 4.0, 5.0, 8.0})
    if (digit * power >= value) return digit * power;
  return 10 * power;
}

BytePicture with_legend(const BytePicture& picture, FunctionRef<Color(float)> colour, double top, const std::string& title,
                        const std::string& unit) {
  constexpr int kMargin = 6, kBarWidth = 12, kSteps = 4, kLine = kGlyphHeight + 3, kLongestNumber = 9;
  constexpr int kTop = kMargin + 2 * kLine + kGlyphHeight / 2,
                kLowest = kTop + kSteps * (kLine + 2) + kMargin + kGlyphHeight / 2;
  const int letters =
      std::max({kLongestNumber + 3, static_cast<int>(title.size()), static_cast<int>(unit.size())});  // 3: bar and tick
  BytePicture all(picture.width + 2 * kMargin + letters * kAdvance, std::max(picture.height, kLowest));
  for (int y = 0; y < picture.height; ++y)
    std::copy_n(&picture.rgb[3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width)], 3 * picture.width,
                all.at(0, y));

  const int left = picture.width + kMargin, length = all.height - kTop - kMargin - kGlyphHeight / 2;
  draw_text(all, left, kMargin, title);
  draw_text(all, left, kMargin + kLine, unit);
  for (int y = 0; y < length; ++y) {
    const Color c = colour(1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(length));
    for (int x = 0; x < kBarWidth; ++x)
      for (int i = 0; i < 3; ++i) all.at(left + x, kTop + y)[i] = static_cast<unsigned char>(255 * c[i] + 0.5f);
  }
  for (int step = 0; step <= kSteps; ++step) {
    const int y = kTop + (length - 1) * (kSteps - step) / kSteps;
    for (int x = 0; x < 4; ++x) std::fill_n(all.at(left + kBarWidth + x, y), 3, 255);
    char number[24];
    std::snprintf(number, sizeof number, "%.3g", top * step / kSteps);
    draw_text(all, left + kBarWidth + kAdvance, y - kGlyphHeight / 2, number);
  }
  return all;
}

}  // namespace ln
