#pragma once

#include "ln/cache.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// A PhotonMap wire that is kept in a file; see cache_photon_map.ln.
struct CachePhotonMap {
  NodeId node;
  std::string file;

  /// Reads the file, if it is of use.
  void open(PrepareContext& context, const CacheKey& key) { wire_.open(context, key, file); }
  /// Must the wire be computed?
  bool wanted() const { return wire_.wanted(); }

  void prepare(PrepareContext&, const PhotonMap& in) { wire_.keep(in, file); }

  /// The PhotonMap wire.
  const PhotonMap& photon_map() const { return wire_.get(); }

  // State.
  CachedWire<PhotonMap> wire_{};
};

}  // namespace ln::ops
