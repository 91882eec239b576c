#pragma once

#include "ln/operator.hpp"
#include "ln/secondary.hpp"

namespace ln::ops {

/// Light that arrives straight from diffuse surfaces; see gather.ln.
template <class Via>
struct Gather {
  NodeId node;
  std::int64_t samples = 1;
  TagSelection from;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    return light_from_surfaces<Via>(request, node, samples, from, in);
  }
};

}  // namespace ln::ops
