#pragma once
// The light sources of a scene: which light arrives at a point, which light leaves into the scene.

#include <memory>
#include <string>
#include <vector>

#include "ln/distribution.hpp"
#include "ln/emitter_environment.hpp"
#include "ln/emitter_shapes.hpp"
#include "ln/light_bvh.hpp"
#include "ln/photon_aim.hpp"
#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// Light that may arrive at a point from one emitter.
struct LightSample {
  Vec3 wi{0, 0, 1};    // towards the emitter
  Color radiance{0};   // area: radiance emitted towards the point; delta: irradiance on a surface facing it [per pdf_w = 1]
  float pdf_w = 0;     // selection probability times solid-angle density; delta emitters: selection probability
  bool delta = false;  // point, spot, directional: no BSDF sample can find it
  float distance = kInfinity;  // infinite: environment, directional
  SurfacePosition position;    // on the emitter, if the distance is finite (ng = 0 for point lights)
};

/// A particle of light that leaves an emitter.
struct PhotonEmission {
  SurfacePosition position;  // spawn_ray(position, direction) is its way; ng = 0: not on a surface
  Vec3 direction{0, 0, 1};
  Color flux{0};         // power / probability [W / unit^2]: the mean over all particles is total_power(); black: skip it
  float cos_theta = 1;   // of the direction to the emitter's normal; 1 where there is none
  bool delta = false;    // from a point, spot or directional light
  bool distant = false;  // from a directional light or the environment: it enters the scene from outside
  std::uint32_t triangle = kNoTriangle;  // an emissive surface: where it starts
};

/// Which of a scene's parts and lights take part, by number; empty: all.
struct EmitterSelection {
  std::vector<bool> parts, lights;
};

/// All light sources of a scene, or a selection of them. Refers to the scene and to the picture of the environment,
/// which must outlive it. Reading is thread-safe; nothing is allocated after construction.
class Emitters {
 public:
  explicit Emitters(const SceneData& scene, const Image* environment = nullptr, const EmitterSelection& selection = {});

  /// The emitters on parts, and the punctual lights, whose number the predicates accept.
  template <class PartPredicate, class LightPredicate>
  Emitters(const SceneData& scene, const Image* environment, PartPredicate&& part, LightPredicate&& light)
      : Emitters(scene, environment, select(scene, part, light)) {}

  bool empty() const { return size() == 0; }
  /// Number of light sources, environment included; a parallelogram of two triangles is one.
  std::size_t size() const { return size_; }
  /// Is there light that a ray can find: emissive surfaces or an environment?
  bool has_area() const { return has_surfaces_ || has_environment(); }
  /// Are there point, spot or directional lights?
  bool has_delta() const { return !punctual_.empty() || !distant_.empty(); }
  bool has_environment() const { return environment_ != nullptr; }

  /// Light from one emitter, chosen by what it may contribute at `at`. `n`: the normal on the side that scatters (the
  /// shading normal of a reflecting receiver), or 0: light from any side is wanted. pdf_w = 0: no light can be found.
  LightSample sample(const SurfacePosition& at, const Vec3& n, float u_pick, const Vec2& u) const;

  /// Density [1/sr] with which `sample` at (`at`, `n`) finds the point that a ray from `at` along `wi` has hit; 0 for what
  /// is not an emitter of this set, or shows its dark side. It does not depend on where on the light the point is.
  float pdf_w(const SurfacePosition& at, const Vec3& n, const Hit& hit, const Vec3& /*wi*/) const {
    if (!has_surfaces_) return 0;
    const Surface& surface = surfaces_[scene_->triangle_part[hit.triangle]];
    return surface.emits ? surface_pdf_w(surface, at, n, hit) : 0.0f;
  }

  /// Radiance [W/(m^2 sr)] that the surface emits at `hit` towards `w_out`.
  Color radiance(const Hit& hit, const Vec3& w_out) const {
    if (!has_surfaces_) return Color(0);
    const Surface& surface = surfaces_[scene_->triangle_part[hit.triangle]];
    return surface.emits ? surface_radiance(surface, hit, w_out) : Color(0);
  }

