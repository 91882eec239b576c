#pragma once
// --verify-paths: does every wire carry the light that its declaration says, no more and no less?
//
// For each wire, the energy that it brings to surfaces is compared with the energy of particles that are traced from the
// emitters by plain code and counted as often as the wire's automaton counts their way (reference_paths.hpp). Surfaces are told
// apart by the tags of the network, and those count that scatter by what the wire's contents can be scattered by: D for
// irradiance, D and G for samples, all for radiance. Everything, the network's preparation included, is done anew in
// independent batches, from whose spread the standard errors come.
//
// How the energy of a representation is measured is an overload of `wire_energy`; a representation without one is listed as not
// compared. This header is read with every network, so it holds declarations only.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ln/parallel.hpp"
#include "ln/path_language.hpp"
#include "ln/prepare.hpp"
#include "ln/program.hpp"
#include "ln/receiver.hpp"

namespace ln {

struct Photons;
struct SortedPhotons;
class PhotonMap;

/// A wire, as the generated program describes it.
struct WireInfo {
  NodeId node;
  PathLanguage paths;           // what the eye sees of it: a path that arrives at a surface goes on by D, then E
  std::span<const int> counts;  // by state of `paths`: how often a path that ends there is counted
  std::span<const int> routes;  // the same without regard to signs
  Events receivers;             // a surface counts if it scatters by one of them
  float bias;                   // relative bound: the sum of those of all operators on the way
  const char* reason;           // why its energy cannot be compared; empty: it can
};

/// Energy that arrives at surfaces.
struct WireEnergy {
  std::vector<double> flux;         // [W / unit^2] by combination of tags; or one number for all together
  bool at_shading_normals = false;  // weighted by |cos to the shading normal / cos to the geometric normal|, see trace_photons
};

/// What measuring a wire may use: the scene, random points on it, random numbers.
class EnergySampler;

// --- Representations -------------------------------------------------------------------------------------------------

/// Irradiance at one side of a surface [W/m^2], or an unbiased sample of it.
using IrradianceSource = FunctionRef<Color(Tracer&, const SampleStream&, const Hit&, bool front)>;

WireEnergy wire_energy(const EnergySampler& sampler, IrradianceSource irradiance);
WireEnergy wire_energy(const EnergySampler& sampler, const Photons& photons);
WireEnergy wire_energy(const EnergySampler& sampler, const SortedPhotons& photons);
/// A map does not keep the triangles of its photons: all classes of surfaces together.
WireEnergy wire_energy(const EnergySampler& sampler, const PhotonMap& map);

/// Irradiance that is stored on surfaces: QuadTree, TriMesh.
template <class Stored>
  requires requires(const Stored& stored) { Color(stored.irradiance(std::uint32_t{}, 0.0f, 0.0f, true)); }
WireEnergy wire_energy(const EnergySampler& sampler, const Stored& stored) {
  return wire_energy(sampler, [&](Tracer&, const SampleStream&, const Hit& hit, bool front) {
    return stored.irradiance(hit.triangle, hit.u, hit.v, front);
  });
}

/// What answers the requests of a Points wire, as an IrradianceSource. `kScene` as in Request. They are of the type by which
/// the eye asks (see run.hpp), so the compiler has nothing to instantiate anew.
template <Events kScene, class Pull>
auto irradiance_of(Pull pull) {
  constexpr Events kWhite = any(kScene & Events::D) ? kScene : Events::all;
  return [pull](Tracer& tracer, const SampleStream& random, const Hit& hit, bool front) {
    const Interaction at(tracer.scene(), hit, front, white_receiver());
    Request<Events::DG & kWhite, kWhite, kWhite> request(tracer, random, at, Color(1), 1, RayKind::gather);
    return kPi * pull(request);
  };
}

// --- Comparison ------------------------------------------------------------------------------------------------------

struct VerificationReport {
  std::string table;  // of wires and classes of surfaces
  int deviating_wires = 0;
};

/// Compares all wires of a network, batch by batch.
class Verification {
 public:
  static constexpr std::uint32_t kBatches = 32, kDefaultSamples = 8192;

  /// `samples`: points for each wire, and particles of each kind of emitter, in a batch.
  Verification(const Scene& scene, const ProgramInfo& program, std::span<const TagRule> tags, std::uint32_t samples);
  ~Verification();

  /// Begins a batch; `context` is that of its preparation.
  void begin_batch(PrepareContext& context);
  /// A wire with what it carries after the batch's preparation; the same wires in the same order in every batch.
  template <class Carried>
  void measure(const WireInfo& wire, const Carried& carried) {
    if constexpr (requires(const EnergySampler& sampler) { wire_energy(sampler, carried); }) {
      measure_energy(wire, [&](const EnergySampler& sampler) { return wire_energy(sampler, carried); });
    } else {
      leave_out(wire);
    }
  }
  /// Traces the batch's particles.
  void end_batch();

  VerificationReport report() const;

 private:
  void measure_energy(const WireInfo& wire, FunctionRef<WireEnergy(const EnergySampler&)> energy);
  void leave_out(const WireInfo& wire);

  class Comparisons;
  std::unique_ptr<Comparisons> comparisons_;
};

}  // namespace ln
