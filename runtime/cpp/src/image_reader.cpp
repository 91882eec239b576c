#include "ln/image_reader.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string_view>

#include "gltf_files.hpp"
#include "image_plugin.hpp"
#include "ln/text.hpp"
#include "ln/texture.hpp"

extern "C" {
extern const unsigned char ln_image_plugin_begin[];
extern const unsigned char ln_image_plugin_end[];
}

namespace ln {
namespace {

// ---------------------------------------------------------------- the plug-in

bool write_all(int descriptor, const unsigned char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t done = write(descriptor, bytes, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    bytes += done;
    size -= static_cast<std::size_t>(done);
  }
  return true;
}

/// Writes the plug-in into `descriptor` and opens it from there under the name `path`.
void* open_plugin_from(int descriptor, const std::string& path) {
  if (descriptor < 0) return nullptr;
  const bool written =
      write_all(descriptor, ln_image_plugin_begin, static_cast<std::size_t>(ln_image_plugin_end - ln_image_plugin_begin));
  void* library = written ? dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL) : nullptr;
  close(descriptor);
  return library;
}

LnImageRead open_plugin() {
  const int memory = memfd_create("ln_image_reader", MFD_CLOEXEC);
  void* library = open_plugin_from(memory, "/proc/self/fd/" + std::to_string(memory));
  const char* cause = library == nullptr ? dlerror() : nullptr;
  if (library == nullptr) {
    // No /proc, or no memory files: a private file for a moment.
    const std::string first_cause = cause == nullptr ? "no memory file" : cause;
    const char* folder = std::getenv("TMPDIR");
    std::string path = std::string(folder == nullptr || *folder == '\0' ? "/tmp" : folder) + "/ln_image_reader_XXXXXX";
    const int file = mkstemp(path.data());
    library = open_plugin_from(file, path);
    if (file >= 0) unlink(path.c_str());
    if (library == nullptr)
      throw Error("the image reader cannot be opened (is OpenImageIO installed?): " + printable(first_cause));
  }
  const auto read = reinterpret_cast<LnImageRead>(dlsym(library, kImageReadSymbol));
  if (read == nullptr) throw Error("the image reader is not complete");
  return read;
}

// ---------------------------------------------------------------- decoding

/// OpenImageIO's name of the format, from the first bytes; null if it is none of ours.
const char* image_format(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\x89PNG\r\n\x1a\n")) return "png";
  if (text.starts_with("\xff\xd8\xff")) return "jpeg";
  if (text.starts_with("#?RADIANCE") || text.starts_with("#?RGBE")) return "hdr";
  if (text.starts_with("\x76\x2f\x31\x01")) return "openexr";
  return nullptr;
}

struct Target {
  Image image;
  bool was_integer = false;
  const std::function<void(double)>& claim;
  std::exception_ptr refusal;
};

void* allocate(void* context, int width, int height, int channels, int is_float) {
  auto& target = *static_cast<Target*>(context);
  try {
    const double values = static_cast<double>(width) * height * channels;
    if (target.claim) target.claim(is_float != 0 ? values * sizeof(float) : values);
    Image& image = target.image;
    image.width = width;
    image.height = height;
    image.channels = channels;
    target.was_integer = is_float != 1;
    if (is_float == 0) {
      image.bytes.resize(static_cast<std::size_t>(values));
      return image.bytes.data();
    }
    image.floats.resize(static_cast<std::size_t>(values));
    return image.floats.data();
  } catch (...) {
    target.refusal = std::current_exception();
    return nullptr;
  }
}

void make_linear(Image& image) {
  const int colors = image.channels < 3 ? 1 : 3;
  for (std::size_t i = 0; i < image.floats.size(); ++i) {
    if (static_cast<int>(i % static_cast<std::size_t>(image.channels)) >= colors) continue;
    image.floats[i] = srgb_to_linear(image.floats[i]);
  }
}

/// What cannot be a colour becomes 0; what float cannot hold stays finite.
void make_finite(Image& image) {
  for (float& x : image.floats) {
    if (std::isnan(x)) x = 0;
    x = std::clamp(x, -std::numeric_limits<float>::max(), std::numeric_limits<float>::max());
  }
}

}  // namespace

Image decode_image(std::span<const std::uint8_t> bytes, bool srgb, const std::function<void(double)>& claim) {
  const char* format = image_format(bytes);
  if (format == nullptr) throw Error("is not an image in PNG, JPEG, Radiance HDR or OpenEXR format");
  static const LnImageRead read = open_plugin();
  Target target{{}, false, claim, nullptr};
  std::array<char, 400> message{};
  const int failed = read(bytes.data(), bytes.size(), format, allocate, &target, message.data(), message.size());
  if (target.refusal) std::rethrow_exception(target.refusal);
  if (failed != 0) throw Error("cannot be decoded: " + printable(message.data()));
  make_finite(target.image);
  if (srgb && target.was_integer && !target.image.floats.empty()) make_linear(target.image);
  target.image.srgb = srgb && !target.image.bytes.empty();
  return std::move(target.image);
}

Image read_image_file(const std::string& path) {
  gltf::MemoryBudget memory(0);
  const gltf::Bytes file = gltf::read_file(path, memory);
  try {
    return decode_image(file.span(), true, [&](double size) { memory.claim(size, "the decoded image"); });
  } catch (const Error& error) {
    throw Error(printable(path) + ": " + error.what());
  }
}

}  // namespace ln
