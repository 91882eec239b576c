#pragma once
// Writing small glTF files for tests.

#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "ln/gltf.hpp"

namespace ln::test {

/// A folder that is removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "ln_test_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string write(const std::string& name, std::string_view content) const {
    const auto path = path_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << content;
    return path.string();
  }

 private:
  std::filesystem::path path_;
};

inline std::string base64(std::string_view bytes) {
  constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kAlphabet[bits >> (18 - 6 * k) & 63];
  }
  return out;
}

/// A glTF text that is put together member by member; every array of numbers gets its own buffer view and accessor.
class GltfFile {
 public:
  /// Adds an accessor; returns its index. `more` is put into the accessor as it is, such as "\"normalized\":true".
  template <class T>
  int accessor(int component_type, const std::string& type, std::size_t count, const std::vector<T>& values,
               const std::string& more = {}) {
    const int view = buffer_view(values);
    return accessor_text("{\"bufferView\":" + std::to_string(view) + ",\"componentType\":" + std::to_string(component_type) +
                         ",\"count\":" + std::to_string(count) + ",\"type\":\"" + type + "\"" +
                         (more.empty() ? "" : "," + more) + "}");
  }
  int floats(const std::string& type, const std::vector<float>& values) {
    const std::size_t size = type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
    return accessor(5126, type, values.size() / size, values);
  }
  int indices(const std::vector<std::uint16_t>& values) { return accessor(5123, "SCALAR", values.size(), values); }
  int accessor_text(const std::string& text) { return add(accessors_, text); }

  template <class T>
  int buffer_view(const std::vector<T>& values) {
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
    const std::string text = "{\"buffer\":0,\"byteOffset\":" + std::to_string(bytes_.size()) +
                             ",\"byteLength\":" + std::to_string(values.size() * sizeof(T)) + "}";
    const std::size_t before = bytes_.size();
    bytes_.resize(before + values.size() * sizeof(T));
    if (!values.empty()) std::memcpy(bytes_.data() + before, values.data(), values.size() * sizeof(T));
    return add(views_, text);
  }

  /// The whole text; `rest` holds the members that are not buffers: "\"nodes\":[...],\"meshes\":[...]".
  std::string text(const std::string& rest) const {
    std::string out = R"({"asset":{"version":"2.0"},)" + rest;
    if (!accessors_.empty()) out += ",\"accessors\":[" + accessors_ + "]";
    if (!bytes_.empty()) {
      out += ",\"bufferViews\":[" + views_ + "],\"buffers\":[{\"byteLength\":" + std::to_string(bytes_.size()) +
             ",\"uri\":\"data:application/octet-stream;base64," + base64(bytes_) + "\"}]";
    }
    return out + "}";
  }
  SceneData load(const std::string& rest, const LoadLimits& limits = {}) const {
    const TemporaryFolder folder;
    return load_gltf(folder.write("scene.gltf", text(rest)), limits);
  }

 private:
  int add(std::string& list, const std::string& text) {
    list += (list.empty() ? "" : ",") + text;
    return count_[&list == &accessors_ ? 0 : 1]++;
  }

  std::string accessors_, views_, bytes_;
  int count_[2] = {0, 0};
};

/// The message with which loading `text` fails; empty if it does not.
inline std::string load_error(const std::string& text, const LoadLimits& limits = {}) {
  const TemporaryFolder folder;
  try {
    load_gltf(folder.write("scene.gltf", text), limits);
  } catch (const Error& error) {
    const std::string message = error.what();
    const std::size_t at = message.find("scene.gltf: ");
    return at == std::string::npos ? message : message.substr(at);
  }
  return {};
}

}  // namespace ln::test
