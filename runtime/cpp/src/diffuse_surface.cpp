#include "ln/diffuse_surface.hpp"

#include <algorithm>

#include "ln/material.hpp"

namespace ln {

namespace {

/// Calls `use(bsdf)` for one side of the surface at a hit, as it is seen along the normal.
template <class Use>
auto with_bsdf(const Scene& scene, const Hit& hit, bool front, Use&& use) {
  SurfacePosition at;
  scene.locate(hit, at);
  const Vec3 outwards = front ? at.ng : -at.ng;
  const Interaction interaction(scene, Ray{at.p + outwards, -outwards, kInfinity}, hit);
  return use(interaction.bsdf());
}

/// At least so far is a point of a triangle from the triangle's edges.
float distance_to_edge(const SceneData& data, const Hit& at) {
  const UVec3 i = data.triangles[at.triangle];
  const Vec3 &a = data.positions[i.x], &b = data.positions[i.y], &c = data.positions[i.z];
  const float longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
  return std::min({at.u, at.v, 1 - at.u - at.v}) * glm::length(glm::cross(b - a, c - a)) / longest;
}

Hit middle_of(std::uint32_t triangle) { return {0, triangle, 1.0f / 3, 1.0f / 3}; }

}  // namespace

bool meant_to_be_seen(const Scene& scene, std::uint32_t part, bool front) {
  const SceneData& data = scene.data();
  return front || data.materials[data.parts[part].material].double_sided;
}

bool scatters_diffusely(const Scene& scene, std::uint32_t part, bool front) {
  const SceneData& data = scene.data();
  const Part& p = data.parts[part];
  if (p.triangle_count == 0 || data.materials[p.material].unlit) return false;
  if (albedo_varies(scene, part)) return true;
  return with_bsdf(scene, middle_of(p.first_triangle), front, [](const Bsdf& bsdf) { return any(bsdf.events() & Events::D); });
}

bool albedo_varies(const Scene& scene, std::uint32_t part) {
  const SceneData& data = scene.data();
  const Part& p = data.parts[part];
  return data.materials[p.material].has_texture() || p.has_colors;
}

Color diffuse_albedo(const Scene& scene, const Hit& hit, bool front) {
  const Color albedo = with_bsdf(scene, hit, front, [](const Bsdf& bsdf) {
    if (!any(bsdf.events() & Events::D)) return Color(0);
    if (bsdf.single_lobe()) return bsdf.diffuse_reflectance(Vec3(0, 0, 1));
    // Integral of R(mu) 2 mu dmu = integral of R(sqrt(x)) dx, by Gauss and Legendre.
    constexpr float kNode[4] = {0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f};
    constexpr float kWeight[4] = {0.1739274226f, 0.3260725774f, 0.3260725774f, 0.1739274226f};
    Color sum(0);
    for (int i = 0; i < 4; ++i)
      sum += kWeight[i] * bsdf.diffuse_reflectance(Vec3(std::sqrt(1 - kNode[i]), 0, std::sqrt(kNode[i])));
    return sum;
  });
  const SceneData& data = scene.data();
  return hit.triangle < data.alpha_begin ? albedo : albedo * coverage(data, hit.triangle, hit.u, hit.v);
}

bool outermost(Tracer& tracer, NodeId node, const Hit& at, bool front, std::uint32_t key) {
  const Scene& scene = tracer.scene();
  const std::vector<std::uint32_t>& part = scene.data().triangle_part;
  SurfacePosition here;
  scene.locate(at, here);
  // By a ray at random, for rounding decides: exactly from above it may favour either surface at its own points.
  constexpr float kDistance = 0x1p-14f;  // more than positions err by
  const Vec3 up = front ? here.ng : -here.ng;
  const Vec3 way = make_frame(up).to_world(sample_cosine(Vec2(to_unit_float(hash32(key, 0)), to_unit_float(hash32(key, 1)))));
  const float distance = kDistance * (1 + to_unit_float(hash32(key, 2))), slope = glm::dot(way, up);
  const Hit hit = tracer.intersect({here.p + distance * way, -way, 2 * distance}, key, node, RayKind::gather);
  if (!hit.found() || hit.triangle == at.triangle) return true;
  // What meets the triangle at its edge only runs by.
  const float close = 2 * here.error;
  if (std::abs(distance - hit.t) * slope > close || distance_to_edge(scene.data(), at) * slope < close) return true;
  scene.locate(hit, here);
  return meant_to_be_seen(scene, part[at.triangle], front) &&
         !meant_to_be_seen(scene, part[hit.triangle], glm::dot(here.ng, up) > 0);
}

}  // namespace ln
