#include "ln/photon_tracer.hpp"

#include <algorithm>
#include <atomic>
#include <optional>
#include <string>

#include "ln/error.hpp"
#include "ln/material.hpp"
#include "ln/request.hpp"
#include "ln/secondary_sources.hpp"
#include "ln/stats.hpp"

namespace ln {

PhotonLedger& PhotonLedger::operator+=(const PhotonLedger& other) {
  emitted += other.emitted;
  absorbed += other.absorbed;
  escaped += other.escaped;
  roulette_gain += other.roulette_gain;
  roulette_loss += other.roulette_loss;
  roulette_squares += other.roulette_squares;
  particles += other.particles;
  return *this;
}

namespace {

constexpr int kEventCount = 3;
constexpr Events kLetters[kEventCount] = {Events::D, Events::G, Events::S};

/// Correction by ratios of cosines to shading and geometric normals is cut off here: beyond it is noise of grazing light.
constexpr float kMaxShadingCorrection = 8;

/// From this bounce on, roulette ends paths also where nothing is absorbed: closed mirrors, white furnaces.
constexpr std::uint32_t kForcedRoulette = 48;
constexpr float kForcedSurvival = 0.95f;

/// One part in so many of the memory that is free may be filled with photons: sorting them needs as much again.
constexpr std::uint64_t kMemoryShare = 3;

/// Which states of an automaton can still reach an accepting one.
std::vector<bool> live_states(const PathAutomaton& via) {
  std::vector<bool> live(via.accepting, via.accepting + via.states);
  for (bool changed = true; changed;) {
    changed = false;
    for (int s = 0; s < via.states; ++s) {
      for (int c = 0; c < via.columns() && !live[s]; ++c) {
        const int n = via.next[s * via.columns() + c];
        if (n >= 0 && live[n]) live[s] = changed = true;
      }
    }
  }
  return live;
}

/// Events of a surface that lead to one state.
struct EventGroup {
  Events events = Events::none;
  int state = -1;
};

/// Parts where a path of the expression can have its first event.
std::vector<bool> starting_parts(const Scene& scene, const PathAutomaton& via, const std::vector<bool>& live) {
  const SceneData& data = scene.data();
  std::vector<bool> can_start(data.parts.size());
  for (std::uint32_t p = 0; p < data.parts.size(); ++p) {
    const Events events = possible_events(data, data.materials[data.parts[p].material]);
    for (int e = 0; e < kEventCount; ++e) {
      const int next = via.after(0, e, tag_mask(scene.part_tags(p), via.tags, via.tag_count));
      if (any(events & kLetters[e]) && next >= 0 && live[next]) can_start[p] = true;
    }
  }
  return can_start;
}

/// Where the particle of these random numbers starts.
using ParticleSource = FunctionRef<PhotonEmission(Tracer&, const SampleStream&)>;

/// The photons of a run of particles.
class ParticleChunk {
 public:
  ParticleChunk(Tracer& tracer, NodeId node, const ParticleSource& source, const PathAutomaton& via,
                const std::vector<bool>& live, double count, std::vector<Photon>& hits)
      : tracer_(tracer),
        scene_(tracer.scene()),
        node_(node),
        source_(source),
        via_(via),
        live_(live),
        share_(static_cast<float>(1 / count)),
        hits_(hits) {}

  void trace(const SampleStream& random) {
    ++ledger_.particles;
    const PhotonEmission start = source_(tracer_, random);
    Color flux = start.flux * share_;
    ledger_.emitted += DVec3(flux);
    const float full = max_component(flux);
    if (!(full > 0)) return;

    DVec3 roulette(0);
    Ray ray = spawn_ray(start.position, start.direction);
    int state = 0;
    for (std::uint32_t depth = 1;; ++depth) {
      const std::uint32_t dimension = depth * kPerVertex;
      const Hit hit = tracer_.intersect(ray, random.bits(dimension + kCoverage), node_, RayKind::photon);
      if (!hit.found()) {
        ledger_.escaped += DVec3(flux);
        break;
      }
      const Interaction at(scene_, ray, hit);
      if (at.transmittance != Color(1)) {
        const Color arriving = flux * at.transmittance;
        ledger_.absorbed += DVec3(flux) - DVec3(arriving);
        flux = arriving;
      }
      const float incoming = shading_correction(at);
      if (via_.accepting[state] && any(at.bsdf().events() & Events::DG)) store(at, flux * incoming);

      // Choose an event that leads on.
      BsdfSample sample;
      Vec3 direction(0);
      Color next(0);
      const int next_state = scatter(at, random, dimension, state, sample);
      if (next_state >= 0) {
        direction = at.frame.to_world(sample.wi);
        if (at.side_agrees(direction, sample.wi.z))
          next = flux * sample.weight * adjoint_correction(at, incoming, direction, sample.wi);
      }
      ledger_.absorbed += DVec3(flux) - DVec3(next);
      if (!(max_component(next) > 0)) break;

      // Keep the particle's power about constant.
      float survival = max_component(next) / full;
      if (depth >= kForcedRoulette) survival = std::min(survival, kForcedSurvival);
      if (survival < 1) {
        if (random.get1(dimension + kRoulette) >= survival) {
          roulette -= DVec3(next);
          ledger_.roulette_loss += DVec3(next);
          break;
        }
        const Color kept = next / survival;
        roulette += DVec3(kept) - DVec3(next);
        ledger_.roulette_gain += DVec3(kept) - DVec3(next);
        next = kept;
      }
      flux = next;
      state = next_state;
      ray = spawn_ray(at.at, direction);
    }
    ledger_.roulette_squares += roulette * roulette;
  }

