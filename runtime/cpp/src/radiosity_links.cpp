#include "radiosity_links.hpp"

#include <algorithm>

namespace ln::radiosity {

/// Sorts them, and finds where those of each element and cluster begin; those with clusters are numbered, too.
void Links::set(std::vector<Link> links) {
  links_ = std::move(links);
  std::sort(links_.begin(), links_.end(), [](const Link& x, const Link& y) {
    return x.receiver != y.receiver ? x.receiver < y.receiver : x.source < y.source;
  });
  first_of_element_.assign(shape_.elements.size() + 1, 0);
  first_of_cluster_.assign(shape_.clusters.size() + 1, 0);
  std::size_t plain = 0;
  for (const Link& link : links_) {
    if (is_cluster(link.receiver)) {
      ++first_of_cluster_[cluster_index(link.receiver) + 1];
    } else {
      ++first_of_element_[link.receiver + 1];
      ++plain;
    }
  }
  for (std::size_t i = 1; i < first_of_element_.size(); ++i) first_of_element_[i] += first_of_element_[i - 1];
  first_of_cluster_[0] = plain;
  for (std::size_t i = 1; i < first_of_cluster_.size(); ++i) first_of_cluster_[i] += first_of_cluster_[i - 1];
}

Shine::Shine(const Hierarchy& shape, Workers& workers, const std::vector<Color>& radiosity)
    : shape_(shape), radiosity_(radiosity), lobes_(shape.lobes.size()) {
  workers.parallel_for(lobes_.size(), 1, [&](std::size_t k) {
    const Lobes& lobes = shape_.lobes[k];
    const Cluster& c = shape_.clusters[lobes.cluster];
    lobes_[k].fill(Color(0));
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i)
      lobes_[k][shape_.lobe_of_face[i]] += shape_.elements[i].flat.area * radiosity_[i];
    for (std::uint32_t j = 0; j < kLobes; ++j)
      if (lobes.area[j] > 0) lobes_[k][j] /= lobes.area[j];
  });
}

Color Shine::towards(NodeRef n, const Vec3& direction) const {
  if (!is_cluster(n)) return shape_.projected_area(n, direction) * radiosity_[n];
  const Cluster& c = shape_.clusters[cluster_index(n)];
  Color sum(0);
  if (c.lobes != kNoNode) {
    for (std::uint32_t j = 0; j < kLobes; ++j)
      sum += std::max(0.0f, glm::dot(shape_.lobes[c.lobes].area_normal[j], direction)) * lobes_[c.lobes][j];
  } else {
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i)
      sum += std::max(0.0f, glm::dot(shape_.area_normals[i], direction)) * radiosity_[i];
  }
  return sum;
}

Flow Links::flow(const Link& link, const Shine& shine) const {
  const Vec3 way = shape_.center(link.source) - shape_.center(link.receiver);
  const float distance2 = std::max(glm::dot(way, way), 1e-12f);
  const Vec3 towards = way / std::sqrt(distance2);
  return {towards, shine.towards(link.source, -towards) * (kInvPi / std::max(distance2, sqr(shape_.radius(link.source))))};
}

/// What a link between elements brings without occlusion.
Color Links::unoccluded(const Link& link, const std::vector<Color>& radiosity) const {
  const Element& source = shape_.elements[link.source];
  const float* f = link.factor;
  if (source.leaf()) return (f[0] + f[1] + f[2] + f[3]) * radiosity[link.source];
  const Color* quarter = &radiosity[source.children];
  return f[0] * quarter[0] + f[1] * quarter[1] + f[2] * quarter[2] + f[3] * quarter[3];
}

/// Light that arrives at a large cluster, summed up by its direction: sums of flows times directions, by channel.
struct Incident {
  std::array<std::array<Vec3, 3>, kLobes> sums = {};

  void add(const Flow& flow) {
    std::array<Vec3, 3>& lobe = sums[lobe_of(flow.towards)];
    for (int c = 0; c < 3; ++c) lobe[static_cast<std::size_t>(c)] += flow.flow[c] * flow.towards;
  }
  void add(const Incident& other) {
    for (std::size_t j = 0; j < kLobes; ++j)
      for (std::size_t c = 0; c < 3; ++c) sums[j][c] += other.sums[j][c];
  }
  /// Irradiance on a face with the normal n.
  Color on(const Vec3& n) const {
    Color sum(0);
    for (const std::array<Vec3, 3>& lobe : sums)
      for (int c = 0; c < 3; ++c) sum[c] += std::max(0.0f, glm::dot(n, lobe[static_cast<std::size_t>(c)]));
    return sum;
  }
};

std::vector<Color> Links::transport(Workers& workers, const std::vector<Color>& radiosity) const {
  const Shine shine(shape_, workers, radiosity);
  const auto brought = [&](const Link& link) {
    Flow f = flow(link, shine);
    f.flow *= link.visibility;
    return f;
  };
  // To clusters: once for each link or, to large ones, for all links together.
  std::vector<Incident> incident(shape_.lobes.size());
  workers.parallel_for(incident.size(), 1, [&](std::size_t k) {
    const Range range = to(shape_.lobes[k].cluster | kClusterBit);
    for (std::size_t l = range.first; l < range.end; ++l) incident[k].add(brought(links_[l]));
  });
  for (std::size_t k = 0; k < incident.size(); ++k) {
    const NodeRef parent = shape_.clusters[shape_.lobes[k].cluster].parent;
    if (parent != kNoNode) incident[k].add(incident[shape_.clusters[cluster_index(parent)].lobes]);
  }
  const std::size_t base = first_of_cluster_[0];
  std::vector<Flow> flows(links_.size() - base);
  workers.parallel_for(flows.size(), 64, [&](std::size_t i) {
    const Link& link = links_[base + i];
    if (shape_.clusters[cluster_index(link.receiver)].lobes == kNoNode) flows[i] = brought(link);
  });

  std::vector<Color> arriving(shape_.elements.size(), Color(0));
  workers.parallel_for(shape_.elements.size(), 256, [&](std::size_t i) {
    const Element& element = shape_.elements[i];
    const Vec3 n = element.flat.normal;
    const auto on_face = [&](const Flow& f) { return std::max(0.0f, glm::dot(n, f.towards)) * f.flow; };
    Color sum(0);
    for (std::size_t l = first_of_element_[i]; l < first_of_element_[i + 1]; ++l) {
      const Link& link = links_[l];
      sum += link.plain() ? link.visibility * unoccluded(link, radiosity) : on_face(brought(link));
    }
    NodeRef c = element.parent == kNoNode ? shape_.faces[i].parent : kNoNode;
    for (; c != kNoNode; c = shape_.clusters[cluster_index(c)].parent) {
      const std::uint32_t large = shape_.clusters[cluster_index(c)].lobes;
      if (large != kNoNode) {
        sum += incident[large].on(n);
        break;
      }
      const Range range = to(c);
      for (std::size_t l = range.first; l < range.end; ++l) sum += on_face(flows[l - base]);
    }
    arriving[i] = sum;
  });
  for (std::size_t i = shape_.faces.size(); i < arriving.size(); ++i) arriving[i] += arriving[shape_.elements[i].parent];
  return arriving;
}

/// Sums of form factors are corrected by no more than this.
constexpr float kLargestCorrection = 1.5f;

float sum_correction(const Hierarchy& shape, std::uint32_t element, float sum) {
  if (!(sum > 0)) return 1;
  return std::clamp(1 / sum, 1 / kLargestCorrection, shape.enclosed(element) ? kLargestCorrection : 1.0f);
}

}  // namespace ln::radiosity
