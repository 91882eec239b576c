#pragma once

#include "ln/operator.hpp"
#include "ln/photon_density.hpp"

namespace ln::ops {

/// Irradiance from the density of the nearest photons; see nn_density.ln.
struct NNDensity {
  NodeId node;
  std::int64_t neighbours = 60;
  float radius = 0;         // [m]; 0: automatic
  std::int32_t kernel = 1;  // choice(constant, cone)
  std::int64_t every = 0;

  void prepare(PrepareContext& context, const PhotonMap& map) {
    const auto unit = static_cast<float>(context.scene().data().unit);
    density_ = PhotonDensity(context, map, static_cast<int>(neighbours), radius / unit, static_cast<PhotonKernel>(kernel),
                             static_cast<int>(every));
  }

  template <class Request>
  Color answer(Request& request, const PhotonMap& map) const {
    if (map.empty()) return Color(0);
    return request.scatter_irradiance([&](const Interaction& at) {
      const auto [E, radius] = density_.estimate(neighbourhood(at));
      request.blurred_over(radius);
      return E;
    });
  }

  // State.
  PhotonDensity density_{};
};

}  // namespace ln::ops
