#pragma once
// Form factors without occlusion: which share of the irradiance's hemisphere a flat cell fills.

#include "ln/patches.hpp"

namespace ln {

/// A flat receiver or source of light with its normal on the side that counts.
struct FlatCell {
  SurfaceCell cell;
  Vec3 normal{0, 0, 1};  // unit length
  float area = 0;
  float radius = 0;  // of the ball around the center that holds the cell
};
FlatCell make_flat_cell(const SurfaceCell& cell, bool front);
/// A quarter of it, see BasicCell::child.
inline FlatCell child(const FlatCell& flat, int i) {
  return {flat.cell.child(i), flat.normal, 0.25f * flat.area, 0.5f * flat.radius};
}

/// Form factor from the point `p` with the unit normal `n` to a source that is seen from its side of the normal: irradiance at
/// `p` over the source's radiosity. Exact, also where the source touches the point or reaches below the horizon. Source:
/// Lambert 1760; Baum, Rushmeier and Winget 1989.
float point_form_factor(const Vec3& p, const Vec3& n, const FlatCell& source);

/// The form factor averaged over a receiver.
struct FormFactor {
  float mean = 0;
  float spread = 0;  // about how much it differs from its mean on the receiver
};

/// By the exact formula at several points where receiver and source are near, else at one point, or by a single kernel
/// evaluation.
FormFactor form_factor(const FlatCell& receiver, const FlatCell& source);

}  // namespace ln
