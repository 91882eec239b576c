#pragma once
// A small picture for looking at while a render runs.

#include <string>

#include "ln/options.hpp"

namespace ln {

class Film;

/// Writes an 8-bit sRGB PNG. Exposure follows the picture (its log-average luminance becomes 18 % grey), highlights are
/// compressed (Reinhard et al. 2002, "Photographic Tone Reproduction", eq. (4)). Of a difference: its luminance from black (0)
/// by red and yellow to white (199 of 200 pixels are below it), with a legend at its right. Throws Error.
void write_preview(const std::string& path, const Film& film, Units units = Units::radiometric);

}  // namespace ln
