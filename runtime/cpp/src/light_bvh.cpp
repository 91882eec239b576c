#include "ln/light_bvh.hpp"

#include <numeric>

namespace ln {

namespace {

struct Box {
  Vec3 low{kInfinity}, high{-kInfinity};

  void add(const Vec3& p) { low = glm::min(low, p), high = glm::max(high, p); }
  void add(const Box& b) { low = glm::min(low, b.low), high = glm::max(high, b.high); }
  float diagonal2() const { return low.x <= high.x ? glm::dot(high - low, high - low) : 0.0f; }
};

/// What the cost of a set of lights is estimated from.
struct Summary {
  Box box;
  double phi = 0;
  Vec3 axes{0};  // sum of axes by power, shortened by their own spread
  std::uint32_t count = 0;

  void add(const Summary& s) {
    box.add(s.box);
    phi += s.phi;
    axes += s.axes;
    count += s.count;
  }

  /// Power times spread in space times spread in direction (Conty & Kulla 2018, eq. 1 and 2).
  double cost() const {
    if (count == 0 || phi <= 0) return 0;
    // Normals spread evenly over a cap of half angle theta_o have a mean of length r = (1 + cos(theta_o)) / 2. The
    // paper's measure of a cone with theta_e = 90 degrees then is pi for r = 1 and 4 pi for r = 0; a fit in between.
    const double r = std::min(glm::length(glm::dvec3(axes)) / phi, 1.0);
    return phi * (4 - 3 * r * r * r) * box.diagonal2();
  }
};

class Builder {
 public:
  explicit Builder(const std::vector<LightBounds>& lights, double scale)
      : lights_(lights), order_(lights.size()), summaries_(lights.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const LightBounds& l = lights[i];
      Summary& s = summaries_[i];
      s.box.add(l.center - l.radius);
      s.box.add(l.center + l.radius);
      s.phi = l.phi / scale;
      s.axes = 0.5f * (1 + l.cos_o) * static_cast<float>(s.phi) * l.axis;
      // The two faces of a light have no common direction; compare them by one of the two.
      if (l.two_sided && (l.axis.z < 0 || (l.axis.z == 0 && (l.axis.y < 0 || (l.axis.y == 0 && l.axis.x < 0)))))
        s.axes = -s.axes;
      s.count = 1;
    }
  }

  struct Range {
    std::uint32_t begin, end;
    double cost;
  };

  std::uint32_t light(std::uint32_t position) const { return order_[position]; }

  Range range(std::uint32_t begin, std::uint32_t end) const {
    Summary all;
    for (std::uint32_t i = begin; i < end; ++i) all.add(summaries_[order_[i]]);
    return {begin, end, all.cost()};
  }

  /// Divides a range into at most LightBvh::kWidth, always the costliest first.
  std::vector<Range> divide(std::uint32_t begin, std::uint32_t end, bool by_median) {
    std::vector<Range> parts;
    if (end - begin <= LightBvh::kWidth) {
      for (std::uint32_t i = begin; i < end; ++i) parts.push_back({i, i + 1, 0});
      return parts;
    }
    parts.push_back(range(begin, end));
    while (parts.size() < LightBvh::kWidth) {
      std::size_t best = parts.size();
      for (std::size_t i = 0; i < parts.size(); ++i) {
        const auto count = [&](std::size_t k) { return parts[k].end - parts[k].begin; };
        if (count(i) < 2) continue;
        if (best == parts.size() || parts[i].cost > parts[best].cost ||
            (parts[i].cost == parts[best].cost && count(i) > count(best)))
          best = i;
      }
      if (best == parts.size()) break;
      const Range whole = parts[best];
      const std::uint32_t middle = by_median ? (whole.begin + whole.end) / 2 : split(whole.begin, whole.end);
      parts[best] = range(whole.begin, middle);
      parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(best) + 1, range(middle, whole.end));
    }
    return parts;
  }

  /// Bounds of all lights of a range, conservative.
  LightBounds bounds(std::uint32_t begin, std::uint32_t end) const {
    if (end - begin == 1) return lights_[order_[begin]];
    LightBounds result;
    Box box;
    Vec3 axes(0);
    result.cos_e = 1;
    for (std::uint32_t i = begin; i < end; ++i) {
      const LightBounds& l = lights_[order_[i]];
      const Summary& s = summaries_[order_[i]];
      box.add(s.box);
      axes += s.axes;
      result.phi += l.phi;
      result.two_sided |= l.two_sided;
      result.cos_e = std::min(result.cos_e, l.cos_e);
    }
    result.center = 0.5f * (box.low + box.high);
    const float length = glm::length(axes);
    result.axis = length > 0 ? axes / length : Vec3(0, 0, 1);
    float theta_o = 0;
    for (std::uint32_t i = begin; i < end; ++i) {
      const LightBounds& l = lights_[order_[i]];
      result.radius = std::max(result.radius, glm::distance(result.center, l.center) + l.radius);
      float cosine = glm::dot(result.axis, l.axis);
      if (result.two_sided) cosine = std::abs(cosine);
      theta_o = std::max(theta_o, std::acos(std::clamp(cosine, -1.0f, 1.0f)) + std::acos(std::clamp(l.cos_o, -1.0f, 1.0f)));
    }
    result.radius *= 1 + 0x1p-18f;
    result.cos_o = std::cos(std::min(theta_o + 1e-4f, kPi));
    return result;
  }

