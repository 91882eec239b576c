#pragma once
// What radiosity sees of a surface: how much of the irradiance its diffuse lobe returns.

#include "ln/scene.hpp"
#include "ln/tracer.hpp"

namespace ln {

/// Is it the side of the part's surfaces that light is meant for, not what is behind a single-sided one, as the inside of a
/// solid?
bool meant_to_be_seen(const Scene& scene, std::uint32_t part, bool front);

/// Can this side of a part scatter diffusely anywhere?
bool scatters_diffusely(const Scene& scene, std::uint32_t part, bool front);

/// Does what `diffuse_albedo` says vary over the part?
bool albedo_varies(const Scene& scene, std::uint32_t part);

/// Radiant exitance over irradiance of the diffuse lobe at a point, averaged over directions of view, times the coverage there.
Color diffuse_albedo(const Scene& scene, const Hit& hit, bool front);

/// Of surfaces that coincide rays meet only one: does one from close above meet the triangle of `at` there? A surface that is
/// not meant to be seen from that side does not count, such as the bottom of a thing that stands on this one.
bool outermost(Tracer& tracer, NodeId node, const Hit& at, bool front, std::uint32_t key);

}  // namespace ln
