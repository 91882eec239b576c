#pragma once

#include "ln/hemisphere_request.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// Irradiance and its gradients from a stratified hemisphere; see ig_sampler.ln.
struct IGSampler {
  NodeId node;
  std::int64_t samples = 512;

  IrradianceSample answer(HemisphereRequest& request, const auto& in) const {
    static const Bsdf kWhite = Bsdf::lambertian(Color(1));
    const Receiver& where = request.where();
    Tracer& tracer = request.tracer();
    Interaction at(tracer.scene(), where.hit, where.front, kWhite);
    at.frame = make_frame(where.n);
    at.wo = where.n;

    const HemisphereGrid grid = HemisphereGrid::of(static_cast<float>(samples) * request.share());
    std::vector<HemisphereCell> cells;
    cells.reserve(static_cast<std::size_t>(grid.cells()));
    for (int ring = 0; ring < grid.polar; ++ring) {
      for (int sector = 0; sector < grid.azimuth; ++sector) {
        const SampleStream random(request.key(), static_cast<std::uint32_t>(cells.size()));
        Request<Events::D> seen(tracer, random, at, Color(1), request.depth(), RayKind::gather);
        seen.give_sample(grid.direction(ring, sector, random.get2(request.depth(), kBsdfDirection)));
        // What a white surface makes of one direction, drawn with the density of its BSDF, is the radiance from there.
        const Color radiance = in(seen);
        const BsdfRay* ray = seen.bsdf_ray(node);
        cells.push_back({radiance});
        if (!ray || !ray->hit.found()) continue;
        SurfacePosition there;
        tracer.scene().locate(ray->hit, there);
        cells.back().distance = ray->hit.t;
        cells.back().plane = there.ng / (ray->hit.t * glm::dot(ray->ray.direction, there.ng));
      }
    }
    return integrate(grid, cells, at.frame, request.step());
  }
};

}  // namespace ln::ops
