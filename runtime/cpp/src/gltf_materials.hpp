#pragma once
// Materials, textures, samplers and images: only what some triangle uses is read.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gltf_model.hpp"
#include "ln/scene_data.hpp"

namespace ln::gltf {

/// Which TEXCOORD_n the two uv sets of a material stand for: 0 and 1 but for materials that use others.
struct UvSets {
  std::array<std::uint32_t, 2> texcoord{0, 1};
  std::array<bool, 2> used{};
};

class MaterialReader {
 public:
  MaterialReader(Model& model, SceneData& scene) : model_(model), scene_(scene) {}

  /// Index into SceneData::materials of a primitive's material; nothing stands for glTF's default material.
  std::uint32_t use(Json index);
  const UvSets& uv_sets(std::uint32_t material) const { return uv_sets_[material]; }

 private:
  Material read(Json json, UvSets& sets);
  void read_specular_glossiness(Json json, Material& material, UvSets& sets);
  TextureRef texture(Json info, bool srgb, UvSets& sets);
  int image(std::size_t index, bool srgb);
  int read_image(std::size_t index, bool srgb);
  int decode(std::span<const std::uint8_t> bytes, bool srgb);

  Model& model_;
  SceneData& scene_;
  std::map<std::int64_t, std::uint32_t> used_;                                 // -1: the default material
  std::map<std::pair<std::size_t, bool>, int> images_;                         // by index and encoding
  std::map<std::tuple<const std::uint8_t*, std::size_t, bool>, int> decoded_;  // by the bytes of the file
  std::vector<UvSets> uv_sets_;
};

/// The name of an object; at most 1,000 bytes of it.
std::string read_name(Json json);
/// `extras.tags`: a string or an array of strings, of which up to 64 with up to 256 bytes each are read. Other applications may
/// mean something else by it, which is no error.
void read_tags(Json json, std::vector<std::string>& tags);
/// The memory that the name and tags of an object take.
double name_and_tags_bytes(Json json);

}  // namespace ln::gltf
