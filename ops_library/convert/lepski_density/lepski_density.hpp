#pragma once

#include "ln/operator.hpp"
#include "ln/photon_bandwidth.hpp"

namespace ln::ops {

/// Irradiance from the density of photons, with kernels as wide as the light allows; see lepski_density.ln.
struct LepskiDensity {
  NodeId node;
  std::int64_t neighbours = 800;
  std::int64_t fewest = 20;
  float radius = 0;  // [m]; 0: automatic

  void prepare(PrepareContext& context, const PhotonMap& map) {
    if (map.empty()) return;
    const auto unit = static_cast<float>(context.scene().data().unit);
    area_ = SurfaceArea(context, context.scene().data());
    kernels_ = kernel_range(context, map, static_cast<int>(fewest), static_cast<int>(neighbours), radius / unit);
  }

  template <class Request>
  Color answer(Request& request, const PhotonMap& map) const {
    if (map.empty()) return Color(0);
    return request.scatter_irradiance([&](const Interaction& at) {
      const LocalEstimate estimate = adaptive_local_linear(map, area_, neighbourhood(at), kernels_);
      request.blurred_over(estimate.radius);
      return estimate.E;
    });
  }

  // State.
  SurfaceArea area_{};
  KernelRange kernels_{};
};

}  // namespace ln::ops
