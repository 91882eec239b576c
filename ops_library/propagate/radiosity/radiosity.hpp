#pragma once

#include <cstdio>

#include "ln/operator.hpp"
#include "ln/progress.hpp"
#include "ln/radiosity.hpp"

namespace ln::ops {

/// Hierarchical radiosity; see radiosity.ln.
struct Radiosity {
  NodeId node;
  float error = 0.03f;
  float smallest = 0;  // [m]; 0: automatic
  float residual = 1e-3f;
  std::int64_t iterations = 200;
  TagSelection from, to;

  void prepare(PrepareContext& context, const QuadTree& in) {
    const auto unit = static_cast<float>(context.scene().data().unit);
    RadiosityReport report;
    tree_ = solve_radiosity(context, node, in, {error, smallest / unit, residual, iterations, from, to}, &report);
    if (report.elements == 0) return;
    char text[160];
    std::snprintf(text, sizeof text,
                  "radiosity: %zu cells, %zu links, %zu iterations; about %.2g %% of the light is still to come",
                  report.elements, report.links, report.iterations, 100 * report.residual);
    note(text);
  }

  /// The QuadTree wire.
  const QuadTree& quad_tree() const { return tree_; }

  // State.
  QuadTree tree_{};
};

}  // namespace ln::ops
