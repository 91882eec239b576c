#pragma once
// Irradiance from the density of photons (Jensen 1996, "Global Illumination using Photon Maps"), without bias at borders.

#include "ln/photon_map.hpp"
#include "ln/surface_area.hpp"

namespace ln {

class PhotonDensity {
 public:
  PhotonDensity() = default;
  /// `neighbours`: number of photons that an estimate is made of. `radius`: none is taken from farther away [normalised units];
  /// 0: chosen from the photons. `every`: estimates are made at every so many photons, to be taken for what is near; 0 or 1: at
  /// none. `map` must outlive the object.
  PhotonDensity(PrepareContext& context, const PhotonMap& map, int neighbours, float radius, PhotonKernel kernel,
                int every = 0);

  struct Estimate {
    Color E{0};        // irradiance [W/m^2]
    float radius = 0;  // of the kernel [normalised units]
  };
  /// At a point, or at a photon nearby that has one.
  Estimate estimate(const Neighbourhood& around) const;

  float max_radius() const { return max_radius_; }

  static constexpr int kMaxNeighbours = 4096;

 private:
  Estimate estimate_from(const PhotonMap& map, const Neighbourhood& around) const;
  void store(PrepareContext& context, std::size_t every);

  const PhotonMap* map_ = nullptr;
  SurfaceArea surfaces_;
  std::size_t neighbours_ = 60;
  float max_radius_ = 0;
  PhotonKernel kernel_ = PhotonKernel::cone;
  PhotonMap stored_places_;
  std::vector<Estimate> stored_;  // by slot of stored_places_
};

}  // namespace ln