  const PhotonLedger& ledger() const { return ledger_; }

 private:
  /// |cos to the shading normal / cos to the geometric normal| of the light that arrives.
  static float shading_correction(const Interaction& at) {
    const Vec3 ng = at.front ? at.at.ng : -at.at.ng;
    if (at.frame.n == ng) return 1;
    return std::min(at.wo_local.z / std::max(glm::dot(at.wo, ng), 1e-6f), kMaxShadingCorrection);
  }

  /// Scattering of flux at shading normals (Veach 1997, eq. 5.19). `incoming`: its factor for the light that arrives.
  static float adjoint_correction(const Interaction& at, float incoming, const Vec3& direction, const Vec3& local) {
    if (at.frame.n == (at.front ? at.at.ng : -at.at.ng)) return 1;
    const float outgoing = std::abs(glm::dot(direction, at.at.ng)) / std::max(std::abs(local.z), 1e-6f);
    return std::min(incoming * outgoing, kMaxShadingCorrection);
  }

  void store(const Interaction& at, const Color& flux) {
    Photon& photon = hits_.emplace_back();
    photon.position = at.at.p;
    photon.wi = pack_unit(at.wo);
    photon.normal = PackedNormal(at.front ? at.at.ng : -at.at.ng, at.front);
    photon.triangle = at.hit.triangle;
    photon.flux = PackedColor(flux / share_that_is_there(at.hit));
  }

  /// Of a surface with partial coverage: the probability with which the particle hit it. Divided by it, photons have the
  /// density of the irradiance where the surface is there.
  float share_that_is_there(const Hit& hit) const {
    if (hit.triangle < scene_.data().alpha_begin) return 1;
    return std::max(coverage(scene_.data(), hit.triangle, hit.u, hit.v), 1e-3f);
  }

  /// Samples one of the events that lead on. Returns the state that it leads to, or -1: the path ends here. Smooth lobes
  /// overlap, so events that lead to different states are told apart by choosing between them first.
  int scatter(const Interaction& at, const SampleStream& random, std::uint32_t dimension, int state, BsdfSample& sample) const {
    const std::uint32_t tags = tag_mask(scene_.part_tags(at.part), via_.tags, via_.tag_count);

    EventGroup groups[kEventCount];
    int group_count = 0;
    for (int e = 0; e < kEventCount; ++e) {
      if (!any(at.bsdf().events() & kLetters[e])) continue;
      const int next = via_.after(state, e, tags);
      if (next < 0 || !live_[next]) continue;
      int g = 0;
      while (g < group_count && groups[g].state != next) ++g;
      if (g == group_count) groups[group_count++].state = next;
      groups[g].events = groups[g].events | kLetters[e];
    }
    if (group_count == 0) return -1;

    float u = random.get1(dimension + kBsdfLobe);
    int chosen = 0;
    float probability = 1;
    if (group_count > 1) {
      float albedo[kEventCount], sum = 0;
      for (int g = 0; g < group_count; ++g) sum += albedo[g] = max_component(at.bsdf().albedo(at.wo_local, groups[g].events));
      if (!(sum > 0)) return -1;
      float rest = u * sum;
      while (chosen + 1 < group_count && rest >= albedo[chosen]) rest -= albedo[chosen++];
      if (!(albedo[chosen] > 0)) return -1;
      probability = albedo[chosen] / sum;
      u = std::min(rest / albedo[chosen], kOneMinusEpsilon);
    }
    if (!at.bsdf().sample(at.wo_local, u, random.get2(dimension + kBsdfDirection), groups[chosen].events, Carried::flux,
                          sample))
      return -1;
    sample.weight /= probability;
    return groups[chosen].state;
  }

