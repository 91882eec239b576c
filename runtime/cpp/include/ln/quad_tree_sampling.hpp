#pragma once
// A QuadTree from irradiance that can be sampled at points.

#include "ln/prepare.hpp"
#include "ln/quad_tree.hpp"

namespace ln {

struct QuadTreeSampling {
  int samples = 16;  // of a cell
  float cell = 0;    // side of the cells that are sampled first [normalised units]; 0: 1/48 of the scene's half diagonal
  int depth = 9;     // cells are cut at most this often
  float error = 0.01f;
  TagSelection to;  // parts that are sampled
};

/// One sample of the irradiance [W/m^2] on one side of the surface at a hit; dimensions of the stream from vertex 1 on are
/// free.
using IrradianceSampler = FunctionRef<Color(Tracer&, const SampleStream&, const Hit&, bool front)>;

/// Samples all faces of these parts that can scatter diffusely in cells of equal size, samples anew with a quarter of the size
/// where the irradiance varies within a cell by more than `error` times the RMS irradiance of all lit cells and more than noise
/// explains, and compresses the result, a batch of faces at a time. `key`: to be different for each node of a network.
QuadTree sample_quad_tree(PrepareContext& context, std::uint32_t key, const QuadTreeSampling& options,
                          IrradianceSampler sample);

}  // namespace ln
