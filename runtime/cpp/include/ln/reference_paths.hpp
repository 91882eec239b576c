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
  int letter;
  std::unique_ptr<Emitters> emitters;
};

/// All emitters of a scene, by the letters of a language.
class EmitterClasses {
 public:
  EmitterClasses(const Scene& scene, const PathLanguage& letters);

  const std::vector<EmitterClass>& all() const { return classes_; }
  /// The emitters of a part's letter, and of the environment's; null: there are none.
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

/// Probabilities with which one of the events is chosen that are allowed and that the surface has: about by albedo; all 0:
/// none.
std::array<float, kEventCount> event_probabilities(const Interaction& at, const EventChoice& allowed);

/// A scattering event and the direction in which the light, or the search for it, goes on.
struct Scattering {
  int event = -1;  // -1: absorbed
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

/// Traces one particle. `arrive(at, ray, flux)` is told where it is and the flux that arrives [W / unit^2], and returns the
/// events by which it may go on; `leave(at, event)` is told which it took.
template <class Arrive, class Leave>
void trace_particle(Tracer& tracer, NodeId node, const Emitters& emitters, Random& random, Arrive&& arrive, Leave&& leave) {
  const float pick = random.get1();
  const Vec2 position = random.get2();
  const PhotonEmission start = emitters.emit(pick, position, random.get2());
  const float full = max_component(start.flux);
  if (!(full > 0)) return;

  Color flux = start.flux;
  Ray ray = spawn_ray(start.position, start.direction);
  for (std::uint32_t depth = 1;; ++depth) {
    const Hit hit = tracer.intersect(ray, random.bits(), node, RayKind::photon);
    if (!hit.found()) return;
    const Interaction at(tracer.scene(), ray, hit);
    flux *= at.transmittance;
    const EventChoice allowed = arrive(at, ray, flux);
    const Scattering s = scatter(at, event_probabilities(at, allowed), Carried::flux, random);
    if (s.event < 0) return;
    leave(at, s.event);
    flux *= s.weight * arrival_factor(at) * departure_factor(at, s.direction);
    ray = spawn_ray(at.at, s.direction);

    constexpr std::uint32_t kRouletteFrom = 3;
    if (depth < kRouletteFrom) continue;
    const float survival = std::min(max_component(flux) / full, 0.95f);
    if (random.get1() >= survival) return;
    flux /= survival;
  }
}

/// A particle at a surface, on a path of a language.
struct Arrival {
  const Interaction& at;
  const Ray& ray;  // that led here
  Color flux;      // that arrives [W / unit^2]
  int state;       // of the language so far
  int last_event;  // -1: straight from the emitter
};

/// The same for the paths of a language alone; `visit(arrival)` returns the events that it wants to go on by.
template <class Visit>
void trace_particle(Tracer& tracer, NodeId node, const PathLanguage& language, const EmitterClass& source, Random& random,
                    Visit&& visit) {
  int state = language.after(0, source.letter), last_event = -1;
  if (state < 0) return;
  const auto next = [&](const Interaction& at, int event) {
    return language.after(state, language.event(event, tracer.scene().part_tags(at.part)));
  };
  trace_particle(
      tracer, node, *source.emitters, random,
      [&](const Interaction& at, const Ray& ray, const Color& flux) {
        EventChoice allowed = visit(Arrival{at, ray, flux, state, last_event});
        for (int e = 0; e < kEventCount; ++e) allowed[e] = allowed[e] && next(at, e) >= 0;
        return allowed;
      },
      [&](const Interaction& at, int event) {
        state = next(at, event);
        last_event = event;
      });
}

}  // namespace ln
