#pragma once

#include "ln/cache.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// A QuadTree wire that is kept in a file; see cache_quad_tree.ln.
struct CacheQuadTree {
  NodeId node;
  std::string file;

  /// Reads the file, if it is of use.
  void open(PrepareContext& context, const CacheKey& key) { wire_.open(context, key, file); }
  /// Must the wire be computed?
  bool wanted() const { return wire_.wanted(); }

  void prepare(PrepareContext&, const QuadTree& in) { wire_.keep(in, file); }

  /// The QuadTree wire.
  const QuadTree& quad_tree() const { return wire_.get(); }

  // State.
  CachedWire<QuadTree> wire_{};
};

}  // namespace ln::ops
