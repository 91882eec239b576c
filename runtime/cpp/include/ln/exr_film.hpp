#pragma once
// Pictures as OpenEXR files.

#include <string>
#include <utility>
#include <vector>

namespace ln {

class Film;
struct ProgramInfo;

/// String attributes of the file in the order given. Nothing that varies between two runs may be among them: equal pictures are
/// equal files.
using ExrMetadata = std::vector<std::pair<std::string, std::string>>;

/// Writes the film: channels R, G, B and `layer.R`, ... of part 0, 32-bit float, ZIP. Throws Error.
void write_exr(const std::string& path, const Film& film, const ProgramInfo& program, const ExrMetadata& metadata, int threads);

/// Writes rows of (r, g, b) triples, top first: for wire taps that hold a picture of their own.
/// With `is_signed`, negative values are kept; other than that the values must be finite and not negative.
void write_exr(const std::string& path, int width, int height, const float* rgb, const ExrMetadata& metadata,
               bool is_signed = false);

}  // namespace ln
