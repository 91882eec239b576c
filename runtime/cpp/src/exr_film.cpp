#include "ln/exr_film.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "ln/error.hpp"
#include "ln/film.hpp"
#include "ln/output_file.hpp"
#include "ln/parallel.hpp"
#include "ln/program.hpp"
#include "ln/progress.hpp"

namespace ln {

namespace {

/// Lets OpenEXR write through our writer.
class ExrStream final : public Imf::OStream {
 public:
  explicit ExrStream(OutputFile& file) : OStream(file.path().c_str()), file_(file) {}
  void write(const char bytes[], int size) override { file_.write(bytes, static_cast<std::size_t>(size)); }
  std::uint64_t tellp() override { return file_.position(); }
  void seekp(std::uint64_t position) override { file_.seek(position); }

 private:
  OutputFile& file_;
};

/// Threads of OpenEXR for the time of a file; blocks come out in the same order with any number of them.
class CompressionThreads {
 public:
  explicit CompressionThreads(int threads) { Imf::setGlobalThreadCount(threads > 1 ? threads : 0); }
  ~CompressionThreads() { Imf::setGlobalThreadCount(0); }
};

Imf::Header make_header(int width, int height, const std::vector<std::string>& channels, const ExrMetadata& metadata) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const std::string& channel : channels) header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
  Imf::addChromaticities(header, Imf::Chromaticities());  // Rec. 709
  for (const auto& [name, value] : metadata) {
    if (const auto* number = std::get_if<std::int32_t>(&value)) {
      header.insert(name, Imf::IntAttribute(*number));
    } else {
      header.insert(name, Imf::StringAttribute(std::get<std::string>(value)));
    }
  }
  return header;
}

/// Writes the file strip by strip; `fill(y, row)` puts channel values of row y side by side, pixel by pixel.
void write_rows(const std::string& path, int width, int height, const std::vector<std::string>& channels,
                const ExrMetadata& metadata, int threads, FunctionRef<void(int y, float* row)> fill) {
  OutputFile file(path);
  const CompressionThreads compression(threads);
  try {
    ExrStream stream(file);
    Imf::OutputFile picture(stream, make_header(width, height, channels, metadata));
    constexpr int kBlockRows = 16;  // that ZIP compresses together
    const int strip_rows = std::min(height, kBlockRows * 2 * std::max(threads, 1));
    const std::size_t pixel_bytes = channels.size() * sizeof(float), row_bytes = pixel_bytes * static_cast<std::size_t>(width);
    std::vector<float> strip(channels.size() * static_cast<std::size_t>(width) * static_cast<std::size_t>(strip_rows));
    for (int y0 = 0; y0 < height; y0 += strip_rows) {
      const int rows = std::min(strip_rows, height - y0);
      for (int y = 0; y < rows; ++y) fill(y0 + y, strip.data() + static_cast<std::size_t>(y) * row_bytes / sizeof(float));
      // OpenEXR wants the address that pixel (0, 0) would have.
      char* origin =
          reinterpret_cast<char*>(reinterpret_cast<std::uintptr_t>(strip.data()) - static_cast<std::size_t>(y0) * row_bytes);
      Imf::FrameBuffer buffer;
      for (std::size_t c = 0; c < channels.size(); ++c) {
        buffer.insert(channels[c], Imf::Slice(Imf::FLOAT, origin + c * sizeof(float), pixel_bytes, row_bytes));
      }
      picture.setFrameBuffer(buffer);
      picture.writePixels(rows);
    }
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    file.write({});  // says it better, if it was the file that failed
    throw Error(path + ": cannot write: " + error.what());
  }
  file.commit();
}

void add_channels(std::vector<std::string>& channels, const std::string& prefix) {
  for (const char* channel : {"R", "G", "B"}) channels.push_back(prefix + channel);
}

}  // namespace

void write_exr(const std::string& path, const Film& film, const ProgramInfo& program, const ExrMetadata& metadata,
               int threads) {
  ExrMetadata attributes{{"network", std::string(program.network)}, {"lightPaths", std::string(program.image_paths)}};
  std::vector<std::string> channels;
  add_channels(channels, "");
  std::vector<int> shown{Film::kPicture};
  for (std::size_t i = 0; i < program.layers.size(); ++i) {
    const LayerInfo& layer = program.layers[i];
    if (layer.file) continue;
    shown.push_back(static_cast<int>(i));
    add_channels(channels, std::string(layer.name) + ".");
    attributes.emplace_back("lightPaths." + std::string(layer.name), std::string(layer.light_paths));
  }
  attributes.insert(attributes.end(), metadata.begin(), metadata.end());

  write_rows(path, film.width(), film.height(), channels, attributes, threads, [&](int y, float* row) {
    for (int x = 0; x < film.width(); ++x) {
      for (const int layer : shown) {
        const Color value = film.mean(x, y, layer);
        for (std::size_t i = 0; i < 3; ++i) *row++ = value[i];
      }
    }
  });
}

void write_exr(const std::string& path, int width, int height, const float* rgb, const ExrMetadata& metadata, bool is_signed) {
  std::vector<std::string> channels;
  add_channels(channels, "");
  std::size_t repaired = 0;
  write_rows(path, width, height, channels, metadata, 1, [&](int y, float* row) {
    const std::size_t values = 3 * static_cast<std::size_t>(width);
    const float* source = rgb + static_cast<std::size_t>(y) * values;
    for (std::size_t i = 0; i < values; ++i) {
      const bool good = (std::bit_cast<std::uint32_t>(source[i]) & 0x7fffffffu) < 0x7f800000u && (is_signed || source[i] >= 0);
      row[i] = good ? source[i] : 0;
      repaired += good ? 0 : 1;
    }
  });
  if (repaired > 0) warning(path + ": " + std::to_string(repaired) + " values that no picture may hold were written as 0");
}

}  // namespace ln
