#pragma once

#include "ln/cache.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// A SortedPhotons wire that is kept in a file; see cache_sorted_photons.ln.
struct CacheSortedPhotons {
  NodeId node;
  std::string file;

  /// Reads the file, if it is of use.
  void open(PrepareContext& context, const CacheKey& key) { wire_.open(context, key, file); }
  /// Must the wire be computed?
  bool wanted() const { return wire_.wanted(); }

  void prepare(PrepareContext&, const SortedPhotons& in) { wire_.keep(in, file); }

  /// The SortedPhotons wire.
  const SortedPhotons& sorted_photons() const { return wire_.get(); }

  // State.
  CachedWire<SortedPhotons> wire_{};
};

}  // namespace ln::ops
