#pragma once
// Where vertices of a mesh lie much closer together than kernels are wide, some of them speak for the others.

#include <span>
#include <vector>

#include "ln/prepare.hpp"
#include "ln/surface_density.hpp"

namespace ln {

/// A vertex of a mesh.
struct MeshVertex {
  Neighbourhood around;
  std::uint32_t surface;
  KernelRadii radii{};
};

/// The median of each of the radii.
KernelRadii median_radii(std::span<const MeshVertex> vertices, std::span<const std::uint32_t> of);

/// The irradiance at vertex `v`, averaged with what those neighbours say of it that are known much better and agree with it
/// within noise, by inverse variances: a kernel that is narrow by chance makes no speck.
Color steadied(std::uint32_t v, std::span<const MeshVertex> vertices, std::span<const SurfaceIrradiance> irradiances,
               std::span<const std::uint32_t> neighbours);

/// Of the first vertices of a mesh: those that are estimated, and which of them reach the others.
class MeshSites {
 public:
  /// May a site speak for a vertex, as far as what stands on the surface is concerned?
  using Sees = FunctionRef<bool(const MeshVertex& site, const MeshVertex& vertex, Tracer&)>;

  MeshSites() = default;
  /// Chooses sites among `vertices` and gives them their radii; the others get the medians of those that reach them. A site
  /// reaches as far over the mesh as `spacing` radii of its kernel, where normals agree, and speaks for what is within half of
  /// that. `edges`: of the mesh; `surfaces`: densities, by surface.
  MeshSites(PrepareContext& context, std::span<MeshVertex> vertices,
            std::span<const std::pair<std::uint32_t, std::uint32_t>> edges, float spacing,
            FunctionRef<KernelRadii(const MeshVertex&)> radii, Sees sees);

  /// Is the irradiance at vertex `v` to be estimated? Vertices that were added later are not known here: it is.
  bool is_site(std::uint32_t v) const { return v + 1 >= first_.size() || is_site_[v]; }
  /// `v` is to be estimated, too: it is no longer where it was.
  void set_site(std::uint32_t v) {
    if (v < is_site_.size()) is_site_[v] = true;
  }
  /// Other sites that reach `v`.
  std::span<const std::uint32_t> reaching(std::uint32_t v) const {
    if (v + 1 >= first_.size()) return {};
    return {site_.data() + first_[v], first_[v + 1] - first_[v]};
  }

  /// The irradiance at `v`, which is no site, from the sites that reach it: exact if it is linear over them.
  Color fill(std::uint32_t v, std::span<const MeshVertex> vertices, std::span<const Color> irradiances) const;

 private:
  /// Of the sites that reach `v`, with which what is linear comes out as it is; none, if there are no such.
  std::vector<float> weights(std::uint32_t v, std::span<const MeshVertex> vertices) const;

  float spacing_ = 0;
  std::vector<bool> is_site_;
  std::vector<std::size_t> first_;  // by vertex: of the sites that reach it, in `site_`; one more at the end
  std::vector<std::uint32_t> site_;
};

}  // namespace ln
