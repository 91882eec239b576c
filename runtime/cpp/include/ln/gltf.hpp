#pragma once
// Reading glTF 2.0.

#include <cstdint>
#include <string>

#include "ln/error.hpp"
#include "ln/scene_data.hpp"

namespace ln {

struct LoadLimits {
  /// Refuse, before allocating, what would need more memory than this [bytes]; 0: half of the machine's memory.
  std::uint64_t max_bytes = 0;
};

/// Reads a .gltf or .glb file with its buffers and images. Opens no file outside the folder of `path`.
/// Throws Error ("scene.gltf: materials[3].pbrMetallicRoughness.roughnessFactor: 2 is not within [0, 1]").
SceneData load_gltf(const std::string& path, const LoadLimits& limits = {});

}  // namespace ln
