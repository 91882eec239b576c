#pragma once

#include "ln/operator.hpp"
#include "ln/photon_tracer.hpp"

namespace ln::ops {

/// Hits of particles that were traced from the emitters; see particle_tracer.ln.
template <class Via>
struct ParticleTracer {
  NodeId node;
  std::int64_t count = 200'000;

  void prepare(PrepareContext& context, const Emitters& light) {
    photons_ = trace_photons(context, node, light, path_automaton<Via>(), static_cast<std::uint64_t>(count));
  }

  /// The Photons wire.
  const Photons& photons() const { return photons_; }

  /// Where the light of all particles went.
  const PhotonLedger& ledger() const { return photons_.ledger; }

  // State.
  Photons photons_{};
};

}  // namespace ln::ops
