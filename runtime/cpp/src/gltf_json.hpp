#pragma once
// JSON as a flat array of values: parsed by nlohmann's SAX interface, stored in a few bytes a value, walked without recursion.
//
// A glTF file of one megabyte may hold a third of a million empty objects. A tree of maps, or a structure for each of them,
// costs hundreds of bytes apiece: tinygltf 2.7 takes 1.1 GiB for a megabyte of empty materials, this 15 MiB. An entry here is
// 16 bytes, and depth is data, not stack. (tinygltf also replaces values of the wrong kind by defaults, keeps the last of
// duplicate members, reads every buffer and image before anything is checked, and would read the JSON a second time.)

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "ln/error.hpp"

namespace ln::gltf {

enum class JsonKind : std::uint8_t { null, boolean, number, string, array, object };
std::string_view kind_text(JsonKind kind);

class JsonDocument;

/// A value inside a JsonDocument, or nothing (an absent member). Cheap to copy; the document must outlive it.
class Json {
 public:
  Json() = default;
  explicit operator bool() const { return document_ != nullptr; }

  JsonKind kind() const;
  bool is_array() const { return *this && kind() == JsonKind::array; }
  bool is_object() const { return *this && kind() == JsonKind::object; }

  /// The member of that name; nothing if there is none or this is not an object.
  Json operator[](std::string_view member) const;
  /// Number of elements or members.
  std::size_t size() const;
  /// Name of this member; empty for an element of an array.
  std::string_view key() const;

  // The value as a C++ type; `fallback` where it is absent. Kinds and ranges are checked beforehand (gltf_schema.hpp).
  double number(double fallback) const;
  std::int64_t integer(std::int64_t fallback) const { return static_cast<std::int64_t>(number(static_cast<double>(fallback))); }
  std::size_t index() const { return static_cast<std::size_t>(number(0)); }
  bool boolean(bool fallback) const;
  std::string_view text(std::string_view fallback = {}) const;

  /// Where it is: "materials[3].pbrMetallicRoughness.roughnessFactor".
  std::string path() const;
  /// Throws Error "<file>: <path>: <message>".
  [[noreturn]] void fail(const std::string& message) const;
  /// The same for a member, whether present or not.
  [[noreturn]] void fail(std::string_view member, const std::string& message) const;

  class Iterator {
   public:
    Iterator(const JsonDocument* document, std::uint32_t index) : document_(document), index_(index) {}
    Json operator*() const { return {document_, index_}; }
    Iterator& operator++();
    bool operator!=(const Iterator& other) const { return index_ != other.index_; }

   private:
    const JsonDocument* document_;
    std::uint32_t index_;
  };
  /// Elements or members in file order; none for other kinds and for nothing.
  Iterator begin() const;
  Iterator end() const;

 private:
  friend class JsonDocument;
  Json(const JsonDocument* document, std::uint32_t index) : document_(document), index_(index) {}

  const JsonDocument* document_ = nullptr;
  std::uint32_t index_ = 0;
};

/// A parsed text. Refuses with an Error what strict JSON refuses, and also duplicate member names, numbers that do not fit a
/// double, and nesting deeper than kMaxDepth.
class JsonDocument {
 public:
  static constexpr std::size_t kMaxDepth = 512;

  /// `file`: the name for messages.
  JsonDocument(std::string file, std::string_view text);
  JsonDocument(const JsonDocument&) = delete;
  JsonDocument& operator=(const JsonDocument&) = delete;

  Json root() const { return {this, 0}; }
  const std::string& file() const { return file_; }

 private:
  friend class Json;
  friend class JsonBuilder;

  struct Entry {
    std::uint32_t kind : 4 = 0;
    std::uint32_t key : 28 = 0;  // 1 + index into keys_; 0: no member
    std::uint32_t size = 0;      // children, or bytes of a string
    union {
      double number = 0;
      const char* text;
      std::uint64_t end;  // containers: index of the first entry behind the last descendant
    };
  };
  static_assert(sizeof(Entry) == 16);

  static constexpr std::uint32_t kManyMembers = 64;

  std::uint32_t next(std::uint32_t index) const;

  std::string file_;
  std::deque<Entry> entries_;
  std::deque<std::string> keys_;
  std::unordered_map<std::string_view, std::uint32_t> key_index_;
  std::deque<std::string> strings_;
  // Members by name, for objects that have many: [object][key] -> entry.
  std::unordered_map<std::uint32_t, std::unordered_map<std::uint32_t, std::uint32_t>> member_index_;
};

/// Random access to the elements of an array; empty for nothing.
class JsonArray {
 public:
  JsonArray() = default;
  explicit JsonArray(Json array);
  std::size_t size() const { return elements_.size(); }
  Json operator[](std::size_t i) const { return elements_.at(i); }
  auto begin() const { return elements_.begin(); }
  auto end() const { return elements_.end(); }

 private:
  std::vector<Json> elements_;
};

}  // namespace ln::gltf
