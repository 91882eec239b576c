#pragma once
// Photons in a balanced kd-tree, for the nearest ones around a point.

#include <memory>
#include <span>
#include <vector>

#include "ln/lanes.hpp"
#include "ln/photon_tracer.hpp"
#include "ln/scene.hpp"

namespace ln {

/// A photon near a point. `slot` is its place in the map.
struct NearPhoton {
  float distance2;
  std::uint32_t slot;
};

/// Which photons, and which parts of surfaces, tell about the irradiance at a point: those that face the same way, on
/// the same side of their triangles, lie in a flat double cone around the tangent plane, and are not a step away. Where a
/// surface bends evenly, offset . (sum of both normals) is 0, and one crease makes it the tangent of its angle times the
/// distance, at most; for parallel surfaces, it is twice the distance between them.
struct Neighbourhood {
  static constexpr float kMinCos = 0.9f;    // between geometric normals
  static constexpr float kMaxSlope = 0.5f;  // height over the tangent plane / distance within it
  static constexpr float kMaxStep = 0.02f;  // offset . (sum of normals) / distance within the plane, beyond what a crease makes

  /// Greatest |offset . (sum of normals)| / distance within the plane for normals with this cosine.
  static float max_step(float cosine) { return safe_sqrt(1 - sqr(cosine)) / cosine + kMaxStep; }

  Vec3 point{0};
  Vec3 normal{0, 0, 1};  // geometric, on the side where light is wanted; unit length
  bool front = true;     // that side is the front
};

/// Of the receiver of a request.
inline Neighbourhood neighbourhood(const Interaction& at) { return {at.at.p, at.front ? at.at.ng : -at.at.ng, at.front}; }

class CacheBytes;
class CacheReader;

class PhotonMap {
 public:
  PhotonMap() = default;
  PhotonMap(PrepareContext& context, std::span<const Photon> photons);

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Finds the nearest photons of a neighbourhood within sqrt(max_distance2), up to `wanted` of them. `found` has room for
  /// capacity(wanted). Returns their number; if it is `wanted`, the last is the farthest, the others are in no order.
  std::size_t nearest(const Neighbourhood& around, float max_distance2, std::size_t wanted, NearPhoton* found) const;
  static constexpr std::size_t capacity(std::size_t wanted) { return 2 * wanted + kBlock; }

  /// Calls `use` for each photon of a neighbourhood within sqrt(max_distance2).
  void within(const Neighbourhood& around, float max_distance2, FunctionRef<void(const NearPhoton&)> use) const;

  Vec3 position(std::uint32_t slot) const {
    const Block& b = blocks_[slot / kBlock];
    const std::uint32_t i = slot % kBlock;
    return {b.x[i], b.y[i], b.z[i]};
  }
  PackedNormal normal(std::uint32_t slot) const { return PackedNormal(blocks_[slot / kBlock].normal[slot % kBlock]); }
  Color flux(std::uint32_t slot) const {
    const Block& b = blocks_[slot / kBlock];
    const std::uint32_t i = slot % kBlock;
    return PackedColor(b.flux_low[i], b.flux_high[i]).unpack();
  }

  static constexpr std::uint32_t kBlock = kLanes;

  friend void encode(CacheBytes& out, const PhotonMap& map);
  friend void decode(CacheReader& in, PrepareContext& context, PhotonMap& map);

 private:
  /// Photons that are scanned together.
  struct alignas(32) Block {
    float x[kBlock], y[kBlock], z[kBlock];
    std::uint32_t normal[kBlock], flux_low[kBlock], flux_high[kBlock];
  };
  struct Node {
    float split;
    std::uint32_t axis;
  };
  struct Builder;

  /// Calls `use(photon)` for photons of a neighbourhood nearer than sqrt(limit), and `after_block()` after each block of them,
  /// which may lower the limit.
  template <class Use, class AfterBlock>
  void search(const Neighbourhood& around, const float& limit, Use&& use, AfterBlock&& after_block) const;

  /// Squared distance within which `wanted` photons are likely to be found around `p`.
  float likely_distance2(const Vec3& p, std::size_t wanted) const;

  std::size_t size_ = 0;
  std::vector<Block> blocks_;
  std::vector<Node> nodes_;  // [m]: between blocks m-1 and m; the node of blocks [b, e) is (b + e) / 2
};

struct TapFile;
/// Points with normals and flux. Formats: .ply, .csv.
void write_tap(const TapFile& tap, const PhotonMap& map);

}  // namespace ln
