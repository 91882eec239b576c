#pragma once
// Hierarchical radiosity: diffuse interreflection between surfaces, from irradiance to irradiance.

#include "ln/prepare.hpp"
#include "ln/quad_tree.hpp"

namespace ln {

struct RadiosityOptions {
  float error = 0.03f;     // of a link, as a share of the mean radiosity
  float smallest = 0;      // cells of half this side are not made [normalised units]; 0: 1/128 of the scene's half diagonal
  float residual = 1e-3f;  // bound of what further iterations would add, as a share of the result
  std::int64_t iterations = 200;
  TagSelection from;  // parts that scatter
  TagSelection to;    // parts that receive
};

/// What it cost, and how far it got.
struct RadiosityReport {
  std::size_t elements = 0, links = 0, iterations = 0;
  double residual = 0;
  double correction = 0;  // how much the last gather at points has changed the light, as a share
};

/// Solves E = K rho (E_in + E), with K the transport of radiosity to irradiance and rho the diffuse albedo: the multiply
/// scattered light alone. The cells of `in` are those of the source's first scattering. Same seed, same bits for any number of
/// threads.
QuadTree solve_radiosity(PrepareContext& context, NodeId node, const QuadTree& in, const RadiosityOptions& options,
                         RadiosityReport* report = nullptr);

}  // namespace ln
