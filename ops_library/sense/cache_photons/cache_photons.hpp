#pragma once

#include "ln/cache.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// A Photons wire that is kept in a file; see cache_photons.ln.
struct CachePhotons {
  NodeId node;
  std::string file;

  /// Reads the file, if it is of use.
  void open(PrepareContext& context, const CacheKey& key) { wire_.open(context, key, file); }
  /// Must the wire be computed?
  bool wanted() const { return wire_.wanted(); }

  void prepare(PrepareContext&, const Photons& in) { wire_.keep(in, file); }

  /// The Photons wire.
  const Photons& photons() const { return wire_.get(); }

  // State.
  CachedWire<Photons> wire_{};
};

}  // namespace ln::ops
