#pragma once
// Typed reading of accessors: strides, normalised integers, sparse substitution.

#include <array>
#include <cstdint>
#include <string_view>

#include "gltf_byte_view.hpp"
#include "gltf_json.hpp"
#include "ln/math.hpp"

namespace ln::gltf {

struct Model;

enum class ComponentType : std::uint16_t { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };
constexpr std::size_t component_bytes(ComponentType type) {
  return type == ComponentType::i8 || type == ComponentType::u8     ? 1
         : type == ComponentType::i16 || type == ComponentType::u16 ? 2
                                                                    : 4;
}

/// The elements of an accessor; reads them one by one, in any order. An accessor without a buffer view reads as zeros.
class Accessor {
 public:
  Accessor() = default;
  /// Checks that all elements lie within their buffer views; throws Error naming the accessor.
  Accessor(const Model& model, Json json);

  explicit operator bool() const { return count_ > 0; }
  std::size_t count() const { return count_; }
  int components() const { return components_; }
  std::string_view type() const { return json_["type"].text(); }
  ComponentType component_type() const { return type_; }
  bool normalized() const { return normalized_; }
  bool has_data() const { return dense_.size() > 0 || sparse_count_ > 0; }
  const Json& json() const { return json_; }

  /// Element `i` as numbers, column by column; normalised integers become fractions.
  void read(std::size_t i, double* out) const;

  /// The first N of them; 0 where the element has fewer.
  template <int N>
  std::array<double, N> get(std::size_t i) const {
    if (components_ == N) {
      std::array<double, N> values;
      read(i, values.data());
      return values;
    }
    std::array<double, 16> all{};
    read(i, all.data());
    std::array<double, N> some{};
    std::copy_n(all.begin(), std::min(N, 16), some.begin());
    return some;
  }
  DVec3 vec3(std::size_t i) const {
    const auto v = get<3>(i);
    return {v[0], v[1], v[2]};
  }
  /// Element `i` of an accessor of unsigned scalars.
  std::uint32_t index(std::size_t i) const { return static_cast<std::uint32_t>(get<1>(i)[0]); }

  /// Throws Error if the indices of substituted elements are not ascending or not within the accessor.
  void check_sparse_order() const;

 private:
  void place_dense(const Model& model);
  void place_sparse(const Model& model);
  template <class T>
  void read_as(const ByteView& bytes, std::size_t offset, double* out) const;
  std::uint64_t sparse_index(std::size_t i) const;

  Json json_;
  std::size_t count_ = 0, stride_ = 0, element_bytes_ = 0;
  int components_ = 1, columns_ = 1;
  ComponentType type_ = ComponentType::f32;
  bool normalized_ = false;
  ByteView dense_;  // begins at the first element
  std::size_t sparse_count_ = 0;
  ComponentType sparse_type_ = ComponentType::u32;
  ByteView sparse_indices_, sparse_values_;
};

}  // namespace ln::gltf
