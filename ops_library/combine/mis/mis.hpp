#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Two estimates of the same light; see mis.ln.
struct mis {
  NodeId node;
  float weight = 0.5f;

  template <class Request, class A, class B>
  LN_INLINE Color answer(Request& request, const A& a, const B& b) const {
    Color sum(0);
    if (weight > 0) sum += weight * a(request);
    if (weight < 1) sum += (1 - weight) * b(request);
    return sum;
  }
};

}  // namespace ln::ops
