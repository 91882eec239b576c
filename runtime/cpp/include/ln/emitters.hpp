#pragma once
// Interface of the emitters of a scene: implemented by a light BVH. See below for what each member promises.

#include <string>
#include <vector>

#include "ln/scene_data.hpp"
#include "ln/surface_point.hpp"

namespace ln {

/// Light that may arrive at a point from one emitter.
struct LightSample {
  Vec3 wi{0, 0, 1};           // towards the emitter
  Color radiance{0};          // area: radiance emitted towards the point; delta: irradiance on a surface facing it [per pdf_w = 1]
  float pdf_w = 0;            // selection probability times solid-angle density; delta emitters: selection probability
  bool delta = false;         // point, spot, directional: no BSDF sample can find it
  float distance = kInfinity; // infinite: environment, directional
  SurfacePosition position;   // on the emitter, if the distance is finite (ng = 0 for point lights)
};

}  // namespace ln
