#pragma once
// Sets of numbers that are joined one by one (union by least number, paths halved).

#include <cstdint>
#include <numeric>
#include <vector>

namespace ln {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }

  /// The least number of the set that `i` is in.
  std::uint32_t find(std::uint32_t i) {
    for (; parent_[i] != i; i = parent_[i]) parent_[i] = parent_[parent_[i]];
    return i;
  }

  void join(std::uint32_t i, std::uint32_t j) {
    i = find(i);
    j = find(j);
    if (i < j)
      parent_[j] = i;
    else
      parent_[i] = j;
  }

  /// For each number the number of its set, 0 to `count` - 1 in the order of their least elements.
  std::vector<std::uint32_t> labels(std::uint32_t& count) {
    std::vector<std::uint32_t> label(parent_.size());
    count = 0;
    for (std::uint32_t i = 0; i < parent_.size(); ++i) {
      const std::uint32_t least = find(i);
      label[i] = least == i ? count++ : label[least];
    }
    return label;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace ln
