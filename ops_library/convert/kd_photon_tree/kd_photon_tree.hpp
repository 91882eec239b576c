#pragma once

#include "ln/operator.hpp"
#include "ln/photon_map.hpp"

namespace ln::ops {

/// Photons in a tree, for the nearest ones around a point; see kd_photon_tree.ln.
struct KDPhotonTree {
  NodeId node;

  void prepare(PrepareContext& context, const Photons& photons) { map_ = PhotonMap(context, photons.hits); }

  /// The PhotonMap wire.
  const PhotonMap& photon_map() const { return map_; }

  // State.
  PhotonMap map_{};
};

}  // namespace ln::ops
