#pragma once
// What plain tracers that keep the paths of a language are made of. Nothing here is shared with operators: emitters by letter,
// one scattering event at a time, particles.

#include <array>
#include <memory>
#include <vector>

#include "ln/path_language.hpp"
#include "ln/random.hpp"
#include "ln/tracer.hpp"

namespace ln {

inline constexpr int kEventCount = 3;
inline constexpr Events kEvents[kEventCount] = {Events::D, Events::G, Events::S};
inline constexpr int kSpecular = 2;

/// The emitters that one letter stands for.
struct EmitterClass {
  bool delta;
  int state;  // of the language, after the letter
  std::unique_ptr<Emitters> emitters;
};

/// All emitters with which a word of the language may begin, by letter.
class EmitterClasses {
 public:
  EmitterClasses(const Scene& scene, const PathLanguage& language);

  const std::vector<EmitterClass>& all() const { return classes_; }
  /// The emitters of a part's letter, and of the environment's; null: there are none, or no word begins there.
  const EmitterClass* of_part(std::uint32_t part) const { return at(parts_[part]); }
  const EmitterClass* of_environment() const { return at(environment_); }

 private:
  const EmitterClass* at(int index) const { return index < 0 ? nullptr : &classes_[static_cast<std::size_t>(index)]; }

  std::vector<EmitterClass> classes_;
  std::vector<int> parts_;  // class of each part; -1: none
  int environment_ = -1;
};

/// For each event: may it be next?
using EventChoice = std::array<bool, kEventCount>;

/// Probabilities with which one of the events is chosen that are allowed and that the surface has: about by albedo; all 0: none.
std::array<float, kEventCount> event_probabilities(const Interaction& at, const EventChoice& allowed);

/// A scattering event and the direction in which the light, or the search for it, goes on.
struct Scattering {
  int event = -1;   // -1: absorbed
  Vec3 direction{0};
  Color weight{0};  // BSDF * |cos| / density, of this event
  float pdf_w = 0;  // density of event and direction together; 0: an ideal specular direction
};

/// Samples an event, then a direction from its lobe alone.
Scattering scatter(const Interaction& at, const std::array<float, kEventCount>& probabilities, Carried carried, Random& random);

/// BSDF * |cos| of one event towards `w` (world space).
Color scattered(const Interaction& at, const Vec3& w, int event, Carried carried);

/// Shading normals differ from geometric ones: light that arrives along a particle's way counts |wo . ns| / |wo . ng| times
/// as irradiance, and leaves towards `w` |w . ng| / |w . ns| times (Veach 1997, eq. 5.19). Exact: without bounds.
float arrival_factor(const Interaction& at);
float departure_factor(const Interaction& at, const Vec3& w);

/// A particle at a surface.
struct Arrival {
  const Interaction& at;
  const Ray& ray;   // that led here
  Color flux;       // that arrives [W / unit^2]
  int state;        // of the language so far
  int last_event;   // -1: straight from the emitter
};

/// Traces one particle of `source`. `visit(arrival)` is called at each surface and returns the events by which the particle may
/// go on.
template <class Visit>
void trace_particle(Tracer& tracer, NodeId node, const PathLanguage& language, const EmitterClass& source, Random& random, Visit&& visit) {
  const Scene& scene = tracer.scene();
  const float pick = random.get1();
  const Vec2 position = random.get2();
  const PhotonEmission start = source.emitters->emit(pick, position, random.get2());
  const float full = max_component(start.flux);
  if (!(full > 0)) return;

  Color flux = start.flux;
  Ray ray = spawn_ray(start.position, start.direction);
  int state = source.state, last_event = -1;
  for (std::uint32_t depth = 1;; ++depth) {
    const Hit hit = tracer.intersect(ray, random.bits(), node, RayKind::photon);
    if (!hit.found()) return;
    const Interaction at(scene, ray, hit);
    flux *= at.transmittance;
    EventChoice allowed = visit(Arrival{at, ray, flux, state, last_event});

    int next[kEventCount];
    for (int e = 0; e < kEventCount; ++e) {
      next[e] = language.after(state, language.event(e, scene.part_tags(at.part)));
      allowed[e] = allowed[e] && next[e] >= 0;
    }
    const Scattering s = scatter(at, event_probabilities(at, allowed), Carried::flux, random);
    if (s.event < 0) return;
    flux *= s.weight * arrival_factor(at) * departure_factor(at, s.direction);
    state = next[s.event];
    last_event = s.event;
    ray = spawn_ray(at.at, s.direction);

    constexpr std::uint32_t kRouletteFrom = 3;
    if (depth < kRouletteFrom) continue;
    const float survival = std::min(max_component(flux) / full, 0.95f);
    if (random.get1() >= survival) return;
    flux /= survival;
  }
}

}  // namespace ln
