#pragma once
// PNG files in memory.

#include <span>
#include <vector>

namespace ln {

/// Rows of (r, g, b) bytes, top first, as a PNG file.
std::vector<unsigned char> png_bytes(int width, int height, std::span<const unsigned char> rgb);

}  // namespace ln