  /// Radiance of the environment from direction `w`.
  Color environment(const Vec3& w) const { return environment_ ? environment_->radiance(w) : Color(0); }
  /// Density with which `sample` at (`at`, `n`) finds the environment in direction `w`.
  float environment_pdf_w(const SurfacePosition& at, const Vec3& n, const Vec3& w) const;

  /// A particle, its emitter chosen by power. Directional light and the environment shine through the disk that the
  /// scene's bounding sphere fills. With `aim`, light that meets nothing that is aimed at is left out: its particles are black,
  /// or there are none of them and the others stand for less power.
  PhotonEmission emit(float u_pick, const Vec2& u_position, const Vec2& u_direction, const PhotonAim* aim = nullptr) const;
  /// Power of all emitters [W / unit^2]; of distant light, what passes the scene's bounding sphere.
  const Color& total_power() const { return total_power_; }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// What a part of the scene emits.
  struct Surface {
    bool emits = false, varies = false, double_sided = false;
    std::uint32_t first_triangle = 0, first_slot = 0;  // light_of_triangle_[first_slot + triangle - first_triangle]
    Color radiance{0};
  };
  struct DistantLight {
    Vec3 direction{0, 0, -1};  // in which the light travels
    Color irradiance{0};
  };
  /// How the choice among finite lights, distant lights and the environment stands at a receiver.
  struct Choice {
    LightBvh::Lanes root;
    float finite = 0, distant = 0, environment = 0;  // probabilities; all 0: no light can be found
    float distant_importance = 0;                    // sum over the distant lights
  };

  template <class PartPredicate, class LightPredicate>
  static EmitterSelection select(const SceneData& scene, PartPredicate&& part, LightPredicate&& light) {
    EmitterSelection selection;
    for (std::size_t i = 0; i < scene.parts.size(); ++i) selection.parts.push_back(static_cast<bool>(part(i)));
    for (std::size_t i = 0; i < scene.lights.size(); ++i) selection.lights.push_back(static_cast<bool>(light(i)));
    return selection;
  }

  void add_surfaces(const EmitterSelection& selection);
  void add_lights(const EmitterSelection& selection);
  void build_tree();
  void build_power();

  Choice choose(const Vec3& p, const Vec3& n) const;
  float distant_importance(const DistantLight& light, const Vec3& n) const;
  LightSample sample_several(const SurfacePosition& at, const Vec3& n, float u_pick, const Vec2& u) const;
  LightSample sample_area(const SurfacePosition& at, const AreaLight& light, float pmf, const Vec2& u) const;
  LightSample sample_finite(const SurfacePosition& at, std::uint32_t index, float pmf, const Vec2& u) const;
  LightSample sample_distant(const Vec3& n, float u, float pmf, float total) const;

  LightSample sample_environment(const Vec3& n, float pmf, const Vec2& u) const;

  float surface_pdf_w(const Surface& surface, const SurfacePosition& at, const Vec3& n, const Hit& hit) const;
  Color surface_radiance(const Surface& surface, const Hit& hit, const Vec3& w_out) const;
  Color varying_radiance(std::uint32_t triangle, float u, float v) const;
  Color mean_radiance(std::uint32_t triangle, int most_samples) const;

  const SceneData* scene_;
  bool has_surfaces_ = false;
  std::size_t size_ = 0;
  std::uint32_t area_count_ = 0, finite_count_ = 0;  // finite lights: surfaces, then points and spots
  std::vector<Surface> surfaces_;                    // by part
  std::vector<std::uint32_t> light_of_triangle_;     // of the emitting parts only; kNone: without power
  std::vector<AreaLight> area_;                      // finite light i: area_[i], then punctual_
  std::vector<PunctualSource> punctual_;
  std::vector<DistantLight> distant_;
  std::unique_ptr<Environment> environment_;
  LightBvh tree_;            // of the finite lights, where there is more than one
  float distant_scale_ = 1;  // makes irradiances comparable with the tree's importances
  float scene_radius_ = 1;
  Distribution power_;  // finite lights, distant lights, environment
  Color total_power_{0};
};

struct TapFile;
/// Particles that leave the emitters, picked by power. Formats: .ply, .csv.
void write_tap(const TapFile& tap, const Emitters& emitters);

}  // namespace ln
