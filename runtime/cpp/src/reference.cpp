#include "ln/reference.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <optional>

#include "ln/letters.hpp"
#include "ln/reference_paths.hpp"
#include "ln/run.hpp"

namespace ln {

namespace {

constexpr NodeId kParticles = 1;
constexpr Events kSmooth = Events::DG;

/// The events that exist on the surface and scatter in all directions.
bool is_smooth(const Interaction& at, int event) { return any(at.bsdf().events() & kEvents[event] & kSmooth); }

bool is_visible(Tracer& tracer, NodeId node, const Interaction& from, const SurfacePosition& to, Random& random) {
  return !tracer.occluded(spawn_ray_to(from.at, to), random.bits(), node);
}

/// The side of a surface from which emitters matter, as a normal; zero: both sides.
Vec3 emitter_side(const Interaction& at) {
  if (at.bsdf().transmits_smoothly()) return Vec3(0);
  return at.front ? at.at.ng : -at.at.ng;
}

/// Weight of a technique of density `a` beside one of density `b` (balance heuristic; Veach 1997, eq. 9.8).
float balance(float a, float b) { return a / (a + b); }

/// The last surface of an eye path that scattered by D or G, and the density of the direction that it chose.
struct Departure {
  SurfacePosition at;
  Vec3 side;
  float pdf_w;
};

/// A surface that a particle has reached; `flux` arrives there, `state` is that of its way so far.
struct ParticleVertex {
  Ray ray;
  Hit hit;
  Color flux;
  int state;
};

/// Light that a particle brings to a pixel.
struct Splat {
  std::size_t pixel;
  Color value;
};

class ReferencePaths {
 public:
  ReferencePaths(const Scene& scene, const PathLanguage& language)
      : scene_(scene), language_(language), emitters_(scene, language) {
    has_specular_beginnings_ = letters_of(scene, {}).kinds[LetterSet::specular] != 0 &&
                               std::any_of(emitters_.all().begin(), emitters_.all().end(),
                                           [&](const EmitterClass& c) { return c.delta && language.after(0, c.letter) >= 0; });
  }

  /// Are there paths L@delta S ...?
  bool has_specular_beginnings() const { return has_specular_beginnings_; }

  /// One sample of the radiance along a camera ray, but for what particles bring to the camera.
  Color radiance(Tracer& tracer, Ray ray, Random& random) const {
    Color result(0), beta(1);
    States rest = language_.before(language_.ends(), language_.eye());
    std::optional<Departure> departure;
    bool begins_specular = false;
    for (std::uint32_t depth = 1;; ++depth) {
      const Hit hit = tracer.intersect(ray, random.bits(), kEye, depth == 1 ? RayKind::camera : RayKind::gather);
      if (!hit.found()) return result + beta * environment(rest, ray.direction, departure);
      const Interaction at(scene_, ray, hit);
      beta *= at.transmittance;
      result += beta * emission(at, rest, departure);
      const float survival = survival_probability(beta, at, depth - 1);
      if (survival < 1 && random.get1() >= survival) return result;
      beta /= survival;

      // Read each event backwards: what may come before it?
      States before[kEventCount];
      EventChoice allowed;
      for (int e = 0; e < kEventCount; ++e) {
        before[e] = language_.before(rest, language_.event(e, scene_.part_tags(at.part)));
        allowed[e] = before[e].any();
      }
      const std::array<float, kEventCount> probabilities = event_probabilities(at, allowed);
      result += beta * light_samples(tracer, at, before, probabilities, random);
      if (begins_specular && has_specular_beginnings()) result += beta * connections(tracer, at, before, random);

      const Scattering s = scatter(at, probabilities, Carried::radiance, random);
      if (s.event < 0) return result;
      if (depth == 1) begins_specular = s.event == kSpecular;
      beta *= s.weight;
      rest = before[s.event];
      departure.reset();
      if (s.event != kSpecular) departure = Departure{at.at, emitter_side(at), s.pdf_w};
      ray = spawn_ray(at.at, s.direction);
    }
  }

  /// One particle of each class of delta emitters: calls `splat(position in the picture, color)` for each of its surfaces
  /// L@delta S ... (D|G) that the camera sees.
  template <class Sink>
  void trace_to_camera(Tracer& tracer, const CameraRays& camera, Random& random, Sink&& splat) const {
    for (const EmitterClass& source : emitters_.all()) {
      if (!source.delta) continue;
      trace_particle(tracer, kParticles, language_, source, random, [&](const Arrival& a) {
        if (a.last_event < 0) return kSpecularOnly;
        const Interaction& at = a.at;
        if (const std::optional<CameraView> view = camera.view(at.at.p)) {
          Color f_cos(0);
          for (int e = 0; e < kEventCount; ++e) {
            const int next = is_smooth(at, e) ? language_.after(a.state, language_.event(e, scene_.part_tags(at.part))) : -1;
            if (next >= 0 && language_.after(next, language_.eye()) >= 0)
              f_cos += scattered(at, view->direction, e, Carried::flux);
          }
          if (!is_black(f_cos) && is_visible(tracer, kParticles, at, view->end, random))
            splat(view->pixel,
                  a.flux * f_cos * (view->importance * arrival_factor(at) * departure_factor(at, view->direction)));
        }
        return kAllEvents;
      });
    }
  }

