#include "ln/preview.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <vector>

#include "ln/film.hpp"
#include "ln/output_file.hpp"
#include "srgb.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

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

}  // namespace

void write_preview(const std::string& path, const Film& film) {
  const float scale = exposure(film);
  std::vector<unsigned char> bytes;
  bytes.reserve(3 * static_cast<std::size_t>(film.width()) * static_cast<std::size_t>(film.height()));
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const Color c = glm::min(film.mean(x, y) * scale, Color(1e30f));
      const float brightness = std::min(luminance(c), 1e15f);
      const float factor = brightness > 0 ? compress(brightness) / brightness : 0;
      for (std::size_t i = 0; i < 3; ++i) bytes.push_back(srgb_byte(c[i] * factor));
    }
  }
  int size = 0;
  const std::unique_ptr<unsigned char, decltype(&std::free)> png(
      stbi_write_png_to_mem(bytes.data(), 3 * film.width(), film.width(), film.height(), 3, &size), &std::free);
  if (!png) throw std::bad_alloc();
  write_output_file(path, {reinterpret_cast<const char*>(png.get()), static_cast<std::size_t>(size)});
}

}  // namespace ln
