#pragma once
// What is asked of a Points wire: "what does this surface point make of the illumination on the wire?"

#include "ln/sampling.hpp"
#include "ln/tracer.hpp"

namespace ln {

/// A direction sampled from a BSDF and what the ray found there.
struct BsdfRay {
  Ray ray;
  Hit hit;          // not found: the ray left the scene
  Color weight{0};  // BSDF * |cos| / density
  float pdf_w = 0;  // 0: a specular direction
  Events event = Events::none;
};

/// A request at a surface point. The receiver scatters what it gets by the events in `kReceives` towards `wo`; answers
/// are the radiance [W/(m^2 sr)] that leaves towards `wo` because of it. `kSamples` holds the events that the shared
/// sample may pick: more than `kReceives` where the sample serves somebody else, too (the eye follows S itself). `kScene`
/// holds the events that surfaces may have at all, where a program is compiled for one scene.
template <Events kReceives, Events kSamples = kReceives, Events kScene = Events::all>
class Request {
 public:
  using Answer = Color;
  static constexpr Events receives = kReceives;
  static constexpr Events scene_events = kScene;

  Request(Tracer& tracer, const SampleStream& random, const Interaction& at, const Color& beta, std::uint32_t depth,
          RayKind kind, std::uint32_t steps = 0, float distance = kInfinity)
      : tracer_(tracer),
        random_(random),
        at_(at),
        beta_(beta),
        distance_(distance),
        depth_(depth),
        steps_(steps),
        kind_(kind) {}

  /// The same request of a receiver that scatters by D alone, with a shared sample of its own.
  auto diffuse() const {
    return Request<kReceives & Events::D, kReceives & Events::D, kScene>(tracer_, random_, at_, beta_, depth_, kind_, steps_,
                                                                         distance_);
  }

  Tracer& tracer() { return tracer_; }
  const SampleStream& random() const { return random_; }
  const Interaction& at() const { return at_; }
  /// Number of surfaces between here and the eye.
  std::uint32_t depth() const { return depth_; }
  /// Number of steps of recursion that led here.
  std::uint32_t steps() const { return steps_; }
  /// Share of the answer that reaches the eye, of a branch as if it were alone: for decisions (roulette), never for results.
  const Color& beta() const { return beta_; }
  /// Length of the ray from another surface that led here [normalised units]; infinite where none did.
  float distance() const { return distance_; }
  /// An answer says that it is a mean over places up to `radius` [normalised units] from here.
  void blurred_over(float radius) { blur_ = std::max(blur_, radius); }
  /// The widest such mean so far.
  float blur() const { return blur_; }
  /// The point is seen by the eye, directly or by specular surfaces.
  bool seen() const { return kind_ == RayKind::camera; }

  /// Can the receiver scatter samples, i.e. light from directions of the operator's choice?
  bool takes_samples() const { return any(bsdf().events() & kReceives & Events::DG); }

  /// BSDF times |cos| for light from `wi`, and the solid-angle density with which the shared sample picks that direction.
  LN_INLINE BsdfValue evaluate(const Vec3& wi) const {
    const Vec3 local = at_.frame.to_local(wi);
    if (!at_.side_agrees(wi, local.z)) return {};
    static_assert((kReceives & Events::DG) == (kSamples & Events::DG), "the shared sample picks what the receiver scatters");
    return bsdf().evaluate(at_.wo_local, local, kSamples);
  }

  /// The side of the surface from which emitters matter, as a normal; zero: both sides.
  Vec3 emitter_side() const {
    if (any(kScene & Events::G) && bsdf().transmits_smoothly()) return Vec3(0);
    return at_.front ? at_.at.ng : -at_.at.ng;
  }

  /// Radiance that an irradiance becomes: diffuse reflection only. `irradiance(at)` [W/m^2] is asked where there is any.
  template <class Irradiance>
  LN_INLINE Color scatter_irradiance(Irradiance&& irradiance) const {
    if constexpr (any(kReceives & Events::D)) {
      if (any(bsdf().events() & Events::D)) return bsdf().diffuse_reflectance(at_.wo_local) * irradiance(at_) * kInvPi;
    }
    return Color(0);
  }

  /// Is the way to an emitter free?
  LN_INLINE bool visible(const LightSample& light, NodeId node) {
    const Ray ray = light.distance < kInfinity ? spawn_ray_to(at_.at, light.position) : spawn_ray(at_.at, light.wi);
    return !tracer_.occluded(ray, random_.bits(depth_, kCoverage), node);
  }