 private:
  /// Where to divide a range in two: the cheapest of the bounds between bins along the three axes; reorders the range.
  std::uint32_t split(std::uint32_t begin, std::uint32_t end) {
    constexpr int kMostBins = 12;
    const int bins_used = end - begin < 64 ? 6 : kMostBins;
    const std::uint32_t half = (begin + end) / 2;
    if (end - begin == 2) return half;
    Box centers, box;
    for (std::uint32_t i = begin; i < end; ++i) {
      centers.add(lights_[order_[i]].center);
      box.add(summaries_[order_[i]].box);
    }
    const Vec3 extent = box.high - box.low;
    const float longest = max_component(extent);
    double best_cost = std::numeric_limits<double>::infinity();
    int best_axis = -1, best_bin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = centers.low[axis], width = centers.high[axis] - low;
      if (!(width > 0)) continue;
      Summary bins[kMostBins];
      for (std::uint32_t i = begin; i < end; ++i) bins[bin(order_[i], axis, low, width, bins_used)].add(summaries_[order_[i]]);
      // Charge thin slices for being long in the other directions.
      const double regularity = longest / std::max(extent[axis], longest * 1e-6f);
      Summary upper[kMostBins];
      for (int b = bins_used - 1; b > 0; --b) {
        upper[b] = b + 1 < bins_used ? upper[b + 1] : Summary{};
        upper[b].add(bins[b]);
      }
      Summary lower;
      for (int b = 0; b + 1 < bins_used; ++b) {
        lower.add(bins[b]);
        if (lower.count == 0 || upper[b + 1].count == 0) continue;
        const double cost = regularity * (lower.cost() + upper[b + 1].cost());
        if (cost < best_cost) best_cost = cost, best_axis = axis, best_bin = b;
      }
    }
    if (best_axis < 0) return half;
    const float low = centers.low[best_axis], width = centers.high[best_axis] - low;
    const auto middle = std::stable_partition(order_.begin() + begin, order_.begin() + end, [&](std::uint32_t i) {
      return bin(i, best_axis, low, width, bins_used) <= best_bin;
    });
    return static_cast<std::uint32_t>(middle - order_.begin());
  }

  int bin(std::uint32_t light, int axis, float low, float width, int bins) const {
    return std::clamp(static_cast<int>((lights_[light].center[axis] - low) / width * static_cast<float>(bins)), 0, bins - 1);
  }

  const std::vector<LightBounds>& lights_;
  std::vector<std::uint32_t> order_;
  std::vector<Summary> summaries_;
};

}  // namespace

LightBvh::LightBvh(const std::vector<LightBounds>& lights) {
  scale_ = 0;
  for (const LightBounds& l : lights) scale_ += l.phi;
  light_slot_.resize(lights.size());
  if (lights.empty()) return;

  Builder builder(lights, scale_);
  struct Task {
    std::uint32_t begin, end, node;
    int depth;
  };
  nodes_.emplace_back();
  node_slot_.push_back(0);
  std::vector<Task> tasks{{0, static_cast<std::uint32_t>(lights.size()), 0, 0}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    const std::vector<Builder::Range> parts = builder.divide(task.begin, task.end, task.depth > 16);
    Node node{};
    for (std::uint32_t k = 0; k < parts.size(); ++k) {
      const auto [begin, end, cost] = parts[k];
      const LightBounds b = builder.bounds(begin, end);
      node.cx[k] = b.center.x, node.cy[k] = b.center.y, node.cz[k] = b.center.z;
      // Allow for rounding in the positions: normalised coordinates are at most 1.
      node.r[k] = b.radius * (1 + 0x1p-18f) + 0x1p-22f;
      node.inv_r2[k] = 1 / sqr(node.r[k]);
      node.ax[k] = b.axis.x, node.ay[k] = b.axis.y, node.az[k] = b.axis.z;
      node.cos_o[k] = b.cos_o, node.sin_o[k] = safe_sqrt(1 - b.cos_o * b.cos_o), node.cos_e[k] = b.cos_e;
      node.phi[k] = static_cast<float>(std::max(b.phi / scale_, 1e-30));
      node.two_sided[k] = b.two_sided ? 1.0f : -1.0f;
      const std::uint32_t slot = task.node * kWidth + k;
      if (end - begin == 1) {
        node.child[k] = kLeaf | builder.light(begin);
        light_slot_[builder.light(begin)] = slot;
      } else {
        node.child[k] = static_cast<std::uint32_t>(nodes_.size());
        tasks.push_back({begin, end, node.child[k], task.depth + 1});
        nodes_.emplace_back();
        node_slot_.push_back(slot);
      }
    }
    nodes_[task.node] = node;
  }
}

