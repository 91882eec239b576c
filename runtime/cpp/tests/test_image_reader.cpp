// Images of every kind that the plug-in decodes, written here byte by byte.

#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <doctest/doctest.h>

#include <array>
#include <string>

#include "gltf_file.hpp"
#include "ln/image_reader.hpp"
#include "ln/texture.hpp"

namespace {

using namespace ln;
using namespace ln::test;

// ---------------------------------------------------------------- a PNG writer

std::string big_endian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
  }
  return ~crc;
}

std::string chunk(const std::string& type, const std::string& data) {
  return big_endian(static_cast<std::uint32_t>(data.size())) + type + data + big_endian(crc32(type + data));
}

/// `rows`: the samples of all rows, one after another, without filter bytes.
std::string png(std::uint32_t width, std::uint32_t height, char depth, char color_type, const std::string& rows,
                const std::string& more_chunks = {}) {
  std::string raw;
  const std::size_t row = height == 0 ? 0 : rows.size() / height;
  for (std::uint32_t y = 0; y < height; ++y) raw += '\0' + rows.substr(y * row, row);
  std::uint32_t a = 1, b = 0;
  for (const char byte : raw) {
    a = (a + static_cast<unsigned char>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  const auto low = static_cast<char>(raw.size()), high = static_cast<char>(raw.size() >> 8);
  const std::string stored = std::string("\x78\x01\x01") + low + high + static_cast<char>(~low) + static_cast<char>(~high) +
                             raw + big_endian(b << 16 | a);
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", big_endian(width) + big_endian(height) + depth + color_type + std::string(3, '\0')) + more_chunks +
         chunk("IDAT", stored) + chunk("IEND", "");
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Image decode(const std::string& file, bool srgb = false) { return decode_image(bytes_of(file), srgb); }

void check_texel(const Image& image, int x, int y, const Vec4& wanted) {
  const Vec4 value = texel(image, x, y);
  for (std::size_t c = 0; c < 4; ++c) CHECK(value[c] == doctest::Approx(wanted[c]).epsilon(1e-5));
}

}  // namespace

TEST_CASE("8-bit PNG: grey, grey with alpha, RGB, RGBA stay as they are") {
  const Image grey = decode(png(3, 1, 8, 0, std::string("\x00\x33\xff", 3)));
  CHECK((grey.width == 3 && grey.height == 1 && grey.channels == 1 && grey.floats.empty()));
  CHECK(grey.bytes == std::vector<std::uint8_t>{0, 0x33, 255});
  CHECK(decode(png(1, 1, 8, 4, "\x33\x66")).bytes == std::vector<std::uint8_t>{0x33, 0x66});
  CHECK(decode(png(1, 2, 8, 2, "\x01\x02\x03\x04\x05\x06")).bytes == std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6});
  // Alpha must not be multiplied in.
  const Image rgba = decode(png(2, 1, 8, 6, std::string("\xff\x80\x40\x00\x0a\x14\x1e\x80", 8)), true);
  CHECK(rgba.bytes == std::vector<std::uint8_t>{255, 128, 64, 0, 10, 20, 30, 128});
  CHECK(rgba.srgb);
}

TEST_CASE("PNG with a palette, with and without transparency, and with one bit a pixel") {
  const std::string palette = chunk("PLTE", "\x10\x20\x30\x40\x50\x60");
  CHECK(decode(png(2, 1, 8, 3, std::string("\x01\x00", 2), palette)).bytes ==
        std::vector<std::uint8_t>{0x40, 0x50, 0x60, 0x10, 0x20, 0x30});
  const Image transparent = decode(png(2, 1, 8, 3, std::string("\x01\x00", 2), palette + chunk("tRNS", "\x80")));
  CHECK(transparent.channels == 4);
  check_texel(transparent, 0, 0, Vec4(0x40, 0x50, 0x60, 255) / 255.0f);
  check_texel(transparent, 1, 0, Vec4(0x10, 0x20, 0x30, 0x80) / 255.0f);
  const Image bits = decode(png(3, 1, 1, 0, "\xa0"));
  check_texel(bits, 0, 0, Vec4(1));
  check_texel(bits, 1, 0, Vec4(0, 0, 0, 1));
}

TEST_CASE("16-bit PNG becomes float, linear where it is sRGB-encoded, but for alpha") {
  const std::string file = png(1, 1, 16, 6, std::string("\x80\x00\x00\x00\xff\xff\x40\x00", 8));
  const float half = 32768 / 65535.0f, quarter = 16384 / 65535.0f;
  const Image plain = decode(file), encoded = decode(file, true);
  CHECK((plain.bytes.empty() && plain.floats.size() == 4 && !encoded.srgb));
  check_texel(plain, 0, 0, {half, 0, 1, quarter});
  check_texel(encoded, 0, 0, {srgb_to_linear(half), 0, 1, quarter});
}

TEST_CASE("Radiance HDR") {
  const std::string file =
      "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + std::string("\x80\x40\x20\x82\x80\x80\x80\x80", 8);
  const Image image = decode(file);
  CHECK((image.width == 2 && image.height == 1 && image.channels == 3 && image.bytes.empty()));
  CHECK(texel(image, 0, 0).x == doctest::Approx(2.0).epsilon(0.01));
  CHECK(texel(image, 0, 0).y == doctest::Approx(1.0).epsilon(0.02));
  CHECK(texel(image, 0, 0).z == doctest::Approx(0.5).epsilon(0.03));
}

TEST_CASE("OpenEXR, from a file; what is no number becomes 0") {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "environment.exr").string();
  std::array<float, 6> red{1, 2, 3, 4, 5, std::numeric_limits<float>::quiet_NaN()}, green{0, 0, 0, 0, 0, 0},
      blue{1e20f, 0, 0, 0, 0, std::numeric_limits<float>::infinity()};
  Imf::Header header(3, 2);
  Imf::FrameBuffer frame;
  const auto add = [&](const char* name, std::array<float, 6>& values) {
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), sizeof(float), 3 * sizeof(float)));
  };
  add("R", red);
  add("G", green);
  add("B", blue);
  {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(2);
  }
  const Image image = read_image_file(path);
  CHECK((image.width == 3 && image.height == 2 && image.channels == 3));
  check_texel(image, 0, 0, {1, 0, 1e20f, 1});
  check_texel(image, 1, 1, {5, 0, 0, 1});
  CHECK(texel(image, 2, 1).x == 0);
  CHECK(std::isfinite(texel(image, 2, 1).z));
}

