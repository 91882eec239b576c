#pragma once
// Irradiance on one surface from the photons that hit it, by local linear density estimation.

#include "ln/photon_bandwidth.hpp"
#include "ln/sorted_photons.hpp"

namespace ln {

/// Radii of the kernels at a point, for the two halves of the photons, and what the search for them found.
struct KernelRadii {
  float half[2] = {0, 0};
  float E = 0, sigma = kInfinity;  // irradiance, mean of the channels, and its standard error [W/m^2]; infinite: unknown

  float mean() const { return 0.5f * (half[0] + half[1]); }
};

/// What the photons under a point's kernels say.
struct SurfaceIrradiance {
  Color E{0};        // [W/m^2]
  float sigma = 0;   // standard error of the mean of the channels
  Vec3 gradient{0};  // of that mean along the surface [W/m^2 per normalised unit]
};

/// What is asked of the kernels on each surface.
struct SurfaceKernels {
  int least = 25, most = 6400;  // photons under the narrowest and the widest
  float max_radius = 0;         // none is wider [normalised units]; 0: chosen from the photons
};

class SurfaceDensity {
 public:
  /// `area`, labelled by sheet, must outlive the object.
  SurfaceDensity(PrepareContext& context, const SurfaceArea& area, const SortedPhotons& sorted, std::uint32_t surface,
                 const SurfaceKernels& kernels);

  /// Radii as the photons call for; infinite, if there are too few of them: then the irradiance is taken to be the same
  /// everywhere.
  KernelRadii radii(const Neighbourhood& around) const;

  /// Are there too few photons for kernels?
  bool even() const { return half_[0].empty(); }

  SurfaceIrradiance irradiance(const Neighbourhood& around, const KernelRadii& radii) const;

 private:
  const SurfaceArea* area_;
  std::uint32_t sheet_;
  KernelRange kernels_;  // in each half
  PhotonMap half_[2];    // photons that were traced first, and the rest
  Color even_irradiance_{0};
};

}  // namespace ln
