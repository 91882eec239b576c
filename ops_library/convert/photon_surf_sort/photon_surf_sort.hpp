#pragma once

#include "ln/operator.hpp"
#include "ln/sorted_photons.hpp"

namespace ln::ops {

/// Photons by surface; see photon_surf_sort.ln.
struct PhotonSurfSort {
  NodeId node;

  void prepare(PrepareContext& context, const Photons& photons) {
    sorted_ = sort_by_surface(context.scene().data(), photons.hits);
  }

  /// The SortedPhotons wire.
  const SortedPhotons& sorted_photons() const { return sorted_; }

  // State.
  SortedPhotons sorted_{};
};

}  // namespace ln::ops
