#pragma once
// Bytes from outside: files below the model's folder, data URIs, the GLB container; and the memory they may take.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "ln/error.hpp"

namespace ln::gltf {

/// Counts what is about to be allocated and refuses what goes beyond the limit.
class MemoryBudget {
 public:
  /// `limit` in bytes; 0: half of the machine's memory.
  explicit MemoryBudget(std::uint64_t limit);
  /// Throws Error "<what> needs 12 GiB of memory, more than the limit of 8 GiB" if `bytes` more would pass the limit.
  void claim(double bytes, const std::string& what);

 private:
  double limit_, used_ = 0;
};

/// Bytes that are shared and never written again.
struct Bytes {
  std::shared_ptr<std::uint8_t[]> data;
  std::size_t size = 0;

  std::span<const std::uint8_t> span() const { return {data.get(), size}; }
  std::string_view text() const { return {reinterpret_cast<const char*>(data.get()), size}; }
};

/// Reads a regular file that the user named. Throws Error "<path>: <cause>".
Bytes read_file(const std::string& path, MemoryBudget& memory);

/// The folder of a model. Nothing outside it can be opened: no "..", no absolute path, no symbolic link that leads out, and
/// nothing but regular files.
class Folder {
 public:
  /// The folder in which the file `path` lies.
  explicit Folder(const std::string& path);
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  /// Reads the file that a relative URI names, once per file. Throws Error with the cause alone, e.g. "no such file".
  Bytes read_uri(std::string_view uri, MemoryBudget& memory);

 private:
  int descriptor_ = -1;
  std::map<std::pair<std::uint64_t, std::uint64_t>, Bytes> read_;  // by device and inode
};

bool is_data_uri(std::string_view uri);
/// The bytes in a data URI. Throws Error with the cause alone.
Bytes decode_data_uri(std::string_view uri, MemoryBudget& memory);

/// The two chunks of a binary glTF file, as parts of `file`.
struct Glb {
  std::string_view json;
  std::span<const std::uint8_t> binary;
  bool has_binary = false;
  bool has_extra_data = false;
};
bool is_glb(const Bytes& file);
/// Throws Error with the cause alone.
Glb split_glb(const Bytes& file);

}  // namespace ln::gltf
