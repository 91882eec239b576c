#include "gltf_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "ln/text.hpp"

namespace ln::gltf {

std::string_view kind_text(JsonKind kind) {
  switch (kind) {
    case JsonKind::null: return "null";
    case JsonKind::boolean: return "a boolean";
    case JsonKind::number: return "a number";
    case JsonKind::string: return "a string";
    case JsonKind::array: return "an array";
    case JsonKind::object: return "an object";
  }
  return "";
}

// ---------------------------------------------------------------- building

/// Takes nlohmann's events down as entries.
class JsonBuilder {
 public:
  explicit JsonBuilder(JsonDocument& document) : document_(document) {}

  bool null() { return add(JsonKind::null, 0), true; }
  bool boolean(bool value) { return add(JsonKind::boolean, 0).number = value, true; }
  bool number_integer(std::int64_t value) { return add(JsonKind::number, 0).number = static_cast<double>(value), true; }
  bool number_unsigned(std::uint64_t value) { return add(JsonKind::number, 0).number = static_cast<double>(value), true; }
  bool number_float(double value, const std::string& text) {
    if (!std::isfinite(value)) throw Error(document_.file_ + ": the number " + printable(text, 40) + " is out of range");
    add(JsonKind::number, 0).number = value;
    return true;
  }
  bool string(std::string& value) {
    if (value.size() > UINT32_MAX) throw Error(document_.file_ + ": a string is longer than 4 GiB");
    const auto size = static_cast<std::uint32_t>(value.size());
    add(JsonKind::string, size).text = store(value);
    return true;
  }
  bool binary(std::vector<std::uint8_t>&) { return false; }

  bool start_object(std::size_t) { return open(JsonKind::object); }
  bool start_array(std::size_t) { return open(JsonKind::array); }
  bool end_array() { return close(); }
  bool end_object() {
    refuse_duplicate_keys(open_.back());
    index_members(open_.back());
    return close();
  }

  bool key(std::string& name) {
    auto found = document_.key_index_.find(name);
    if (found == document_.key_index_.end()) {
      document_.keys_.push_back(std::move(name));
      const auto id = static_cast<std::uint32_t>(document_.keys_.size());
      if (id >= 1u << 28) throw Error(document_.file_ + ": too many different member names");
      found = document_.key_index_.emplace(document_.keys_.back(), id).first;
    }
    key_ = found->second;
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) {
    std::string_view what = error.what();
    what.remove_prefix(std::min(what.find("] ") + 2, what.size()));
    throw Error(document_.file_ + ": not valid JSON: " + printable(what));
  }

 private:
  JsonDocument::Entry& add(JsonKind kind, std::uint32_t size) {
    if (document_.entries_.size() >= UINT32_MAX) throw Error(document_.file_ + ": more than 4,294,967,295 JSON values");
    if (!open_.empty()) ++document_.entries_[open_.back()].size;
    auto& entry = document_.entries_.emplace_back();
    entry.kind = static_cast<std::uint32_t>(kind);
    entry.key = key_;
    entry.size = size;
    key_ = 0;
    return entry;
  }

  bool open(JsonKind kind) {
    if (open_.size() >= JsonDocument::kMaxDepth) {
      throw Error(document_.file_ + ": JSON values are nested more than " + std::to_string(JsonDocument::kMaxDepth) + " deep");
    }
    add(kind, 0);
    open_.push_back(static_cast<std::uint32_t>(document_.entries_.size() - 1));
    return true;
  }

  bool close() {
    document_.entries_[open_.back()].end = document_.entries_.size();
    open_.pop_back();
    return true;
  }

  void refuse_duplicate_keys(std::uint32_t object) {
    ids_.clear();
    const auto end = static_cast<std::uint32_t>(document_.entries_.size());
    for (std::uint32_t i = object + 1; i < end; i = document_.next(i)) ids_.push_back(document_.entries_[i].key);
    std::sort(ids_.begin(), ids_.end());
    const auto twice = std::adjacent_find(ids_.begin(), ids_.end());
    if (twice == ids_.end()) return;
    throw Error(document_.file_ + ": the member " + quoted(document_.keys_[*twice - 1], 60) + " occurs twice in one object");
  }

