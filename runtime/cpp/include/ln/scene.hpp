#pragma once
// A scene ready to be rendered: geometry, materials, emitters, tags.

#include <memory>
#include <span>

#include "ln/accel.hpp"
#include "ln/bsdf.hpp"
#include "ln/dielectric_table.hpp"
#include "ln/emitters.hpp"
#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// A set of the network's tags, one bit each in the order in which the network declares them.
using TagSet = std::uint64_t;

/// What a parameter of a network selects: everything, what has a tag, or what has it not.
class TagSelection {
 public:
  constexpr TagSelection() = default;  // everything
  static constexpr TagSelection with(int tag) { return {TagSet{1} << tag, false}; }
  static constexpr TagSelection without(int tag) { return {TagSet{1} << tag, true}; }

  constexpr bool everything() const { return tag_ == 0; }
  /// Is something with these tags selected?
  constexpr bool operator()(TagSet tags) const { return ((tags & tag_) != 0) != negated_; }

 private:
  constexpr TagSelection(TagSet tag, bool negated) : tag_(tag), negated_(negated) {}

  TagSet tag_ = 0;
  bool negated_ = true;
};

/// The tags with the given numbers among `tags`: bit i is set if numbers[i] is.
inline std::uint32_t tag_mask(TagSet tags, const int* numbers, int count) {
  std::uint32_t mask = 0;
  for (int i = 0; i < count; ++i) mask |= static_cast<std::uint32_t>(tags >> numbers[i] & 1u) << i;
  return mask;
}

/// One `tag name = kind "glob" | ...` of a network.
struct TagRule {
  enum class Kind : std::uint8_t { material, mesh, node, extras };  // extras: `extras.tags` of any of them
  int tag;                                                          // number of the tag; the rules of one tag stand together
  const char* name;                                                 // of the tag
  Kind kind;
  const char* glob;
};

inline constexpr std::uint32_t kNoPart = 0xffffffffu;

class Scene;

/// A point of a surface where light is scattered towards `wo`, with its BSDF.
class Interaction {
 public:
  /// The surface that `ray` hit, seen from where the ray came from. `scene` must outlive it.
  Interaction(const Scene& scene, const Ray& ray, const Hit& hit);
  /// The flat surface at `hit`, seen along its normal from the front or the back, with another BSDF: a receiver. Both
  /// `scene` and `bsdf` must outlive it.
  Interaction(const Scene& scene, const Hit& hit, bool front, const Bsdf& bsdf);
  /// A receiver with a normal of its own: on the surface at `hit`, which blocks what comes from behind it, or, where nothing
  /// was hit, at `position` in space. Out there it is of no part (kNoPart) and carries no tag.
  Interaction(const Scene& scene, const Hit& hit, const Vec3& position, const Vec3& normal, const Bsdf& bsdf);
  Interaction(const Interaction&) = delete;
  Interaction& operator=(const Interaction&) = delete;

  const Bsdf& bsdf() const { return *bsdf_; }

  /// Do `w` (world space) and its local direction agree about the side of the surface? Shading normals may differ from
  /// geometric ones; light must not leak through because of it.
  bool side_agrees(const Vec3& w, float local_z) const { return (glm::dot(w, at.ng) >= 0) == ((local_z >= 0) == front); }

  SurfacePosition at;
  Frame frame;  // shading frame; its normal is on the side of wo
  Vec3 wo;      // towards where the light is wanted, world space
  Vec3 wo_local;
  Hit hit;
  std::uint32_t part;      // or kNoPart
  bool front;              // wo is on the front side
  Color transmittance{1};  // of the ray that led here, where it ran through an absorbing solid

 private:
  friend class Scene;

  const Bsdf* bsdf_;  // the part's own, or own_
  union {
    Bsdf own_;  // where the material varies; trivially destructible
  };
};

class Scene {
 public:
  /// Builds the acceleration structure and everything derived from `data`; `environment`, if any, must outlive it. Throws
  /// Error.
  Scene(SceneData data, std::span<const TagRule> tags, int threads, const Image* environment);

