#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// One wire less another; see difference.ln. `b` comes with its sign turned.
struct Difference {
  NodeId node;

  template <class Request, class A, class B>
  LN_INLINE Color answer(Request& request, const A& a, const B& b) const {
    return a(request) + b(request);
  }
};

}  // namespace ln::ops
