#pragma once
// Local linear density estimation from photons, and how wide its kernel may be: wide where the irradiance is linear, narrow
// where it is not.

#include <span>

#include "ln/photon_map.hpp"
#include "ln/surface_area.hpp"

namespace ln {

/// An estimate of irradiance [W/m^2].
struct LocalEstimate {
  Color E{0};
  float sigma = 0;   // standard error of the mean of E's channels, by the scatter of the photons' own weights
  float radius = 0;  // of the kernel
  float area = 0;    // its integral over the surface
};

/// An estimate that says how the irradiance goes on beside it.
struct LinearEstimate : LocalEstimate {
  Vec3 gradient{0};  // of the mean of E's channels along the surface [W/m^2 per normalised unit]
};

/// Weights c0 + c1 x + c2 y of places, besides the kernel's, with which what is linear comes out as it is: the solution of
/// M c = (1, 0, 0) for the matrix M of moments.
Vec3 linear_weights(const SurfaceMoments& m);

/// The parabola over the photons within `radius`, weighted so that an irradiance that is linear over the surface comes out as
/// it is (Walter et al. 1997; Ruppert and Wand 1994, eq. 2.2). `label`: of the triangles that the photons lie on.
LinearEstimate local_linear(const PhotonMap& map, std::span<const NearPhoton> photons, const SurfaceArea& area,
                            const Neighbourhood& around, float radius, std::uint32_t label = SurfaceArea::kEverything);

/// How wide kernels may be.
struct KernelRange {
  static constexpr int kMost = 4096;

  int least = 20, most = 800;  // photons under the narrowest and the widest kernel
  float narrow_radius = 0;     // the narrowest kernel is no wider [normalised units]
  float max_radius = 0;        // nor any other than this

  /// Up to this difference estimates are taken to be of the same light, and of different light from the other one on [standard
  /// errors of their difference]. In between, their means are taken: a choice would make specks.
  float same = 2, different = 3.5f;
};

/// `radius`: no kernel is wider [normalised units]; 0: chosen from the photons.
KernelRange kernel_range(PrepareContext& context, const PhotonMap& map, int least, int most, float radius);

/// The estimate of the widest kernel that agrees with all narrower ones (Lepski 1990), or a mean of two, in case of doubt. Each
/// kernel has twice as many photons as the one before; its farthest photon sets the radius and is not counted. The
/// narrowest is no wider than `narrow_radius`, and has as many photons as lie therein.
LocalEstimate adaptive_local_linear(const PhotonMap& map, const SurfaceArea& area, const Neighbourhood& around,
                                    const KernelRange& range, std::uint32_t label = SurfaceArea::kEverything);

/// Twice the distance within which nine tenths of the photons find `neighbours` of their neighbourhood.
float automatic_radius(PrepareContext& context, const PhotonMap& map, int neighbours);

}  // namespace ln