inline void LightBvh::square_root(Float8& x) {
  for (int k = 0; k < kWidth; ++k) x[k] = std::sqrt(x[k]);
}

LightBvh::Lanes LightBvh::lanes(const Node& node, const Vec3& p, const Vec3& n) {
  // Directions that may contribute a little are not excluded because of rounding; facing factors have a floor.
  constexpr float kSlack = 1e-4f, kFloor = 1e-3f;
  const Float8 zero{}, one = zero + 1.0f;

  const Float8 x = p.x - node.cx, y = p.y - node.cy, z = p.z - node.cz;
  Float8 d2 = x * x + y * y + z * z;
  d2 = d2 > 1e-30f ? d2 : zero + 1e-30f;
  const Float8 inv_d2 = 1.0f / d2;
  Float8 inv_d = inv_d2;
  square_root(inv_d);

  // The lights are seen within theta_b; from within their sphere, in any direction.
  Float8 sin_b = node.r * inv_d;
  sin_b = sin_b < 1.0f ? sin_b : one;
  const auto inside = sin_b == 1.0f;
  Float8 cos_b = 1.0f - sin_b * sin_b;
  square_root(cos_b);

  // Smallest angle at which any of them may emit towards p: theta_w - theta_o - theta_b.
  const Float8 along = (node.ax * x + node.ay * y + node.az * z) * inv_d, other = -along * node.two_sided;
  Float8 cos_w = along > other ? along : other;
  cos_w = cos_w < 1.0f ? cos_w : one;
  Float8 sin_w = 1.0f - cos_w * cos_w;
  sin_w = sin_w > 0.0f ? sin_w : zero;
  square_root(sin_w);
  const auto in_cone = cos_w > node.cos_o;
  const Float8 cos_x = in_cone ? one : cos_w * node.cos_o + sin_w * node.sin_o;
  const Float8 sin_x = in_cone ? zero : sin_w * node.cos_o - cos_w * node.sin_o;
  const Float8 cos_emission = (inside | (cos_x > cos_b)) ? one : cos_x * cos_b + sin_x * sin_b;
  Float8 importance = cos_emission > kFloor ? cos_emission : zero + kFloor;
  importance = cos_emission > node.cos_e - kSlack ? importance : zero;

  // Smallest angle at which they may arrive: theta_i - theta_b.
  if (n != Vec3(0)) {
    Float8 cos_i = -(n.x * x + n.y * y + n.z * z) * inv_d;
    Float8 sin_i = 1.0f - cos_i * cos_i;
    sin_i = sin_i > 0.0f ? sin_i : zero;
    square_root(sin_i);
    const Float8 cos_arrival = (inside | (cos_i > cos_b)) ? one : cos_i * cos_b + sin_i * sin_b;
    importance *= cos_arrival > kFloor ? cos_arrival : zero + kFloor;
    importance = cos_arrival > -kSlack ? importance : zero;
  }

  importance *= node.phi * (inv_d2 < node.inv_r2 ? inv_d2 : node.inv_r2);
  Lanes result;
  float sum = 0;
  for (int k = 0; k < kWidth; ++k) {
    result.importance[k] = importance[k];
    result.sum[k] = sum += importance[k];
  }
  return result;
}

LightBvh::Pick LightBvh::sample(const Lanes& root, const Vec3& p, const Vec3& n, float u) const {
  const Lanes* here = &root;
  Lanes below;
  std::uint32_t node = 0;
  float pmf = 1;
  for (;;) {
    const float total = here->total();
    if (!(total > 0)) return {};
    // The child whose interval holds u: u < 1 leaves `target` below the last sum.
    const float target = u * total;
    int lane = 0;
    for (int k = 0; k + 1 < kWidth; ++k) lane += here->sum[k] <= target ? 1 : 0;
    const float importance = here->importance[lane];
    pmf *= importance / total;
    const std::uint32_t child = nodes_[node].child[lane];
    if (child & kLeaf) return {child & ~kLeaf, pmf};
    const float before = lane > 0 ? here->sum[lane - 1] : 0.0f;
    u = std::clamp((target - before) / importance, 0.0f, kOneMinusEpsilon);
    node = child;
    below = lanes(nodes_[node], p, n);
    here = &below;
  }
}

float LightBvh::pmf(const Lanes& root, const Vec3& p, const Vec3& n, std::uint32_t index) const {
  float pmf = 1;
  for (std::uint32_t slot = light_slot_[index];;) {
    const std::uint32_t node = slot / kWidth, lane = slot % kWidth;
    if (node == 0) return root.total() > 0 ? pmf * root.importance[lane] / root.total() : 0.0f;
    const Lanes here = lanes(nodes_[node], p, n);
    if (!(here.importance[lane] > 0)) return 0;
    pmf *= here.importance[lane] / here.total();
    slot = node_slot_[node];
  }
}

}  // namespace ln