  /// The shared sample, drawn and traced when it is first asked for, at the cost of `node`; null if there is none that
  /// the receiver can scatter.
  LN_INLINE const BsdfRay* bsdf_ray(NodeId node) {
    if (!sample() || !any(sample_.event & kReceives)) return nullptr;
    if (!traced_) {
      traced_ = true;
      sample_.hit = tracer_.intersect(sample_.ray, random_.bits(depth_, kCoverage + 1), node, RayKind::gather);
    }
    return &sample_;
  }

  /// The shared sample without its ray being traced; null: nothing is scattered.
  LN_INLINE const BsdfRay* sample() {
    if (!sampled_) {
      sampled_ = true;
      valid_ = draw<kSamples>(random_, sample_);
    }
    return valid_ ? &sample_ : nullptr;
  }

  /// Makes `wi` (local) the shared sample. The caller has drawn it with the density of the BSDF; operators that would follow
  /// several directions follow this one only.
  void give_sample(const Vec3& wi) {
    const BsdfValue bsdf = at_.bsdf().evaluate(at_.wo_local, wi, kSamples);
    const Vec3 direction = at_.frame.to_world(wi);
    sampled_ = given_ = true;
    valid_ = bsdf.pdf_w > 0 && at_.side_agrees(direction, wi.z);
    sample_ = {spawn_ray(at_.at, direction), {}, valid_ ? bsdf.f_cos / bsdf.pdf_w : Color(0), bsdf.pdf_w, Events::D};
  }
  bool sample_given() const { return given_; }

  /// Another sample, of what the receiver scatters, drawn with the numbers of `random` and traced at the cost of `node`.
  /// False: nothing is scattered.
  bool trace_sample(const SampleStream& random, NodeId node, BsdfRay& sample) {
    if (!draw<kReceives>(random, sample)) return false;
    sample.hit = tracer_.intersect(sample.ray, random.bits(depth_, kCoverage + 1), node, RayKind::gather);
    return true;
  }

 private:
  /// The surface's BSDF, of which the compiler is told what is known of the scene.
  LN_INLINE const Bsdf& bsdf() const {
    const Bsdf& bsdf = at_.bsdf();
    if constexpr (kScene == Events::D)
      if (!bsdf.is_lambertian()) __builtin_unreachable();
    return bsdf;
  }

  template <Events kFrom>
  LN_INLINE bool draw(const SampleStream& random, BsdfRay& sample) const {
    BsdfSample s;
    const Bsdf& bsdf = this->bsdf();
    const float u_lobe = bsdf.single_lobe() ? 0 : random.get1(depth_, kBsdfLobe);
    if (!bsdf.sample(at_.wo_local, u_lobe, random.get2(depth_, kBsdfDirection), kFrom, Carried::radiance, s)) return false;
    const Vec3 wi = at_.frame.to_world(s.wi);
    sample.ray = spawn_ray(at_.at, wi);
    sample.weight = s.weight;
    sample.pdf_w = s.pdf_w;
    sample.event = s.event;
    return at_.side_agrees(wi, s.wi.z);
  }

  Tracer& tracer_;
  const SampleStream& random_;
  const Interaction& at_;
  Color beta_;
  float distance_, blur_ = 0;
  std::uint32_t depth_, steps_;
  RayKind kind_;
  bool sampled_ = false, valid_ = false, traced_ = false, given_ = false;
  union {
    BsdfRay sample_;  // if sampled_
  };
};

/// Russian roulette at a surface with `depth` surfaces between it and the eye: the probability with which a path goes on that
/// still carries the share `beta` of the light there. Paths keep a quarter of what they began with: early ends are dear where
/// the light is behind them, late ones cost rays. Long ones may end where nothing is absorbed, too.
inline float survival_probability(const Color& beta, const Interaction& at, std::uint32_t depth) {
  constexpr float kKept = 0.25f, kLargest = 0.95f;
  constexpr std::uint32_t kLong = 16;
  return std::min(max_component(beta) * at.bsdf().concentration() / kKept, depth < kLong ? 1.0f : kLargest);
}

/// Weight of a technique of density `a` beside one of density `b` for the same light (power heuristic; Veach 1997, eq. 9.14).
inline float mis_weight(float a, float b) {
  const float r = b / a;
  return 1 / (1 + r * r);
}

}  // namespace ln
