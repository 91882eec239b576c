#pragma once
// One thread's access to the scene: casts rays, and counts and times them for their nodes.

#include <array>
#include <memory>
#include <vector>

#include "ln/sampling.hpp"
#include "ln/scene.hpp"

namespace ln {

/// What a ray is for. camera: camera rays and their specular continuation; shadow: visibility only; gather: other rays
/// from surfaces; photon: from emitters.
enum class RayKind : std::uint8_t { camera, shadow, gather, photon };
inline constexpr int kRayKinds = 4;

/// Position of a node in the network's list of nodes: who asked for a ray. The eye is the first, with its result.
using NodeId = std::uint16_t;

/// What a node has cost a thread.
struct NodeCost {
  std::array<std::uint64_t, kRayKinds> rays{};
  std::uint64_t ticks = 0;  // of the samples that are timed, without the nodes it asked

  NodeCost& operator+=(const NodeCost& other) {
    for (int k = 0; k < kRayKinds; ++k) rays[k] += other.rays[k];
    ticks += other.ticks;
    return *this;
  }
};

/// The processor's clock; only ratios of differences mean something.
inline std::uint64_t clock_ticks() {
#if defined(__x86_64__)
  return __builtin_ia32_rdtsc();
#elif defined(__aarch64__)
  std::uint64_t t;
  asm volatile("mrs %0, cntvct_el0" : "=r"(t));
  return t;
#else
  return 0;
#endif
}

class Tracer {
 public:
  Tracer(const Scene& scene, std::size_t node_count, std::size_t layer_count)
      : scene_(&scene), costs_(node_count), layers_(layer_count, Color(0)) {}

  const Scene& scene() const { return *scene_; }

  Hit intersect(const Ray& ray, std::uint32_t key, NodeId node, RayKind kind) {
    ++costs_[node].rays[static_cast<int>(kind)];
    return scene_->accel().intersect(ray, key);
  }

  bool occluded(const Ray& ray, std::uint32_t key, NodeId node) {
    ++costs_[node].rays[static_cast<int>(RayKind::shadow)];
    return scene_->accel().occluded(ray, key);
  }

  const std::vector<NodeCost>& costs() const { return costs_; }

  /// Values of the picture's layers for the sample being computed.
  std::vector<Color>& layers() { return layers_; }

  /// Scratch for random numbers.
  SampleBlock& samples() { return *samples_; }

 private:
  friend class NodeTimer;
  friend class SampleTimer;

  const Scene* scene_;
  std::vector<NodeCost> costs_;
  std::vector<Color> layers_;
  std::unique_ptr<SampleBlock> samples_ = std::make_unique<SampleBlock>();
  bool timed_ = false;         // is the present sample timed?
  NodeId timed_node_ = 0;      // the node at work
  std::uint64_t since_ = 0;    // when it began or went on
};

/// Charges the time from here to the end of the scope to a node, in samples that are timed.
class NodeTimer {
 public:
  NodeTimer(Tracer& tracer, NodeId node) : tracer_(tracer) {
    if (tracer.timed_) [[unlikely]] {
      caller_ = tracer.timed_node_;
      switch_to(node);
    }
  }
  ~NodeTimer() {
    if (tracer_.timed_) [[unlikely]] switch_to(caller_);
  }
  NodeTimer(const NodeTimer&) = delete;
  NodeTimer& operator=(const NodeTimer&) = delete;

 private:
  void switch_to(NodeId node) {
    const std::uint64_t now = clock_ticks();
    tracer_.costs_[tracer_.timed_node_].ticks += now - tracer_.since_;
    tracer_.timed_node_ = node;
    tracer_.since_ = now;
  }

  Tracer& tracer_;
  NodeId caller_ = 0;
};

/// Times one sample out of many, chosen by a hash: enough to share out the time of the picture among the nodes.
class SampleTimer {
 public:
  static constexpr std::uint32_t kOneIn = 128;

  SampleTimer(Tracer& tracer, std::uint32_t hash) : tracer_(tracer) {
    tracer.timed_ = hash % kOneIn == 0;
    if (tracer.timed_) {
      tracer.timed_node_ = 0;
      tracer.since_ = clock_ticks();
    }
  }
  ~SampleTimer() {
    if (tracer_.timed_) tracer_.costs_[tracer_.timed_node_].ticks += clock_ticks() - tracer_.since_;
    tracer_.timed_ = false;
  }
  SampleTimer(const SampleTimer&) = delete;
  SampleTimer& operator=(const SampleTimer&) = delete;

 private:
  Tracer& tracer_;
};

}  // namespace ln
