#pragma once

#include "ln/operator.hpp"
#include "ln/secondary.hpp"

namespace ln::ops {

/// Light that was scattered once more, found along samples of the BSDF; see path_tracer.ln.
template <class Via>
struct PathTracer {
  NodeId node;
  std::int64_t samples = 1;
  std::int64_t max_depth = 0;
  TagSelection from;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    if (request.steps() > static_cast<std::uint64_t>(max_depth - 1)) return Color(0);  // 0 wraps around: no bound
    return light_from_surfaces<Via>(request, node, request.steps() == 0 ? samples : 1, from, in);
  }
};

}  // namespace ln::ops