  Tracer& tracer_;
  const Scene& scene_;
  const NodeId node_;
  const ParticleSource& source_;
  const PathAutomaton& via_;
  const std::vector<bool>& live_;
  const float share_;
  std::vector<Photon>& hits_;
  PhotonLedger ledger_;
};

std::string mebibytes(double bytes) { return std::to_string(static_cast<std::uint64_t>(bytes / (1 << 20)) + 1) + " MiB"; }

/// Key of the random numbers of an operator, for one `purpose`.
std::uint32_t stream_key(const PrepareContext& context, NodeId node, std::uint32_t purpose) {
  const std::uint64_t seed = context.seed();
  return hash32(hash32(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)), purpose + node);
}

Photons trace_particles(PrepareContext& context, NodeId node, const ParticleSource& source, const PathAutomaton& via,
                        const std::vector<bool>& live, std::uint64_t count) {
  constexpr std::uint64_t kChunk = 4096;
  Photons result;
  const std::uint64_t limit = available_memory_bytes() / kMemoryShare;
  const auto refuse_beyond_limit = [&](std::uint64_t photons) {
    const double bytes = static_cast<double>(photons) * sizeof(Photon);
    if (bytes > static_cast<double>(limit))
      throw Error("the photons need more than " + mebibytes(bytes) + " of memory, and only " +
                  mebibytes(static_cast<double>(limit)) + " may be used for them: lower the count of the particle tracer");
  };
  refuse_beyond_limit(count);
  if (count > 0xffffffffu) throw Error("a particle tracer can trace at most 4294967295 particles");

  struct Chunk {
    std::vector<Photon> hits;
    PhotonLedger ledger;
  };
  std::vector<Chunk> chunks((count - 1) / kChunk + 1);
  std::atomic<std::uint64_t> stored{0};
  const std::uint32_t key = stream_key(context, node, 0x70686f74u);
  context.for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    Chunk& chunk = chunks[begin / kChunk];
    ParticleChunk particles(tracer, node, source, via, live, static_cast<double>(count), chunk.hits);
    for (std::size_t i = begin; i < end; ++i) particles.trace(SampleStream(key, static_cast<std::uint32_t>(i)));
    chunk.ledger = particles.ledger();
    refuse_beyond_limit(stored += chunk.hits.size());
  });

  if (stored > 0xffffffffu) throw Error("a particle tracer can store at most 4294967295 photons: lower its count");
  result.hits.reserve(stored);
  for (Chunk& chunk : chunks) {
    result.hits.insert(result.hits.end(), chunk.hits.begin(), chunk.hits.end());
    std::vector<Photon>().swap(chunk.hits);
    result.ledger += chunk.ledger;
  }
  return result;
}

}  // namespace

Photons trace_photons(PrepareContext& context, NodeId node, const Emitters& light, const PathAutomaton& via,
                      std::uint64_t count) {
  const std::vector<bool> live = live_states(via);
  if (light.empty() || count == 0 || !live[0]) return {};

  std::optional<PhotonAim> aim;
  if (!via.accepting[0]) {
    const std::vector<bool> wanted = starting_parts(context.scene(), via, live);
    const auto number = std::count(wanted.begin(), wanted.end(), true);
    if (number == 0) return {};
    if (static_cast<std::size_t>(number) < wanted.size()) aim.emplace(context.scene().data(), wanted);
  }
  const auto emit = [&](Tracer&, const SampleStream& random) {
    return light.emit(random.get1(kBsdfLobe), random.get2(kOwn), random.get2(kBsdfDirection), aim ? &*aim : nullptr);
  };
  return trace_particles(context, node, emit, via, live, count);
}

Photons trace_secondary_photons(PrepareContext& context, NodeId node, const RadianceSource& source, const PathAutomaton& via,
                                std::uint64_t count) {
  const std::vector<bool> live = live_states(via);
  if (count == 0 || !live[0]) return {};
  const SecondarySources sources(context, node, source, stream_key(context, node, 0x70696c6fu), count / 16);
  if (sources.empty()) return {};
  // Other random numbers than those of the particles' ways, for the source may use any of them.
  const std::uint32_t key = stream_key(context, node, 0x7365636fu);
  const auto emit = [&](Tracer& tracer, const SampleStream& random) {
    return sources.emit(tracer, SampleStream(key, random.index()));
  };
  return trace_particles(context, node, emit, via, live, count);
}

}  // namespace ln
