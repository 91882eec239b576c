#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Light of all terms together; see sum.ln.
struct Sum {
  NodeId node;

  template <class Request, class... Terms>
  LN_INLINE Color answer(Request& request, const Terms&... terms) const {
    Color sum(0);
    ((sum += terms(request)), ...);  // in the order of the text: same input, same bits
    return sum;
  }
};

}  // namespace ln::ops