TEST_CASE("what cannot be decoded is refused with a cause") {
  const std::string good = png(1, 2, 8, 2, "\x01\x02\x03\x04\x05\x06");
  CHECK_THROWS_WITH_AS(decode(""), "is not an image in PNG, JPEG, Radiance HDR or OpenEXR format", Error);
  CHECK_THROWS_AS(decode("GIF89a"), Error);
  CHECK_THROWS_AS(decode(good.substr(0, 20)), Error);
  CHECK_THROWS_AS(decode(good.substr(0, good.size() - 30)), Error);
  CHECK_THROWS_AS(decode("\xff\xd8\xff\xe0"), Error);
  CHECK_THROWS_AS(decode("#?RADIANCE\n\n-Y 99999 +X 99999\n"), Error);
  CHECK_THROWS_AS(decode("\x76\x2f\x31\x01"), Error);
  try {
    read_image_file("/nowhere/a\x1b.hdr");
    CHECK(false);
  } catch (const Error& error) {
    CHECK(std::string(error.what()) == "/nowhere/a\\x1b.hdr: no such file");
  }
}

TEST_CASE("the memory of the pixels is asked for before it is taken") {
  const std::string bomb = png(60000, 60000, 8, 2, "");
  double wanted = 0;
  const auto refuse = [&](double size) {
    wanted = size;
    throw Error("too much");
  };
  CHECK_THROWS_WITH_AS(decode_image(bytes_of(bomb), false, refuse), "too much", Error);
  CHECK(wanted == 3.0 * 60000 * 60000);
}

