#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// A coarse estimate for rays from afar, another of the same light for rays from near by; see by_distance.ln.
struct ByDistance {
  NodeId node;
  float radii = 1;
  float distance = 0;  // [m]

  template <class Request, class Far, class Near>
  LN_INLINE Color answer(Request& request, const Far& far, const Near& near) const {
    auto diffuse = request.diffuse();
    const auto unit = static_cast<float>(request.tracer().scene().data().unit);
    if (diffuse.distance() * unit < distance) return near(diffuse);
    const Color answer = far(diffuse);
    return diffuse.distance() < radii * diffuse.blur() ? near(diffuse) : answer;
  }
};

}  // namespace ln::ops
