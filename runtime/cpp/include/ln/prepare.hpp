#pragma once
// What an operator may use while it prepares.

#include <functional>

#include "ln/tracer.hpp"

namespace ln {

/// Access to the scene and to all cores, before the picture.
class PrepareContext {
 public:
  PrepareContext(const Scene& scene, std::uint64_t seed, int threads, std::size_t node_count)
      : scene_(&scene), seed_(seed), threads_(threads), counts_(node_count) {}

  const Scene& scene() const { return *scene_; }
  std::uint64_t seed() const { return seed_; }
  int threads() const { return threads_; }

  /// Runs `work(tracer, i)` for i in [0, count), each i once, on all cores. Results must not depend on which thread runs
  /// what. Stops early, by throwing Interrupted, when the user interrupts.
  void parallel_for(std::size_t count, const std::function<void(Tracer&, std::size_t)>& work);

  const std::vector<RayCounts>& counts() const { return counts_; }

 private:
  const Scene* scene_;
  std::uint64_t seed_;
  int threads_;
  std::vector<RayCounts> counts_;  // rays cast while preparing, by node
};

}  // namespace ln
