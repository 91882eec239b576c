#pragma once
// Writes a binary glTF file.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "ln/math.hpp"
#include "ln/scene_data.hpp"

namespace ln::gltf {

/// A glTF model in the making: `json` holds what is not in the binary chunk. Throws Error beyond the 4 GiB of the format.
class GlbWriter {
 public:
  /// `notes` become the asset's extras.
  explicit GlbWriter(nlohmann::ordered_json notes);

  /// Accessors of vertex attributes and of indices; return their number.
  int add(std::span<const Vec2> values) { return add_floats(values.data(), values.size(), 2, nullptr); }
  int add(std::span<const Vec3> values) { return add_floats(values.data(), values.size(), 3, nullptr); }
  int add_positions(std::span<const Vec3> values);
  int add_indices(std::span<const std::uint32_t> values);
  /// A bufferView of any bytes.
  int add_bytes(std::span<const unsigned char> bytes);

  /// A material that shows its colours as they are; returns its number.
  int add_unlit_material(const std::string& name);
  /// A node with a mesh, in the coordinates of `scene`.
  void add_mesh(const std::string& name, nlohmann::ordered_json primitive, const SceneData& scene);

  /// Writes the file. Throws Error.
  void write(const std::string& path) const;

  nlohmann::ordered_json json;

 private:
  int add_floats(const void* values, std::size_t count, int components, const nlohmann::ordered_json* bounds);
  int add_view(const void* data, std::size_t size, int target);

  std::string binary_;
};

/// Factor that makes the mean of luminances a quarter of white: colours of files that hold no more than 1.
float exposure_of(double mean_luminance);

}  // namespace ln::gltf
