#pragma once
// Particles from the emitters through the scene: the common part of all particle tracers, compiled once.

#include <vector>

#include "ln/photon.hpp"
#include "ln/prepare.hpp"

namespace ln {

struct TapFile;

/// A path expression as a finite automaton over the events D, G, S, each with the tags of the surface that scatters.
struct PathAutomaton {
  const int* next;        // [state * columns + (event << tag_count | tags)]; -1: no such path
  const bool* accepting;  // [state]
  const int* tags;        // numbers of the tags that it tells apart
  int states, tag_count;

  int columns() const { return 3 << tag_count; }
  int after(int state, int event, std::uint32_t tag_bits) const {
    return next[state * columns() + (event << tag_count | static_cast<int>(tag_bits))];
  }
};

/// The automaton of a generated path type (see operator.hpp).
template <class Via>
PathAutomaton path_automaton(Via = {}) {
  constexpr int states = static_cast<int>(sizeof(Via::accepting) / sizeof(bool));
  int tag_count = 0;
  const int* tags = nullptr;
  if constexpr (requires { Via::tag_count; }) {
    tag_count = Via::tag_count;
    tags = Via::tags;
  }
  return {&Via::next[0][0], Via::accepting, tags, states, tag_count};
}

/// Where the light of a particle tracer went, per channel [W / SceneData::unit^2]. It closes:
///   emitted + roulette_gain = absorbed + escaped + roulette_loss
/// and roulette_gain - roulette_loss has the expected value 0. `absorbed` includes light that was not followed because no
/// path of the expression goes on with it.
struct PhotonLedger {
  DVec3 emitted{0}, absorbed{0}, escaped{0}, roulette_gain{0}, roulette_loss{0};
  DVec3 roulette_squares{0};  // of gain - loss, summed over particles: for its standard error
  std::uint64_t particles = 0;

  PhotonLedger& operator+=(const PhotonLedger& other);
};

/// The hits of particles, in the order of the particles.
struct Photons {
  std::vector<Photon> hits;
  PhotonLedger ledger;
};

/// Traces `count` particles from `light`, aimed at what can start a path of `via`, and keeps the hits at which the path so far
/// matches `via` and the surface can scatter by D or G. The flux that is kept is weighted by |cos to the shading normal / cos
/// to the geometric normal| and by 1 / coverage, so that its density over the surface is the irradiance that the surface's BSDF
/// sees. Same scene, seed and count: same bits, whatever the number of threads. Throws Error if the photons would take more
/// than a third of the free memory.
Photons trace_photons(PrepareContext& context, NodeId node, const Emitters& light, const PathAutomaton& via,
                      std::uint64_t count);

/// Radiance [W/(m^2 sr)] that leaves a point towards `wo`, or an estimate of it.
using RadianceSource = FunctionRef<Color(Tracer&, const SampleStream&, const Interaction& at)>;

/// The same from all sides of surfaces that scatter diffusely, which send out what `source` says: secondary sources. Where it
/// is bright is found out first, by some of `count` / 16 requests.
Photons trace_secondary_photons(PrepareContext& context, NodeId node, const RadianceSource& source, const PathAutomaton& via,
                                std::uint64_t count);

/// .ply: points with normal, direction and flux; .csv: the same as a table. Throws Error.
void write_tap(const TapFile& tap, const Photons& photons);

}  // namespace ln
