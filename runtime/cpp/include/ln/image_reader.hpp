#pragma once
// Decoding of PNG, JPEG, Radiance HDR and OpenEXR files.
//
// The decoder uses OpenImageIO, which loads hundreds of shared objects; so it is a plug-in, embedded in this library and
// opened when the first image is decoded.

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "ln/error.hpp"
#include "ln/scene_data.hpp"

namespace ln {

/// Decodes an image from the bytes of its file: 8-bit data stays 8-bit, everything else becomes float. `srgb` says that the
/// colours of an integer format are sRGB-encoded; it becomes Image::srgb for 8-bit data, and 16-bit data is made linear.
/// `claim` is called with the size of the pixels [bytes] before they are allocated and may throw to refuse them.
/// Throws Error with the cause alone. Alpha is not premultiplied.
Image decode_image(std::span<const std::uint8_t> bytes, bool srgb, const std::function<void(double)>& claim = {});

/// Reads an image file that the user named, such as a latitude-longitude environment; colours of integer formats count as
/// sRGB-encoded. Throws Error "<path>: <cause>".
Image read_image_file(const std::string& path);

}  // namespace ln