TEST_CASE("images of a model: files, data URIs and buffer views, each encoding decoded once") {
  const TemporaryFolder folder;
  const std::string image = png(1, 1, 8, 2, "\x0a\x14\x1e");
  folder.write("a b.png", image);
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int view = file.buffer_view(std::vector<std::uint8_t>(image.begin(), image.end()));
  const std::string rest = R"("images":[{"uri":"a%20b.png"},{"uri":"data:image/png;base64,)" + base64(image) +
                           "\"},{\"bufferView\":" + std::to_string(view) + R"(,"mimeType":"image/png"},{"uri":"./a b.png"}],
    "samplers":[{"wrapS":33071,"wrapT":33648,"magFilter":9728}],"textures":[{"source":0,"sampler":0},{"source":1},{"source":2},{"source":3},{"extensions":{"EXT_texture_webp":{"source":0}}}],
    "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":2},"metallicRoughnessTexture":{"index":3}},"emissiveTexture":{"index":3,"texCoord":2},
      "normalTexture":{"index":1,"scale":0.5,"extensions":{"KHR_texture_transform":{"offset":[0.25,0.5],"rotation":1.5707963267948966,"scale":[2,3],"texCoord":0}}},
      "extensions":{"KHR_materials_transmission":{"transmissionTexture":{"index":2}},"KHR_materials_specular":{"specularTexture":{"index":4}}}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"nodes":[{"mesh":0}])";
  const SceneData scene = load_gltf(folder.write("scene.gltf", file.text(rest)));
  REQUIRE(scene.materials.size() == 1);
  const Material& m = scene.materials[0];
  CHECK(scene.images.size() == 4);
  for (const Image& i : scene.images) CHECK(i.bytes == std::vector<std::uint8_t>{10, 20, 30});
  CHECK(m.base_color_texture.image == m.emissive_texture.image);
  CHECK(m.base_color_texture.image != m.metallic_roughness_texture.image);
  CHECK((scene.images[static_cast<std::size_t>(m.base_color_texture.image)].srgb &&
         !scene.images[static_cast<std::size_t>(m.metallic_roughness_texture.image)].srgb));
  CHECK((m.base_color_texture.wrap_s == Wrap::clamp && m.base_color_texture.wrap_t == Wrap::mirror &&
         m.base_color_texture.nearest));
  CHECK((m.normal_texture.wrap_s == Wrap::repeat && !m.normal_texture.nearest && m.normal_scale == 0.5f));
  CHECK((m.base_color_texture.uv_set == 1 && m.metallic_roughness_texture.uv_set == 0 && m.normal_texture.uv_set == 0 &&
         m.emissive_texture.uv_set == 1));
  // Scale, then a quarter turn that takes u to -v, then the offset.
  const Vec2 moved = transform_uv(m.normal_texture, {0.1f, 0.2f});
  CHECK(moved.x == doctest::Approx(0.25 + 0.6));
  CHECK(moved.y == doctest::Approx(0.5 - 0.2));
  CHECK(!m.specular_texture);
  CHECK(scene.notes.size() == 2);
}

TEST_CASE("missing and broken images are errors that name image and file") {
  const TemporaryFolder folder;
  folder.write("broken.png", "\x89PNG\r\n\x1a\nxxxx");
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  for (const char* name : {"missing.png", "broken.png", "../up.png"}) {
    const std::string rest =
        R"("images":[{"uri":")" + std::string(name) +
        R"("}],"textures":[{"source":0}],"materials":[{"emissiveTexture":{"index":0}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"nodes":[{"mesh":0}])";
    try {
      load_gltf(folder.write("scene.gltf", file.text(rest)));
      CHECK(false);
    } catch (const Error& error) {
      CHECK(std::string(error.what()).find("scene.gltf: images[0]: \"" + std::string(name) + "\": ") != std::string::npos);
    }
  }
}