  void index_members(std::uint32_t object) {
    if (document_.entries_[object].size < JsonDocument::kManyMembers) return;
    auto& index = document_.member_index_[object];
    const auto end = static_cast<std::uint32_t>(document_.entries_.size());
    for (std::uint32_t i = object + 1; i < end; i = document_.next(i)) index[document_.entries_[i].key] = i;
  }

  /// Keeps the characters where they never move: large strings as they are, small ones together in blocks.
  const char* store(std::string& value) {
    constexpr std::size_t kBlock = 1 << 16;
    auto& blocks = document_.strings_;
    if (value.size() >= kBlock / 16) {
      blocks.push_front(std::move(value));
      return blocks.front().data();
    }
    if (blocks.empty() || blocks.back().capacity() - blocks.back().size() < value.size()) blocks.emplace_back().reserve(kBlock);
    auto& block = blocks.back();
    block += value;
    return block.data() + (block.size() - value.size());
  }

  JsonDocument& document_;
  std::vector<std::uint32_t> open_;
  std::vector<std::uint32_t> ids_;
  std::uint32_t key_ = 0;
};

JsonDocument::JsonDocument(std::string file, std::string_view text) : file_(std::move(file)) {
  JsonBuilder builder(*this);
  nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
}

std::uint32_t JsonDocument::next(std::uint32_t index) const {
  const Entry& entry = entries_[index];
  const auto kind = static_cast<JsonKind>(entry.kind);
  return kind == JsonKind::array || kind == JsonKind::object ? static_cast<std::uint32_t>(entry.end) : index + 1;
}

// ---------------------------------------------------------------- reading

JsonKind Json::kind() const { return static_cast<JsonKind>(document_->entries_[index_].kind); }

Json::Iterator& Json::Iterator::operator++() {
  index_ = document_->next(index_);
  return *this;
}

Json::Iterator Json::begin() const {
  return is_array() || is_object() ? Iterator(document_, index_ + 1) : Iterator(document_, index_);
}

Json::Iterator Json::end() const {
  return is_array() || is_object() ? Iterator(document_, document_->next(index_)) : Iterator(document_, index_);
}

Json Json::operator[](std::string_view member) const {
  if (!is_object()) return {};
  if (size() >= JsonDocument::kManyMembers) {
    const auto key = document_->key_index_.find(member);
    if (key == document_->key_index_.end()) return {};
    const auto& index = document_->member_index_.at(index_);
    const auto found = index.find(key->second);
    return found == index.end() ? Json{} : Json{document_, found->second};
  }
  for (const Json value : *this) {
    if (value.key() == member) return value;
  }
  return {};
}

std::size_t Json::size() const { return is_array() || is_object() ? document_->entries_[index_].size : 0; }

std::string_view Json::key() const {
  const auto key = document_->entries_[index_].key;
  return key == 0 ? std::string_view{} : document_->keys_[key - 1];
}

double Json::number(double fallback) const {
  return *this && kind() == JsonKind::number ? document_->entries_[index_].number : fallback;
}

bool Json::boolean(bool fallback) const {
  return *this && kind() == JsonKind::boolean ? document_->entries_[index_].number != 0 : fallback;
}

std::string_view Json::text(std::string_view fallback) const {
  if (!*this || kind() != JsonKind::string) return fallback;
  const auto& entry = document_->entries_[index_];
  return {entry.text, entry.size};
}

std::string Json::path() const {
  std::string path;
  Json at = document_->root();
  while (at.index_ != index_) {
    // Step into the child whose entries hold this one.
    std::size_t position = 0;
    Json inside;
    for (const Json child : at) {
      inside = child;
      if (index_ < document_->next(child.index_)) break;
      ++position;
    }
    if (inside.key().empty() && at.is_array()) {
      path += '[';
      path += std::to_string(position);
      path += ']';
    } else {
      if (!path.empty()) path += '.';
      path += printable(inside.key(), 60);
    }
    at = inside;
  }
  return path;
}

void Json::fail(const std::string& message) const {
  const std::string where = path();
  throw Error(document_->file() + ": " + (where.empty() ? "" : where + ": ") + message);
}

void Json::fail(std::string_view member, const std::string& message) const {
  const std::string where = path();
  throw Error(document_->file() + ": " + where + (where.empty() ? "" : ".") + std::string(member) + ": " + message);
}

JsonArray::JsonArray(Json array) {
  elements_.reserve(array.size());
  for (const Json element : array) elements_.push_back(element);
}

}  // namespace ln::gltf
