#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Light times a constant; see scale.ln.
struct Scale {
  NodeId node;
  float factor = 1;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    return factor * in(request);
  }
};

}  // namespace ln::ops
