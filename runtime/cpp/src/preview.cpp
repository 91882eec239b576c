#include "ln/preview.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "legend.hpp"
#include "ln/film.hpp"
#include "ln/output_file.hpp"
#include "png.hpp"
#include "srgb.hpp"

namespace ln {

namespace {

/// Factor that makes the log-average luminance of what is not black 18 % grey.
float exposure(const Film& film) {
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const float value = luminance(film.mean(x, y));
      if (!(value > 0)) continue;
      sum += std::log(static_cast<double>(value));
      ++count;
    }
  }
  if (count == 0) return 1;
  return static_cast<float>(std::clamp(0.18 / std::exp(sum / static_cast<double>(count)), 1e-37, 1e37));
}

/// Reinhard et al. 2002, eq. (4): nearly linear in the dark, white from luminance 4 on.
float compress(float luminance) {
  constexpr float kWhite = 4;
  return luminance * (1 + luminance / (kWhite * kWhite)) / (1 + luminance);
}

/// Of values without a colour: from black by red and yellow to white.
Color heat(float x) { return glm::clamp(Color(3 * x, 3 * x - 1, 3 * x - 2), 0.0f, 1.0f); }

/// The luminance that all but one in two hundred pixels stay below, since the few beyond it are mostly noise; a round number.
double white_of_difference(const Film& film) {
  std::vector<float> all;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) all.push_back(luminance(film.mean(x, y)));
  const auto place = all.begin() + static_cast<std::ptrdiff_t>((all.size() - 1) * 199 / 200);
  std::nth_element(all.begin(), place, all.end());
  return round_up(static_cast<double>(std::max(*place, 1e-37f)));
}

BytePicture tone_mapped(const Film& film) {
  const float scale = exposure(film);
  BytePicture picture(film.width(), film.height());
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const Color c = glm::min(film.mean(x, y) * scale, Color(1e30f));
      const float brightness = std::min(luminance(c), 1e15f);
      const float factor = brightness > 0 ? compress(brightness) / brightness : 0;
      for (int i = 0; i < 3; ++i) picture.at(x, y)[i] = srgb_byte(c[i] * factor);
    }
  }
  return picture;
}

BytePicture difference_with_legend(const Film& film, Units units) {
  const double white = white_of_difference(film);
  BytePicture picture(film.width(), film.height());
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const Color shown = heat(static_cast<float>(static_cast<double>(luminance(film.mean(x, y))) / white));
      for (int i = 0; i < 3; ++i) picture.at(x, y)[i] = static_cast<unsigned char>(255 * shown[i] + 0.5f);
    }
  }
  return with_legend(picture, heat, white, "|a-b|", units == Units::photometric ? "cd/m2" : "W/(m2 sr)");
}

}  // namespace

void write_preview(const std::string& path, const Film& film, Units units) {
  const BytePicture picture = film.shows_difference() ? difference_with_legend(film, units) : tone_mapped(film);
  const std::vector<unsigned char> png = png_bytes(picture.width, picture.height, picture.rgb);
  write_output_file(path, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace ln