 private:
  using States = PathLanguage::States;
  static constexpr EventChoice kAllEvents = {true, true, true}, kSpecularOnly = {false, false, true};

  /// Does a path that begins with an emitter of this class fit to `rest`?
  bool begins(const EmitterClass& source, const States& rest) const {
    const int state = language_.after(0, source.letter);
    return state >= 0 && rest[static_cast<std::size_t>(state)];
  }

  Color environment(const States& rest, const Vec3& direction, const std::optional<Departure>& departure) const {
    const EmitterClass* source = emitters_.of_environment();
    if (!source || !begins(*source, rest)) return Color(0);
    const float by_light = departure ? source->emitters->environment_pdf_w(departure->at, departure->side, direction) : 0;
    return source->emitters->environment(direction) * (departure ? balance(departure->pdf_w, by_light) : 1.0f);
  }

  Color emission(const Interaction& at, const States& rest, const std::optional<Departure>& departure) const {
    const EmitterClass* source = emitters_.of_part(at.part);
    if (!source || !begins(*source, rest)) return Color(0);
    const float by_light = departure ? source->emitters->pdf_w(departure->at, departure->side, at.hit, -at.wo) : 0;
    return source->emitters->radiance(at.hit, at.wo) * (departure ? balance(departure->pdf_w, by_light) : 1.0f);
  }

  /// Light from a sample of each class of emitters.
  Color light_samples(Tracer& tracer, const Interaction& at, const States (&before)[kEventCount],
                      const std::array<float, kEventCount>& probabilities, Random& random) const {
    Color result(0);
    for (const EmitterClass& source : emitters_.all()) {
      if (language_.after(0, source.letter) < 0) continue;
      const float pick = random.get1();
      const LightSample light = source.emitters->sample(at.at, emitter_side(at), pick, random.get2());
      if (!(light.pdf_w > 0) || is_black(light.radiance)) continue;
      Color f_cos(0);
      for (int e = 0; e < kEventCount; ++e) {
        if (!is_smooth(at, e) || !begins(source, before[e])) continue;
        const float by_bsdf =
            source.delta ? 0 : probabilities[e] * at.bsdf().pdf_w(at.wo_local, at.frame.to_local(light.wi), kEvents[e]);
        f_cos += scattered(at, light.wi, e, Carried::radiance) * balance(light.pdf_w, by_bsdf);
      }
      if (is_black(f_cos)) continue;
      const Ray ray = light.distance < kInfinity ? spawn_ray_to(at.at, light.position) : spawn_ray(at.at, light.wi);
      if (!tracer.occluded(ray, random.bits(), kEye)) result += f_cos * light.radiance / light.pdf_w;
    }
    return result;
  }

  /// Light of paths L@delta S ... S E: of each class of delta emitters one particle, whose surfaces are connected with `at`.
  Color connections(Tracer& tracer, const Interaction& at, const States (&before)[kEventCount], Random& random) const {
    Color result(0);
    if (!any(at.bsdf().events() & kSmooth)) return result;
    for (const EmitterClass& source : emitters_.all()) {
      if (!source.delta) continue;
      std::vector<ParticleVertex> vertices;
      trace_particle(tracer, kEye, language_, source, random, [&](const Arrival& a) {
        // Two smooth events in a row are connected, never sampled.
        if (a.last_event != kSpecular) return kSpecularOnly;
        vertices.push_back({a.ray, a.at.hit, a.flux, a.state});
        return kAllEvents;
      });
      for (const ParticleVertex& vertex : vertices) result += connect(tracer, at, before, vertex, random);
    }
    return result;
  }

  Color connect(Tracer& tracer, const Interaction& x, const States (&before)[kEventCount], const ParticleVertex& vertex,
                Random& random) const {
    const Interaction y(scene_, vertex.ray, vertex.hit);
    const Vec3 d = x.at.p - y.at.p;
    const float squared = glm::dot(d, d);
    if (!(squared > 0)) return Color(0);
    const Vec3 w = d / std::sqrt(squared);
    Color f_cos(0);
    for (int i = 0; i < kEventCount; ++i) {
      const int next = is_smooth(y, i) ? language_.after(vertex.state, language_.event(i, scene_.part_tags(y.part))) : -1;
      for (int j = 0; j < kEventCount && next >= 0; ++j) {
        if (is_smooth(x, j) && before[j][static_cast<std::size_t>(next)])
          f_cos += scattered(y, w, i, Carried::flux) * scattered(x, -w, j, Carried::radiance);
      }
    }
    if (is_black(f_cos) || !is_visible(tracer, kEye, x, y.at, random)) return Color(0);
    return vertex.flux * f_cos * (arrival_factor(y) * departure_factor(y, w) / squared);
  }

