#pragma once
// Reading glTF 2.0.

#include <cstdint>
#include <stdexcept>
#include <string>

#include "ln/scene_data.hpp"

namespace ln {

/// Something the user can mend: a message that says where, what and how. Reported as one line, exit status 1.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct LoadLimits {
  /// Refuse, before allocating, what would need more memory than this [bytes]; 0: half of the machine's memory.
  std::uint64_t max_bytes = 0;
};

/// Reads a .gltf or .glb file with its buffers and images. Opens no file outside the folder of `path`.
/// Throws Error ("scene.gltf: materials[3].pbrMetallicRoughness.roughnessFactor: 2 is not within [0, 1]").
SceneData load_gltf(const std::string& path, const LoadLimits& limits = {});

}  // namespace ln
