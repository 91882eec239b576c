#pragma once
// Irradiance on one surface from the photons that hit it, by local linear density estimation.

#include "ln/photon_map.hpp"
#include "ln/sorted_photons.hpp"
#include "ln/surface_area.hpp"

namespace ln {

/// Radii of the kernels at a point, for the two halves of the photons.
struct KernelRadii {
  float half[2] = {0, 0};

  float mean() const { return 0.5f * (half[0] + half[1]); }
};

class SurfaceDensity {
 public:
  /// `neighbours`: photons under a kernel, in the mean. `max_radius`: no kernel is wider [normalised units]; 0: chosen from the
  /// photons. `area` and `sorted` must outlive the object.
  SurfaceDensity(PrepareContext& context, const SurfaceArea& area, const SortedPhotons& sorted, std::uint32_t surface,
                 int neighbours, float max_radius);

  /// Radii as the photons call for; infinite, if there are too few of them: then the irradiance is taken to be the same
  /// everywhere.
  KernelRadii radii(const Neighbourhood& around) const;

  /// Irradiance [W/m^2].
  Color irradiance(const Neighbourhood& around, const KernelRadii& radii) const;

 private:
  static constexpr std::size_t kMaxNeighbours = 4096;

  bool even() const { return half_[0].empty(); }
  float distance_in(int half, const Neighbourhood& around) const;
  Color sum(int half, const Neighbourhood& around, float radius) const;
  float automatic_radius() const;

  const SurfaceArea* area_;
  TriangleFilter sheet_;
  std::size_t neighbours_ = 0;  // in each half
  PhotonMap half_[2];           // photons that were traced first, and the rest
  float max_radius_ = 0;
  Color even_irradiance_{0};
};

}  // namespace ln
