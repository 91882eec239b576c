#pragma once
// Pictures as OpenEXR files.

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace ln {

class Film;
struct ProgramInfo;

/// Attributes of the file. Nothing that varies between two runs may be among them: equal pictures are
/// equal files.
using ExrMetadata = std::vector<std::pair<std::string, std::variant<std::string, std::int32_t>>>;

/// Writes the film: channels R, G, B and `layer.R`, ... of part 0, 32-bit float, ZIP. Adds the network's name and its light
/// paths to the attributes. Throws Error.
void write_exr(const std::string& path, const Film& film, const ProgramInfo& program, const ExrMetadata& metadata, int threads);

/// Writes rows of (r, g, b) triples, top first: for wire taps that hold a picture of their own.
/// Values that no picture may hold (not finite; negative unless `is_signed`) are written as 0, with a warning.
void write_exr(const std::string& path, int width, int height, const float* rgb, const ExrMetadata& metadata,
               bool is_signed = false);

}  // namespace ln
