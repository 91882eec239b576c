#pragma once
// One thread's access to the scene: casts rays and counts them for their nodes.

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

  NodeCost& operator+=(const NodeCost& other) {
    for (int k = 0; k < kRayKinds; ++k) rays[k] += other.rays[k];
    return *this;
  }
};

/// Calls in progress of a node that may call itself; what they are for is up to the node.
struct Recursion {
  int depth = 0;
  void* purpose = nullptr;
};

class Tracer {
 public:
  Tracer(const Scene& scene, std::size_t node_count, std::size_t layer_count)
      : scene_(&scene), costs_(node_count), recursions_(node_count), layers_(layer_count, Color(0)) {}

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

  Recursion& recursion(NodeId node) { return recursions_[node]; }

  /// Says which node works from now on, for whoever samples `present_node`: one store.
  void enter(NodeId node) { __atomic_store_n(&present_node_, node, __ATOMIC_RELAXED); }
  NodeId present_node() const { return __atomic_load_n(&present_node_, __ATOMIC_RELAXED); }
  static constexpr NodeId kIdle = 0xffff;

  /// Scratch for random numbers.
  SampleBlock& samples() { return *samples_; }

 private:
  const Scene* scene_;
  std::vector<NodeCost> costs_;
  std::vector<Recursion> recursions_;
  std::vector<Color> layers_;
  std::unique_ptr<SampleBlock> samples_ = std::make_unique<SampleBlock>();
  NodeId present_node_ = kIdle;
};

/// Calls `work(stream)` for samples [begin, end) of the stream with this key.
template <class Work>
void for_samples(std::uint32_t key, std::uint32_t begin, std::uint32_t end, Tracer& tracer, Work&& work) {
  constexpr std::uint32_t kFewest = 4;  // below, computing a whole block would cost more than it saves
  for (std::uint32_t i = begin; i < end;) {
    const std::uint32_t first = i / SampleBlock::kSamples * SampleBlock::kSamples;
    const std::uint32_t stop = std::min(end, first + SampleBlock::kSamples);
    SampleBlock* block = stop - i >= kFewest ? &tracer.samples() : nullptr;
    if (block) block->begin(key, first);
    for (; i < stop; ++i) work(SampleStream(key, i, block));
  }
}

}  // namespace ln