  const Scene& scene_;
  const PathLanguage& language_;
  EmitterClasses emitters_;
  bool has_specular_beginnings_ = false;
};

class ReferenceProgram final : public NetworkRun {
 public:
  ReferenceProgram(const ProgramInfo& program, const PathLanguage& language, std::span<const TagRule> tags,
                   const std::int64_t& particles)
      : NetworkRun(program, tags), language_(language), particles_(particles) {}

  void render_tile(const Tile& tile, Film& film) override {
    Tracer& tracer = this->tracer(tile.worker);
    tracer.enter(kEye);
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        if (tile.stopped()) break;
        const std::size_t pixel = pixel_index(x, y);
        for (std::uint32_t i = tile.first_sample; i < tile.first_sample + tile.sample_count; ++i) {
          Random random(hash32(seed_hash(), static_cast<std::uint32_t>(pixel)), i);
          const Vec2 position = Vec2(static_cast<float>(x), static_cast<float>(y)) + random.get2();
          film.add(x, y, i, paths_->radiance(tracer, camera().ray(position), random) + splats_[pixel]);
        }
      }
    }
    tracer.enter(Tracer::kIdle);
  }

 protected:
  void prepare_network(PrepareStep& step) override {
    paths_.emplace(scene(), language_);
    splats_.assign(pixel_index(0, size().height), Color(0));
    if (paths_->has_specular_beginnings()) step(kParticles, [&](PrepareContext& context) { trace_particles(context); });
  }

 private:
  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size().width) + static_cast<std::size_t>(x);
  }

  /// Adds the particles up in the order of their numbers, a batch after the other, so that threads do not matter.
  void trace_particles(PrepareContext& context) {
    constexpr std::size_t kChunk = 4096, kBatch = 256 * kChunk;
    const auto count = static_cast<std::size_t>(particles_);
    const std::uint32_t key = hash32(seed_hash(), 0x73706c74u);
    std::vector<DVec3> sums(splats_.size(), DVec3(0));
    for (std::size_t first = 0; first < count; first += kBatch) {
      const std::size_t batch = std::min(kBatch, count - first);
      std::vector<std::vector<Splat>> chunks((batch - 1) / kChunk + 1);
      context.for_chunks(batch, kChunk, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
        for (std::size_t i = begin; i < end; ++i) {
          Random random(key, first + i);
          paths_->trace_to_camera(tracer, camera(), random, [&](const Vec2& position, const Color& value) {
            const Vec2 corner = glm::floor(position);
            if (corner.x < 0 || corner.y < 0 || corner.x >= static_cast<float>(size().width) ||
                corner.y >= static_cast<float>(size().height))
              return;
            chunks[begin / kChunk].push_back({pixel_index(static_cast<int>(corner.x), static_cast<int>(corner.y)), value});
          });
        }
      });
      for (const std::vector<Splat>& chunk : chunks)
        for (const Splat& splat : chunk) sums[splat.pixel] += DVec3(splat.value);
    }
    for (std::size_t i = 0; i < sums.size(); ++i) splats_[i] = Color(sums[i] / static_cast<double>(count));
  }

  const PathLanguage& language_;
  const std::int64_t& particles_;
  std::optional<ReferencePaths> paths_;
  std::vector<Color> splats_;  // by pixel: radiance that particles bring to the camera
};

}  // namespace

int run_reference(int argc, char** argv, const char* text, const PathLanguage& paths, std::span<const TagRule> tags) {
  std::int64_t particles = 1'000'000;
  const ParameterSlot parameters[] = {
      {.node = "particles",
       .name = "count",
       .kind = ParameterKind::count,
       .value = &particles,
       .minimum = 1,
       .maximum = 1e12,
       .summary = "Particles from each kind of delta emitter, for paths L@delta S ... (D|G) E."}};
  const NodeInfo nodes[] = {{.name = "image", .op = "Image", .line = 0}, {.name = "particles", .op = "Particles", .line = 0}};
  const ProgramInfo program = {
      .network = "reference", .source_file = "", .image_paths = text, .parameters = parameters, .nodes = nodes};
  ReferenceProgram run(program, paths, tags, particles);
  return run_program(argc, argv, program, run);
}

}  // namespace ln
