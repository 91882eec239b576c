// The image decoder: the only part that uses OpenImageIO. Built as a shared object and embedded in the runtime library.

#include <fcntl.h>
#include <unistd.h>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "../src/image_plugin.hpp"

namespace {

/// Limits that hold whatever the caller allows: OpenImageIO checks them before it allocates.
void set_limits() {
  OIIO::attribute("plugin_searchpath", "");
  OIIO::attribute("limits:channels", 64);
  OIIO::attribute("limits:imagesize_MB", 4096);
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", -1);
}

/// libpng prints its errors to stderr besides reporting them: this keeps them from the terminal while an image is decoded.
class QuietStderr {
 public:
  QuietStderr() : saved_(fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3)) {
    const int nowhere = saved_ >= 0 ? open("/dev/null", O_WRONLY | O_CLOEXEC) : -1;
    if (nowhere < 0) return;
    dup2(nowhere, STDERR_FILENO);
    close(nowhere);
  }
  ~QuietStderr() {
    if (saved_ < 0) return;
    dup2(saved_, STDERR_FILENO);
    close(saved_);
  }
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  int saved_;
};

void read(const void* bytes, std::size_t size, const char* format, ln::LnImageAllocate allocate, void* context) {
  OIIO::Filesystem::IOMemReader file(const_cast<void*>(bytes), size);
  const auto input = OIIO::ImageInput::create(format);
  if (!input) throw std::runtime_error("there is no decoder for " + std::string(format) + ": " + OIIO::geterror());
  OIIO::ImageSpec config, spec;
  config.attribute("oiio:UnassociatedAlpha", 1);
  if (!input->set_ioproxy(&file) || !input->open(std::string("image.") + format, spec, config))
    throw std::runtime_error(input->geterror());
  if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1 || spec.nchannels <= 0)
    throw std::runtime_error("the image has no pixels");

  const bool is_8_bit = spec.format.basetype == OIIO::TypeDesc::UINT8;
  const int kind = is_8_bit ? 0 : spec.format.is_floating_point() ? 1 : 2;
  const int channels = std::min(spec.nchannels, 4);
  void* pixels = allocate(context, spec.width, spec.height, channels, kind);
  if (pixels == nullptr) throw std::runtime_error("refused");
  if (!input->read_image(0, 0, 0, channels, is_8_bit ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT, pixels))
    throw std::runtime_error(input->geterror());
  input->close();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) int ln_image_read(const void* bytes, std::size_t size, const char* format,
                                                                    ln::LnImageAllocate allocate, void* context, char* message,
                                                                    std::size_t message_size) {
  try {
    static const bool limited = (set_limits(), true);
    (void)limited;
    const QuietStderr quiet;
    read(bytes, size, format, allocate, context);
    return 0;
  } catch (const std::exception& error) {
    std::snprintf(message, message_size, "%s", error.what());
  } catch (...) {
    std::snprintf(message, message_size, "unknown failure");
  }
  return 1;
}
