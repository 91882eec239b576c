#pragma once

#include "ln/operator.hpp"
#include "ln/quad_tree_sampling.hpp"
#include "ln/receiver.hpp"

namespace ln::ops {

/// Samples irradiance on surfaces; see points_to_quad_tree.ln.
struct PointsToQuadTree {
  NodeId node;
  std::int64_t samples = 16;
  float cell = 0;  // [m]; 0: automatic
  std::int64_t depth = 9;
  float error = 0.01f;
  TagSelection to;

  template <class In>
  void prepare(PrepareContext& context, const In& in) {
    const auto unit = static_cast<float>(context.scene().data().unit);
    const QuadTreeSampling options{static_cast<int>(samples), cell / unit, static_cast<int>(depth), error, to};
    tree_ =
        sample_quad_tree(context, node, options, [&](Tracer& tracer, const SampleStream& random, const Hit& hit, bool front) {
          tracer.enter(node);
          return sample_irradiance(tracer, random, hit, front, in);
        });
  }

  /// The QuadTree wire.
  const QuadTree& quad_tree() const { return tree_; }

  // State.
  QuadTree tree_{};
};

}  // namespace ln::ops
