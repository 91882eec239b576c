#pragma once
// The one way to the bytes of a buffer.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "ln/error.hpp"

namespace ln::gltf {

/// Reads bytes of a buffer. Every byte of every buffer, for views, accessors and embedded images alike, is read through
/// `part`, which throws instead of reaching beyond the end.
class ByteView {
 public:
  ByteView() = default;
  explicit ByteView(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::size_t size() const { return bytes_.size(); }

  std::span<const std::uint8_t> part(std::size_t offset, std::size_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) throw Error("read beyond the end of a buffer");
    return bytes_.subspan(offset, size);
  }

  template <class T>
  T load(std::size_t offset) const {
    T value;
    std::memcpy(&value, part(offset, sizeof(T)).data(), sizeof(T));
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace ln::gltf
