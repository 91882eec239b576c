#pragma once

#include <atomic>

#include "ln/operator.hpp"
#include "ln/progress.hpp"

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
    if (radii > 0 && distance == 0 && diffuse.blur() == 0 && diffuse.distance() < kInfinity && !is_black(answer)) warn();
    return diffuse.distance() < radii * diffuse.blur() ? near(diffuse) : answer;
  }

  /// Once in a run.
  LN_NOINLINE static void warn() {
    static std::atomic<bool> is_said = false;
    if (is_said.load(std::memory_order_relaxed) || is_said.exchange(true)) return;
    warning(
        "ByDistance: 'far' is no mean over a radius (NNDensity and LepskiDensity are), so no ray is short and 'near' is not "
        "used: give it a 'distance'");
  }
};

}  // namespace ln::ops
