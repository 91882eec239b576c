#pragma once
// What the library and the image plug-in say to each other: plain C, as they may be built by different compilers.

#include <cstddef>

namespace ln {

extern "C" {

/// Asked for the memory of the pixels once their number is known; `is_float` is 0 for 8-bit data, 1 for float, 2 for float
/// that was integers in the file. Returns null to refuse.
using LnImageAllocate = void* (*)(void* context, int width, int height, int channels, int is_float);

/// Decodes an image into the memory that `allocate` gives. `format` is OpenImageIO's name of it: png, jpeg, hdr, openexr.
/// Returns 0, or 1 after writing a message.
using LnImageRead = int (*)(const void* bytes, std::size_t size, const char* format, LnImageAllocate allocate, void* context,
                            char* message, std::size_t message_size);
}

inline constexpr const char* kImageReadSymbol = "ln_image_read";

}  // namespace ln
