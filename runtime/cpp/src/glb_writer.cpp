#include "glb_writer.hpp"

#include <algorithm>
#include <limits>

#include "ln/error.hpp"
#include "ln/output_file.hpp"

namespace ln::gltf {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr int kNoTarget = 0, kVertexTarget = 34962, kIndexTarget = 34963;

void append_u32(std::string& out, std::size_t value) {
  for (int i = 0; i < 4; ++i) out += static_cast<char>(value >> (8 * i) & 0xff);
}

std::string padded(std::string text, char pad) {
  text.resize((text.size() + 3) / 4 * 4, pad);
  return text;
}

}  // namespace

GlbWriter::GlbWriter(Json notes) {
  json["asset"] = {{"version", "2.0"}, {"generator", "Lighting Networks"}, {"extras", std::move(notes)}};
  json["scene"] = 0;
  json["scenes"] = {{{"nodes", Json::array()}}};
}

int GlbWriter::add_view(const void* data, std::size_t size, int target) {
  binary_.resize((binary_.size() + 3) / 4 * 4);
  Json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}};
  if (target != kNoTarget) view["target"] = target;
  binary_.append(static_cast<const char*>(data), size);
  json["bufferViews"].push_back(std::move(view));
  return static_cast<int>(json["bufferViews"].size()) - 1;
}

int GlbWriter::add_bytes(std::span<const unsigned char> bytes) { return add_view(bytes.data(), bytes.size(), kNoTarget); }

int GlbWriter::add_floats(const void* values, std::size_t count, int components, const Json* bounds) {
  const int view = add_view(values, count * static_cast<std::size_t>(components) * sizeof(float), kVertexTarget);
  Json accessor{{"bufferView", view}, {"componentType", kFloat}, {"count", count}, {"type", components == 2 ? "VEC2" : "VEC3"}};
  if (bounds) accessor.update(*bounds);
  json["accessors"].push_back(std::move(accessor));
  return static_cast<int>(json["accessors"].size()) - 1;
}

int GlbWriter::add_positions(std::span<const Vec3> values) {
  Vec3 low(kInfinity), high(-kInfinity);
  for (const Vec3& p : values) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const Json bounds{{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}};
  return add_floats(values.data(), values.size(), 3, &bounds);
}

int GlbWriter::add_indices(std::span<const std::uint32_t> values) {
  const int view = add_view(values.data(), values.size_bytes(), kIndexTarget);
  json["accessors"].push_back(
      {{"bufferView", view}, {"componentType", kUnsignedInt}, {"count", values.size()}, {"type", "SCALAR"}});
  return static_cast<int>(json["accessors"].size()) - 1;
}

int GlbWriter::add_unlit_material(const std::string& name) {
  json["extensionsUsed"] = {"KHR_materials_unlit"};
  json["materials"].push_back({{"name", name},
                               {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}},
                               {"extensions", {{"KHR_materials_unlit", Json::object()}}}});
  return static_cast<int>(json["materials"].size()) - 1;
}

void GlbWriter::add_mesh(const std::string& name, Json primitive, const SceneData& scene) {
  json["meshes"].push_back({{"name", name}, {"primitives", {std::move(primitive)}}});
  json["nodes"].push_back({{"name", name},
                           {"mesh", json["meshes"].size() - 1},
                           {"translation", {scene.origin.x, scene.origin.y, scene.origin.z}},
                           {"scale", {scene.unit, scene.unit, scene.unit}}});
  json["scenes"][0]["nodes"].push_back(json["nodes"].size() - 1);
}

void GlbWriter::write(const std::string& path) const {
  Json whole = json;
  const std::string binary = padded(binary_, '\0');
  if (!binary.empty()) whole["buffers"] = {{{"byteLength", binary.size()}}};
  if (whole["scenes"][0]["nodes"].empty()) whole["scenes"][0].erase("nodes");  // glTF allows no empty list
  const std::string text = padded(whole.dump(-1, ' ', false, Json::error_handler_t::replace), ' ');
  const std::size_t size = 12 + 8 + text.size() + (binary.empty() ? 0 : 8 + binary.size());
  if (size > std::numeric_limits<std::uint32_t>::max())
    throw Error(path + ": would be larger than the 4 GiB that a .glb file can have; use fewer cells");
  std::string header = "glTF";
  append_u32(header, 2);
  append_u32(header, size);
  append_u32(header, text.size());
  header += "JSON";
  OutputFile file(path);
  file.write(header);
  file.write(text);
  if (!binary.empty()) {
    std::string chunk;
    append_u32(chunk, binary.size());
    file.write(chunk.append("BIN\0", 4));
    file.write(binary);
  }
  file.commit();
}

float exposure_of(double mean_luminance) {
  return mean_luminance > 0 ? static_cast<float>(std::clamp(0.25 / mean_luminance, 1e-30, 1e30)) : 1.0f;
}

}  // namespace ln::gltf
