#include "ln/photon_map.hpp"

#include <algorithm>
#include <bit>

namespace ln {

namespace {

/// Where the missing photons of the last block are: beyond any query, and squared still a float.
constexpr float kNowhere = 1e15f;

/// Blocks that a task of the parallel build should have.
constexpr std::size_t kTaskBlocks = 1024;

}  // namespace

struct PhotonMap::Builder {
  struct Item {
    Vec3 position;
    std::uint32_t photon;
  };
  struct Range {
    std::size_t begin, end;  // blocks
  };

  PhotonMap& map;
  std::vector<Item> items;

  /// Puts the smaller half of a range's photons, along its longest side, into the first half of its blocks.
  std::size_t split(Range range) {
    const std::size_t middle = (range.begin + range.end) / 2;
    Item* const first = items.data() + range.begin * kBlock;
    Item* const last = items.data() + std::min(range.end * kBlock, items.size());
    Item* const border = items.data() + middle * kBlock;
    Vec3 low = first->position, high = low;
    for (const Item* i = first; i != last; ++i) {
      low = glm::min(low, i->position);
      high = glm::max(high, i->position);
    }
    const Vec3 size = high - low;
    const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    std::nth_element(first, border, last, [axis](const Item& a, const Item& b) {
      const float pa = a.position[axis], pb = b.position[axis];
      return pa < pb || (pa == pb && a.photon < b.photon);
    });
    map.nodes_[middle] = {border->position[axis], static_cast<std::uint32_t>(axis)};
    return middle;
  }

  void split_all(Range range) {
    if (range.end - range.begin < 2) return;
    const std::size_t middle = split(range);
    split_all({range.begin, middle});
    split_all({middle, range.end});
  }
};

PhotonMap::PhotonMap(PrepareContext& context, std::span<const Photon> photons) : size_(photons.size()) {
  if (empty()) return;
  const std::size_t block_count = (size_ - 1) / kBlock + 1;
  nodes_.resize(block_count);
  blocks_.resize(block_count);
  Builder builder{*this, std::vector<Builder::Item>(size_)};
  context.for_chunks(size_, 1 << 16, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t i = begin; i < end; ++i) builder.items[i] = {photons[i].position, static_cast<std::uint32_t>(i)};
  });

  // Split level by level until there are enough tasks, then each range on its own.
  std::vector<Builder::Range> ranges{{0, block_count}};
  while (ranges.size() < 64 && ranges.front().end - ranges.front().begin > kTaskBlocks) {
    std::vector<Builder::Range> halves(2 * ranges.size());
    context.parallel_for(ranges.size(), [&](Tracer&, std::size_t i) {
      const std::size_t middle = builder.split(ranges[i]);
      halves[2 * i] = {ranges[i].begin, middle};
      halves[2 * i + 1] = {middle, ranges[i].end};
    });
    ranges.swap(halves);
  }
  context.parallel_for(ranges.size(), [&](Tracer&, std::size_t i) { builder.split_all(ranges[i]); });

  context.for_chunks(block_count, 1 << 12, [&](std::size_t begin, std::size_t end, Tracer&) {
    for (std::size_t b = begin; b < end; ++b) {
      Block& block = blocks_[b];
      for (std::uint32_t i = 0; i < kBlock; ++i) {
        const std::size_t slot = b * kBlock + i;
        if (slot >= size_) {
          block.x[i] = block.y[i] = block.z[i] = kNowhere;
          block.normal[i] = block.flux_low[i] = block.flux_high[i] = 0;
          continue;
        }
        const Photon& photon = photons[builder.items[slot].photon];
        block.x[i] = photon.position.x;
        block.y[i] = photon.position.y;
        block.z[i] = photon.position.z;
        block.normal[i] = photon.normal.bits;
        block.flux_low[i] = photon.flux.low;
        block.flux_high[i] = photon.flux.high;
      }
    }
  });
}

