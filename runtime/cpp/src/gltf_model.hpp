#pragma once
// A glTF file after its members are checked and its buffers are in memory: what the readers of materials, meshes and nodes
// share.

#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gltf_accessor.hpp"
#include "gltf_byte_view.hpp"
#include "gltf_files.hpp"
#include "gltf_json.hpp"

namespace ln::gltf {

/// What is to be said to the user: each thing once, with the number of times it happened; not more than some dozens.
class Notes {
 public:
  void add(std::string text) { count(std::move(text), {}, 0); }
  /// "<n> <what>", or "1 <what>" with `singular` in its place.
  void count(std::string singular, std::string plural, double n);
  std::vector<std::string> take() const;

 private:
  struct Note {
    std::string singular, plural;
    double n;
  };
  std::vector<Note> notes_;
  std::map<std::string, std::size_t, std::less<>> index_;
  double left_out_ = 0;
};

struct Model {
  /// Reads and checks the file and all its buffers.
  Model(const std::string& path, std::uint64_t max_bytes);

  Json root() const { return document->root(); }
  /// The bytes of a buffer view.
  ByteView view(std::size_t buffer_view) const;

  MemoryBudget memory;
  Notes notes;
  Folder folder;
  Bytes file;
  std::unique_ptr<JsonDocument> document;
  std::vector<Accessor> accessors;
  JsonArray buffer_views, cameras, images, lights, materials, meshes, nodes, samplers, skins, textures;
  std::vector<Bytes> buffers;
  bool quantized = false;  // KHR_mesh_quantization is declared

 private:
  void check_version() const;
  void check_extensions();
  void load_buffers(const Glb& glb);
  Bytes load_buffer(Json buffer, std::size_t index, const Glb& glb);
  bool holds_meshopt_data(std::size_t buffer) const;
  void check_buffer_views() const;
};

}  // namespace ln::gltf
