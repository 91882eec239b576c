#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "../src/legend.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace ln;

namespace {

Color grey(float x) { return Color(x); }

BytePicture ramp(int width, int height) {
  BytePicture picture(width, height);
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) picture.rgb[i] = static_cast<unsigned char>(i % 251);
  return picture;
}

}  // namespace

TEST_CASE("numbers of a legend are round, and not below what is to be shown") {
  for (const auto& [value, expected] : {std::pair{0.93, 1.0},
                                        {1.0, 1.0},
                                        {1.2, 2.0},
                                        {3.1, 4.0},
                                        {4.4, 5.0},
                                        {6.0, 8.0},
                                        {8.5, 10.0},
                                        {0.0021, 0.004},
                                        {3e-37, 4e-37},
                                        {7e20, 8e20}})
    CHECK(round_up(value) == doctest::Approx(expected));
}

TEST_CASE("a legend stands beside the picture, which stays as it is") {
  for (const int height : {3, 40, 300}) {
    BytePicture picture = ramp(17, height), all = with_legend(picture, grey, 2, "|a-b|", "W/(m2 sr)");
    CHECK(all.width > picture.width + 50);
    CHECK(all.height >= height);
    if (height == 300) CHECK(all.height == 300);
    bool same = true, black_below = true;
    for (int y = 0; y < all.height; ++y)
      for (int x = 0; x < picture.width; ++x)
        for (int i = 0; i < 3; ++i) {
          const unsigned char found = all.at(x, y)[i];
          if (y < height)
            same = same && found == picture.at(x, y)[i];
          else
            black_below = black_below && found == 0;
        }
    CHECK(same);
    CHECK(black_below);
  }
}

TEST_CASE("the bar falls from the largest value at its top to zero, with five numbers beside it") {
  BytePicture all = with_legend(ramp(10, 100), grey, 2, "", "");
  const int column = 10 + 6 + 1;  // inside of the bar
  std::vector<int> bar;
  for (int y = 0; y < all.height; ++y)
    if (all.at(column, y)[0] > 0) bar.push_back(all.at(column, y)[0]);
  REQUIRE(bar.size() > 50);
  CHECK(std::is_sorted(bar.rbegin(), bar.rend()));
  CHECK(bar.front() > 250);
  CHECK(bar.back() < 5);
  int rows_of_numbers = 0;
  bool before = false;
  for (int y = 0; y < all.height; ++y) {
    bool lit = false;
    for (int x = column + 18; x < all.width; ++x) lit = lit || all.at(x, y)[0] > 0;
    rows_of_numbers += lit && !before;
    before = lit;
  }
  CHECK(rows_of_numbers == 5);
}
