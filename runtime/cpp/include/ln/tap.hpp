#pragma once
// Wires written to files as they are stored.
//
// A representation that a tap can write has a function write_tap(const TapFile&, const REPRESENTATION&), declared beside its
// type and found by it. It chooses the format by the suffix of the name, one of those that the representation declares.

#include <algorithm>
#include <cctype>
#include <string_view>

#include "ln/program.hpp"
#include "ln/scene_data.hpp"

namespace ln {

/// What a tap is to write, and what can be said in the file.
struct TapFile {
  const char* network;
  const TapInfo& info;
  const SceneData& scene;

  /// Does the file's name end in `suffix`, in small or capital letters?
  bool is(std::string_view suffix) const {
    const std::string_view path = info.file;
    const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
    return path.size() >= suffix.size() &&
           std::equal(suffix.rbegin(), suffix.rend(), path.rbegin(), [&](char b, char a) { return same(a, b); });
  }
};

}  // namespace ln
