#pragma once
// A glTF file after its members are checked and its buffers are in memory: what the readers of materials, meshes and nodes share.

#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gltf_files.hpp"
#include "gltf_json.hpp"

namespace ln::gltf {

/// What is to be said to the user: each thing once, with the number of times it happened.
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
};

/// Reads bytes of a buffer. Every byte of every buffer, views, accessors and embedded images alike, is read through `load` or
/// `part`, which throw instead of reading beyond the end.
class ByteView {
 public:
  ByteView() = default;
  explicit ByteView(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::size_t size() const { return bytes_.size(); }

  template <class T>
  T load(std::size_t offset) const {
    T value;
    std::memcpy(&value, part(offset, sizeof(T)).data(), sizeof(T));
    return value;
  }

  std::span<const std::uint8_t> part(std::size_t offset, std::size_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) throw Error("read beyond the end of a buffer");
    return bytes_.subspan(offset, size);
  }

 private:
  std::span<const std::uint8_t> bytes_;
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
  JsonArray accessors, buffer_views, cameras, images, lights, materials, meshes, nodes, samplers, skins, textures;
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
