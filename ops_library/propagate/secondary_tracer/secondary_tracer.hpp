#pragma once

#include "ln/operator.hpp"
#include "ln/photon_tracer.hpp"

namespace ln::ops {

/// Hits of particles that were traced from secondary sources; see secondary_tracer.ln.
template <class Via>
struct SecondaryTracer {
  NodeId node;
  std::int64_t count = 200'000;

  template <class In>
  void prepare(PrepareContext& context, const In& light) {
    const auto source = [&](Tracer& tracer, const SampleStream& random, const Interaction& at) {
      tracer.enter(node);
      Request<Events::D> request(tracer, random, at, Color(1), 1, RayKind::gather);
      return light(request);
    };
    photons_ = trace_secondary_photons(context, node, source, path_automaton<Via>(), static_cast<std::uint64_t>(count));
  }

  /// The Photons wire.
  const Photons& photons() const { return photons_; }

  /// Where the light of all particles went.
  const PhotonLedger& ledger() const { return photons_.ledger; }

  // State.
  Photons photons_{};
};

}  // namespace ln::ops
