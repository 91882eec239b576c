#pragma once
// What an operator may use while it prepares.

#include <cstdint>
#include <functional>
#include <vector>

#include "ln/camera.hpp"
#include "ln/parallel.hpp"
#include "ln/tracer.hpp"

namespace ln {

/// A side of a surface at a point where a probe or a lightmap measures.
struct MeasuredPlace {
  Hit hit;
  bool front = true;
};

/// What results look at: camera rays through a picture of this size, and places on surfaces.
struct View {
  CameraRays rays;
  int width = 0, height = 0;  // 0: nothing is seen through the camera
  std::function<std::vector<MeasuredPlace>()> measured = [] { return std::vector<MeasuredPlace>(); };
};

/// Access to the scene and to all cores, before the picture.
class PrepareContext {
 public:
  PrepareContext(const Scene& scene, Workers& workers, std::uint64_t seed, std::size_t node_count, const View& view = {})
      : scene_(&scene), workers_(&workers), seed_(seed), view_(view) {
    for (int i = 0; i < workers.count(); ++i) tracers_.emplace_back(scene, node_count, 0);
  }

  const Scene& scene() const { return *scene_; }
  std::uint64_t seed() const { return seed_; }
  const View& view() const { return view_; }
  Workers& workers() { return *workers_; }

  /// Calls `work(begin, end, tracer)` for each run of `grain` numbers of [0, n), on all cores. Results must not depend on
  /// which thread does what. Throws Interrupted if the user asked to stop.
  template <class Work>
  void for_chunks(std::size_t n, std::size_t grain, Work&& work) {
    workers_->for_chunks(n, grain, [&](std::size_t begin, std::size_t end, int worker) { work(begin, end, tracers_[worker]); });
  }

  /// Calls `work(tracer, i)` for each i of [0, n).
  template <class Work>
  void parallel_for(std::size_t n, Work&& work) {
    for_chunks(n, 1, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i) work(tracer, i);
    });
  }

  /// Rays cast so far by `node` for `kind`.
  std::uint64_t rays(NodeId node, RayKind kind) const {
    std::uint64_t sum = 0;
    for (const Tracer& tracer : tracers_) sum += tracer.costs()[node].rays[static_cast<int>(kind)];
    return sum;
  }

  const std::vector<Tracer>& tracers() const { return tracers_; }

 private:
  const Scene* scene_;
  Workers* workers_;
  std::uint64_t seed_;
  View view_;
  std::vector<Tracer> tracers_;  // one a worker
};

}  // namespace ln
