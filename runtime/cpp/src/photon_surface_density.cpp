#include <algorithm>

#include "ln/surface_density.hpp"

namespace ln {

namespace {

/// As in KernelRange, but lower: who asks takes medians of neighbouring radii, so that single wrong ones do no harm.
constexpr float kSame = 0.75f, kDifferent = 2;

}  // namespace

SurfaceDensity::SurfaceDensity(PrepareContext& context, const SurfaceArea& area, const SortedPhotons& sorted,
                               std::uint32_t surface, const SurfaceKernels& kernels)
    : area_(&area), sheet_(surface / 2) {
  const std::span<const Photon> photons = sorted.on(surface);
  if (photons.size() < 2 * static_cast<std::size_t>(kernels.least)) {
    DVec3 flux(0);
    for (const Photon& photon : photons) flux += DVec3(photon.flux.unpack());
    const double whole = sorted.sheet_area[surface / 2];
    if (whole > 0) even_irradiance_ = Color(flux / whole);
    return;
  }
  const std::size_t middle = photons.size() / 2;
  half_[0] = PhotonMap(context, photons.first(middle));
  half_[1] = PhotonMap(context, photons.subspan(middle));
  kernels_ = kernel_range(context, half_[0], std::max(kernels.least / 2, 1), std::max(kernels.most / 2, 1), kernels.max_radius);
  kernels_.same = kSame;
  kernels_.different = kDifferent;
}

// Each half's kernel is as wide as the other half says, so that photons do not choose their own weight.
KernelRadii SurfaceDensity::radii(const Neighbourhood& around) const {
  if (even()) return {{kInfinity, kInfinity}};
  const auto chosen = [&](int half) { return adaptive_local_linear(half_[half], *area_, around, kernels_, sheet_); };
  const LocalEstimate by[2] = {chosen(0), chosen(1)};
  return {{by[1].radius, by[0].radius}, mean_component(by[0].E + by[1].E), std::hypot(by[0].sigma, by[1].sigma)};
}

SurfaceIrradiance SurfaceDensity::irradiance(const Neighbourhood& around, const KernelRadii& radii) const {
  if (even()) return {even_irradiance_};
  SurfaceIrradiance result;
  for (int half = 0; half < 2; ++half) {
    std::vector<NearPhoton> photons;
    half_[half].within(around, sqr(radii.half[half]), [&](const NearPhoton& photon) { photons.push_back(photon); });
    const LinearEstimate e = local_linear(half_[half], photons, *area_, around, radii.half[half], sheet_);
    result.E += e.E;
    result.gradient += e.gradient;
    result.sigma = std::hypot(result.sigma, e.sigma);
  }
  return result;
}

}  // namespace ln
