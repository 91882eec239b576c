#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// Passes light on unchanged and shows what the eye sees of it as a layer of the picture; see wire_tap.ln.
struct WireTap {
  NodeId node;
  int layer = 0;  // position in the picture's list of layers

  template <class Request, class In>
  LN_INLINE Color answer(Request& request, const In& in) const {
    const Color value = in(request);
    if (request.seen()) request.tracer().layers()[layer] += request.beta() * value;
    return value;
  }
};

}  // namespace ln::ops
