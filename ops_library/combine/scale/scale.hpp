#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Light times a constant; see scale.ln.
struct Scale {
  NodeId node;
  float factor = 1;
  TagSet to = kAnyTag;

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    return reaches(request, to) ? factor * in(request) : Color(0);
  }
};

}  // namespace ln::ops
