#include "ln/preview.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

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

/// A picture without colours of its own: from black by red and yellow to white.
Color heat(float x) { return glm::clamp(Color(3 * x, 3 * x - 1, 3 * x - 2), 0.0f, 1.0f); }

/// The luminance that all but one in two hundred pixels stay below: the few beyond it are mostly noise.
float white_of_difference(const Film& film) {
  std::vector<float> all;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) all.push_back(luminance(film.mean(x, y)));
  const auto place = all.begin() + static_cast<std::ptrdiff_t>((all.size() - 1) * 199 / 200);
  std::nth_element(all.begin(), place, all.end());
  return std::max(*place, 1e-37f);
}

}  // namespace

void write_preview(const std::string& path, const Film& film) {
  const bool differs = film.shows_difference();
  const float scale = differs ? 1 / white_of_difference(film) : exposure(film);
  std::vector<unsigned char> bytes;
  bytes.reserve(3 * static_cast<std::size_t>(film.width()) * static_cast<std::size_t>(film.height()));
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const Color c = glm::min(film.mean(x, y) * scale, Color(1e30f));
      if (differs) {
        const Color shown = heat(luminance(c));
        for (std::size_t i = 0; i < 3; ++i) bytes.push_back(static_cast<unsigned char>(255 * shown[i] + 0.5f));
        continue;
      }
      const float brightness = std::min(luminance(c), 1e15f);
      const float factor = brightness > 0 ? compress(brightness) / brightness : 0;
      for (std::size_t i = 0; i < 3; ++i) bytes.push_back(srgb_byte(c[i] * factor));
    }
  }
  const std::vector<unsigned char> png = png_bytes(film.width(), film.height(), bytes);
  write_output_file(path, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace ln
