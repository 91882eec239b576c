#include "gltf_accessor.hpp"

#include <limits>

#include "gltf_model.hpp"
#include "ln/text.hpp"

namespace ln::gltf {
namespace {

int component_count(std::string_view type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4" || type == "MAT2") return 4;
  return type == "MAT3" ? 9 : 16;
}

int column_count(std::string_view type) { return type == "MAT2" ? 2 : type == "MAT3" ? 3 : type == "MAT4" ? 4 : 1; }

/// Bytes of an element: columns of matrices begin at multiples of four bytes.
std::size_t element_size(int components, int columns, ComponentType type) {
  const std::size_t column = static_cast<std::size_t>(components / columns) * component_bytes(type);
  return columns == 1 ? column : static_cast<std::size_t>(columns) * ((column + 3) / 4 * 4);
}

/// The bytes of `count` elements in a buffer view; throws Error at `member` if they do not fit.
ByteView place(const Model& model, Json at, std::string_view member, std::size_t view_index, std::uint64_t offset,
               std::uint64_t count, std::uint64_t stride, std::uint64_t element) {
  const ByteView view = model.view(view_index);
  std::uint64_t size = 0;
  const bool overflow = __builtin_mul_overflow(count - 1, stride, &size) || __builtin_add_overflow(size, element, &size);
  if (overflow || offset > view.size() || size > view.size() - offset) {
    at.fail(member, number_text(static_cast<double>(count)) + " elements of " + std::to_string(element) + " bytes from byte " +
                        std::to_string(offset) + " on do not fit bufferViews[" + std::to_string(view_index) + "] with its " +
                        std::to_string(view.size()) + " bytes");
  }
  return ByteView(view.part(offset, size));
}

}  // namespace

Accessor::Accessor(const Model& model, Json json) : json_(json) {
  count_ = json_["count"].index();
  type_ = static_cast<ComponentType>(json_["componentType"].integer(0));
  normalized_ = json_["normalized"].boolean(false);
  components_ = component_count(type());
  columns_ = column_count(type());
  element_bytes_ = element_size(components_, columns_, type_);
  if (normalized_ && (type_ == ComponentType::f32 || type_ == ComponentType::u32))
    json_.fail("normalized", "only 8 and 16 bit integers can be normalised");
  place_dense(model);
  place_sparse(model);
}

void Accessor::place_dense(const Model& model) {
  const Json view = json_["bufferView"];
  stride_ = element_bytes_;
  if (!view) return;
  const auto view_index = view.index();
  const Json stride = model.buffer_views[view_index]["byteStride"];
  stride_ = static_cast<std::size_t>(stride.integer(static_cast<std::int64_t>(element_bytes_)));
  if (stride_ < element_bytes_)
    stride.fail(std::to_string(stride_) + " is less than the " + std::to_string(element_bytes_) + " bytes of an element of " +
                json_.path());
  dense_ = place(model, json_, "count", view_index, static_cast<std::uint64_t>(json_["byteOffset"].integer(0)), count_, stride_,
                 element_bytes_);
}

void Accessor::place_sparse(const Model& model) {
  const Json sparse = json_["sparse"];
  if (!sparse) return;
  const auto view_of = [](Json json) { return json["bufferView"].index(); };
  const auto offset_of = [](Json json) { return static_cast<std::uint64_t>(json["byteOffset"].integer(0)); };
  const Json indices = sparse["indices"], values = sparse["values"];
  sparse_count_ = sparse["count"].index();
  if (sparse_count_ > count_)
    sparse.fail("count",
                std::to_string(sparse_count_) + " is more than the " + std::to_string(count_) + " elements of the accessor");
  sparse_type_ = static_cast<ComponentType>(indices["componentType"].integer(0));
  const std::size_t index_bytes = component_bytes(sparse_type_);
  sparse_indices_ =
      place(model, indices, "bufferView", view_of(indices), offset_of(indices), sparse_count_, index_bytes, index_bytes);
  sparse_values_ =
      place(model, values, "bufferView", view_of(values), offset_of(values), sparse_count_, element_bytes_, element_bytes_);
}

std::uint64_t Accessor::sparse_index(std::size_t i) const {
  if (sparse_type_ == ComponentType::u8) return sparse_indices_.load<std::uint8_t>(i);
  if (sparse_type_ == ComponentType::u16) return sparse_indices_.load<std::uint16_t>(i * 2);
  return sparse_indices_.load<std::uint32_t>(i * 4);
}

void Accessor::read(std::size_t i, double* out) const {
  if (i >= count_) throw Error("read beyond the end of an accessor");
  const ByteView* bytes = &dense_;
  std::size_t offset = i * stride_;
  if (sparse_count_ > 0) {
    // Look for i among the substituted elements, which are in ascending order.
    std::size_t low = 0, high = sparse_count_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (sparse_index(middle) < i) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    if (low < sparse_count_ && sparse_index(low) == i) {
      bytes = &sparse_values_;
      offset = low * element_bytes_;
    }
  }
  if (bytes->size() == 0) {
    std::fill_n(out, components_, 0.0);
    return;
  }
  switch (type_) {
    case ComponentType::i8: return read_as<std::int8_t>(*bytes, offset, out);
    case ComponentType::u8: return read_as<std::uint8_t>(*bytes, offset, out);
    case ComponentType::i16: return read_as<std::int16_t>(*bytes, offset, out);
    case ComponentType::u16: return read_as<std::uint16_t>(*bytes, offset, out);
    case ComponentType::u32: return read_as<std::uint32_t>(*bytes, offset, out);
    case ComponentType::f32: return read_as<float>(*bytes, offset, out);
  }
}

template <class T>
void Accessor::read_as(const ByteView& bytes, std::size_t offset, double* out) const {
  const ByteView element(bytes.part(offset, element_bytes_));
  const int rows = components_ / columns_;
  const std::size_t column_bytes = element_bytes_ / static_cast<std::size_t>(columns_);
  for (int column = 0; column < columns_; ++column) {
    for (int row = 0; row < rows; ++row) {
      *out++ = static_cast<double>(
          element.load<T>(static_cast<std::size_t>(column) * column_bytes + static_cast<std::size_t>(row) * sizeof(T)));
    }
  }
  if (!normalized_) return;
  // Section 3.11 of the specification: the same scale for both signs, -128 and -127 alike -1.
  constexpr auto kScale = static_cast<double>(std::numeric_limits<T>::max());
  for (int i = 1; i <= components_; ++i) out[-i] = std::max(out[-i] / kScale, -1.0);
}

void Accessor::check_sparse_order() const {
  for (std::size_t i = 0; i < sparse_count_; ++i) {
    const bool ascending = i == 0 || sparse_index(i) > sparse_index(i - 1);
    if (!ascending) json_["sparse"].fail("indices", "element " + std::to_string(i) + " is not above the one before it");
    if (sparse_index(i) >= count_)
      json_["sparse"].fail("indices", "there is no element " + std::to_string(sparse_index(i)) + " to substitute");
  }
}

}  // namespace ln::gltf