template <class Use, class AfterBlock>
void PhotonMap::search(const Neighbourhood& around, const float& limit, Use&& use, AfterBlock&& after_block) const {
  if (empty()) return;
  const Vec3 p = around.point, n = around.normal;

  // Neighbours mostly share their normal: decide once for a run of equal ones.
  std::uint32_t last_bits = 0;
  bool last_agrees = false, any_normal = false;
  Vec3 last_normal(0);
  float max_step2 = 0;
  const auto agrees = [&](std::uint32_t bits) {
    if (!any_normal || bits != last_bits) {
      const PackedNormal packed(bits);
      last_bits = bits;
      any_normal = true;
      last_normal = packed.normal();
      const float cosine = glm::dot(last_normal, n);
      last_agrees = packed.front() == around.front && cosine > Neighbourhood::kMinCos;
      max_step2 = last_agrees ? sqr(Neighbourhood::max_step(cosine)) : 0;
    }
    return last_agrees;
  };

  struct Pending {
    std::uint32_t begin, end;
    float distance2;
    Vec3 offset;  // from the point to the range's cell
  };
  Pending stack[64];
  int depth = 0;
  stack[depth++] = {0, static_cast<std::uint32_t>(blocks_.size()), 0, Vec3(0)};
  while (depth > 0) {
    Pending range = stack[--depth];
    if (range.distance2 >= limit) continue;
    while (range.end - range.begin > 1) {
      const std::uint32_t middle = (range.begin + range.end) / 2;
      const Node node = nodes_[middle];
      const float difference = p[node.axis] - node.split;
      Pending far = range;
      if (difference < 0) {
        far.begin = middle;
        range.end = middle;
      } else {
        far.end = middle;
        range.begin = middle;
      }
      far.distance2 += sqr(difference) - sqr(range.offset[node.axis]);
      far.offset[node.axis] = difference;
      if (far.distance2 < limit) stack[depth++] = far;
    }

    const Block& block = blocks_[range.begin];
    const Lanes x = load(block.x) - p.x, y = load(block.y) - p.y, z = load(block.z) - p.z;
    const Lanes height = x * n.x + y * n.y + z * n.z, distance2 = x * x + y * y + z * z;
    // height <= slope * distance in the plane
    constexpr float kSlope2 = Neighbourhood::kMaxSlope * Neighbourhood::kMaxSlope;
    constexpr float kRounding2 = 1e-12f;
    unsigned near = lane_bits((distance2 < limit) & (height * height * (1 + kSlope2) <= kSlope2 * distance2 + kRounding2));
    for (; near != 0; near &= near - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(near));
      if (!agrees(block.normal[i])) continue;
      const float step = height[i] + x[i] * last_normal.x + y[i] * last_normal.y + z[i] * last_normal.z;
      if (sqr(step) <= max_step2 * (distance2[i] - sqr(height[i])) + kRounding2)
        use(NearPhoton{distance2[i], range.begin * kBlock + i});
    }
    after_block();
  }
}

float PhotonMap::likely_distance2(const Vec3& p, std::size_t wanted) const {
  // The photons of the smallest range around the point that has so many.
  std::uint32_t begin = 0, end = static_cast<std::uint32_t>(blocks_.size());
  while ((end - begin) / 2 * kBlock >= wanted) {
    const std::uint32_t middle = (begin + end) / 2;
    if (p[nodes_[middle].axis] < nodes_[middle].split)
      end = middle;
    else
      begin = middle;
  }
  Lanes low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = Lanes{} + kNowhere;
    high[axis] = Lanes{} - kNowhere;
  }
  for (std::uint32_t b = begin; b < end; ++b) {
    const float* const coordinates[3] = {blocks_[b].x, blocks_[b].y, blocks_[b].z};
    for (int axis = 0; axis < 3; ++axis) {
      const Lanes x = load(coordinates[axis]);
      low[axis] = x < low[axis] ? x : low[axis];
      high[axis] = (x > high[axis]) & (x < kNowhere) ? x : high[axis];
    }
  }
  float size[3];
  for (int axis = 0; axis < 3; ++axis) {
    float least = kNowhere, most = -kNowhere;
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      least = std::min(least, low[axis][i]);
      most = std::max(most, high[axis][i]);
    }
    size[axis] = most - least;
  }
  // They lie on a surface: two of the three sides are its.
  std::sort(size, size + 3);
  constexpr float kMargin = 1.5f;
  const auto count = static_cast<float>((end - begin) * kBlock);
  return std::max(size[1] * size[2] * kInvPi * kMargin * static_cast<float>(wanted) / count, 1e-12f);
}

std::size_t PhotonMap::nearest(const Neighbourhood& around, float max_distance2, std::size_t wanted, NearPhoton* found) const {
  if (wanted == 0 || empty()) return 0;
  std::size_t count = 0;
  float limit = 0;
  const auto keep_nearest = [&] {
    const auto nearer = [](const NearPhoton& a, const NearPhoton& b) { return a.distance2 < b.distance2; };
    std::nth_element(found, found + (wanted - 1), found + count, nearer);
    count = wanted;
    limit = found[wanted - 1].distance2;
  };
  // Most of the time goes into sorting out what is too far: begin with a ball that will hardly have too many.
  for (float ball = likely_distance2(around.point, wanted);; ball *= 4) {
    count = 0;
    limit = std::min(ball, max_distance2);
    search(
        around, limit, [&](const NearPhoton& photon) { found[count++] = photon; },
        [&] {
          if (count > 2 * wanted) keep_nearest();  // the next block has room again
        });
    if (count >= wanted || ball >= max_distance2) break;
  }
  if (count >= wanted) keep_nearest();
  return count;
}

void PhotonMap::within(const Neighbourhood& around, float max_distance2, FunctionRef<void(const NearPhoton&)> use) const {
  search(around, max_distance2, use, [] {});
}

}  // namespace ln