  const SceneData& data() const { return data_; }
  const Accel& accel() const { return accel_; }
  /// All emitters.
  const Emitters& emitters() const { return *emitters_; }
  /// The emitters that are selected by their tags. The environment has none.
  std::unique_ptr<Emitters> selected_emitters(const TagSelection& from) const;
  /// The emitters that are selected by number, with or without the environment.
  std::unique_ptr<Emitters> selected_emitters(const EmitterSelection& selection, bool with_environment) const;
  /// Bit t is set if the part matches tag t of the network.
  TagSet part_tags(std::uint32_t part) const { return part_tags_[part]; }
  /// The same of a punctual light.
  TagSet light_tags(std::uint32_t light) const { return light_tags_[light]; }
  /// The same for a punctual light.
  TagSet light_tags(std::size_t light) const { return light_tags_[light]; }
  /// Number of parts and lights that match tag `t`.
  int tag_matches(int t) const;

  /// Position, error bound and geometric normal at a hit.
  LN_INLINE void locate(const Hit& hit, SurfacePosition& at) const {
    const UVec3 i = data_.triangles[hit.triangle];
    const Vec3 a = data_.positions[i.x], b = data_.positions[i.y], c = data_.positions[i.z];
    const Vec3 pa = (1 - hit.u - hit.v) * a, pb = hit.u * b, pc = hit.v * c;
    at.p = pa + pb + pc;
    at.error = position_error(glm::abs(pa) + glm::abs(pb) + glm::abs(pc));
    at.ng = glm::normalize(glm::cross(b - a, c - a));
  }

 private:
  friend class Interaction;

  /// What is known of a part's surface before any ray meets it.
  struct Baked {
    bool plain = false;    // the triangles' own normals, one BSDF a side, nothing absorbed: no look-ups at all
    bool uniform = false;  // one BSDF a side
    Bsdf bsdf[2];          // seen from the front, from the back
  };

  void shade(Interaction& x, const Ray& ray) const;

  SceneData data_;
  Accel accel_;
  std::vector<Baked> baked_;                                   // by part
  std::vector<std::unique_ptr<DielectricTable>> dielectrics_;  // by material; null where not needed
  std::vector<TagSet> part_tags_, light_tags_;
  const Image* environment_;
  std::unique_ptr<Emitters> emitters_;
};

LN_INLINE Interaction::Interaction(const Scene& scene, const Ray& ray, const Hit& found)
    : wo(-ray.direction), hit(found), part(scene.data_.triangle_part[found.triangle]) {
  scene.locate(hit, at);
  front = glm::dot(wo, at.ng) >= 0;
  const Scene::Baked& baked = scene.baked_[part];
  bsdf_ = &baked.bsdf[front ? 0 : 1];
  if (baked.plain) {
    frame = make_frame(front ? at.ng : -at.ng);
  } else {
    scene.shade(*this, ray);
  }
  wo_local = frame.to_local(wo);
}

inline Interaction::Interaction(const Scene& scene, const Hit& on, bool seen_from_front, const Bsdf& bsdf)
    : wo_local(0, 0, 1), hit(on), part(scene.data_.triangle_part[on.triangle]), front(seen_from_front), bsdf_(&bsdf) {
  scene.locate(hit, at);
  wo = front ? at.ng : -at.ng;
  frame = make_frame(wo);
}

inline Interaction::Interaction(const Scene& scene, const Hit& on, const Vec3& position, const Vec3& normal, const Bsdf& bsdf)
    : frame(make_frame(normal)), wo(normal), wo_local(0, 0, 1), hit(on), part(kNoPart), front(true), bsdf_(&bsdf) {
  if (hit.found()) {
    scene.locate(hit, at);
    part = scene.data_.triangle_part[hit.triangle];
    front = glm::dot(normal, at.ng) >= 0;
  } else {
    at = {position, position_error(glm::abs(position)), normal};
  }
}

}  // namespace ln
