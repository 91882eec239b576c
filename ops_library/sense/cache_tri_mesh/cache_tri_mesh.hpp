#pragma once

#include "ln/cache.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// A TriMesh wire that is kept in a file; see cache_tri_mesh.ln.
struct CacheTriMesh {
  NodeId node;
  std::string file;

  /// Reads the file, if it is of use.
  void open(PrepareContext& context, const CacheKey& key) { wire_.open(context, key, file); }
  /// Must the wire be computed?
  bool wanted() const { return wire_.wanted(); }

  void prepare(PrepareContext&, const TriMesh& in) { wire_.keep(in, file); }

  /// The TriMesh wire.
  const TriMesh& tri_mesh() const { return wire_.get(); }

  // State.
  CachedWire<TriMesh> wire_{};
};

}  // namespace ln::ops
