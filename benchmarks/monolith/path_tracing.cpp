// A path tracer written by hand on the same runtime, as one would without networks: one loop with a throughput, next event
// estimation and a BSDF sample at every surface. It computes what examples/path_tracing.ln computes, with the same random
// numbers, so that pictures and numbers of rays can be compared and the cost of the network be measured.

#include "ln/run.hpp"

namespace {

using namespace ln;

// The random numbers of the network's nodes: `direct` is its second node.
constexpr NodeId kDirect = 2;
constexpr std::uint32_t kPosition = kOwn + kDirect * 2, kPick = kPosition + 1;

class PathTracing final : public NetworkRun {
 public:
  using NetworkRun::NetworkRun;

  void render_tile(const Tile& tile, Film& film) override {
    Tracer& tracer = this->tracer(tile.worker);
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        if (tile.stopped()) return;
        const std::uint32_t key = hash32(hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)), seed_hash());
        for_samples(key, tile.first_sample, tile.first_sample + tile.sample_count, tracer, [&](const SampleStream& random) {
          const Vec2 pixel = Vec2(static_cast<float>(x), static_cast<float>(y)) + random.get2(0, kOwn);
          film.add(x, y, random.index(), radiance(tracer, camera().ray(pixel), random));
        });
      }
    }
  }

 protected:
  void prepare_network(PrepareStep&) override {}

 private:
  static Color radiance(Tracer& tracer, Ray ray, const SampleStream& random) {
    const Scene& scene = tracer.scene();
    const Emitters& emitters = scene.emitters();
    Color result(0), beta(1);
    SurfacePosition from;  // where the ray came from
    Vec3 from_side(0);
    float pdf_w = 0;   // density of the ray's direction; 0: from the eye or specular
    bool seen = true;  // only specular surfaces so far

    for (std::uint32_t depth = 0;; ++depth) {
      const RayKind kind = seen ? RayKind::camera : RayKind::gather;
      const Hit hit = tracer.intersect(ray, random.bits(depth, kCoverage + 1), seen ? kEye : kDirect, kind);
      if (!hit.found()) {
        const Color light = emitters.environment(ray.direction);
        if (is_black(light)) return result;
        const float weight = pdf_w > 0 ? mis_weight(pdf_w, emitters.environment_pdf_w(from, from_side, ray.direction)) : 1;
        return result + beta * light * weight;
      }

      const Color light = emitters.radiance(hit, -ray.direction);
      if (!is_black(light)) {
        const float weight = pdf_w > 0 ? mis_weight(pdf_w, emitters.pdf_w(from, from_side, hit, ray.direction)) : 1;
        result += beta * light * weight;
      }
      const Interaction at(scene, ray, hit);
      if (!any(at.bsdf().events())) return result;
      beta *= at.transmittance;

      // Russian roulette.
      if (!seen) {
        const float survival = survival_probability(beta, at, depth);
        if (survival < 1) {
          if (random.get1(depth, kRoulette) >= survival) return result;
          beta /= survival;
        }
      }

      const std::uint32_t vertex = depth + 1;
      from = at.at;
      from_side = at.bsdf().transmits_smoothly() ? Vec3(0) : at.front ? at.at.ng : -at.at.ng;

      // Light from an emitter.
      if (any(at.bsdf().events() & Events::DG)) {
        const LightSample s = emitters.sample(from, from_side, emitters.size() == 1 ? 0 : random.get1(vertex, kPick),
                                              random.get2(vertex, kPosition));
        if (s.pdf_w > 0 && !is_black(s.radiance)) {
          const Vec3 local = at.frame.to_local(s.wi);
          if (at.side_agrees(s.wi, local.z)) {
            const BsdfValue bsdf = at.bsdf().evaluate(at.wo_local, local);
            if (!is_black(bsdf.f_cos)) {
              const Ray shadow = s.distance < kInfinity ? spawn_ray_to(from, s.position) : spawn_ray(from, s.wi);
              if (!tracer.occluded(shadow, random.bits(vertex, kCoverage), kDirect)) {
                const float weight = s.delta ? 1.0f : mis_weight(s.pdf_w, bsdf.pdf_w);
                result += beta * bsdf.f_cos * s.radiance * (weight / s.pdf_w);
              }
            }
          }
        }
      }

      // The next direction.
      BsdfSample s;
      const float u_lobe = at.bsdf().single_lobe() ? 0 : random.get1(vertex, kBsdfLobe);
      if (!at.bsdf().sample(at.wo_local, u_lobe, random.get2(vertex, kBsdfDirection), Events::all, Carried::radiance, s))
        return result;
      const Vec3 wi = at.frame.to_world(s.wi);
      if (!at.side_agrees(wi, s.wi.z)) return result;
      beta *= s.weight;
      ray = spawn_ray(from, wi);
      pdf_w = s.pdf_w;
      if (s.event != Events::S) {
        seen = false;
      } else if (seen && depth >= 16) {
        const float survival = std::min(max_component(beta), 0.95f);
        if (random.get1(vertex, kRoulette) >= survival) return result;
        beta /= survival;
      }
    }
  }
};

constexpr NodeInfo kNodes[] = {{.name = "image", .op = "Image"},
                               {.name = "light", .op = "Lights"},
                               {.name = "direct", .op = "Direct"},
                               {.name = "pt", .op = "PathTracer"}};
constexpr ProgramInfo kProgram = {
    .network = "path_tracing_monolith", .source_file = "path_tracing.cpp", .image_paths = "", .nodes = kNodes};

}  // namespace

int main(int argc, char** argv) {
  PathTracing run(kProgram, {});
  return run_program(argc, argv, kProgram, run);
}
