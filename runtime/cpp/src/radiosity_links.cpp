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

Flow Links::flow(const Link& link, const std::vector<Color>& radiosity) const {
  const Vec3 way = shape_.center(link.source) - shape_.center(link.receiver);
  const float distance2 = std::max(glm::dot(way, way), 1e-12f);
  const Vec3 towards = way / std::sqrt(distance2);
  Color sum(0);
  const auto add = [&](std::uint32_t element) {
    const FlatCell& flat = shape_.elements[element].flat;
    const float facing = -glm::dot(flat.normal, towards);
    if (facing > 0) sum += (flat.area * facing) * radiosity[element];
  };
  if (is_cluster(link.source)) {
    const Cluster& c = shape_.clusters[cluster_index(link.source)];
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i) add(i);
  } else {
    add(link.source);
  }
  return {towards, sum * (kInvPi / std::max(distance2, sqr(shape_.radius(link.source))))};
}

/// What a link between elements brings without occlusion.
Color Links::unoccluded(const Link& link, const std::vector<Color>& radiosity) const {
  const Element& source = shape_.elements[link.source];
  const float* f = link.factor;
  if (source.leaf()) return (f[0] + f[1] + f[2] + f[3]) * radiosity[link.source];
  const Color* quarter = &radiosity[source.children];
  return f[0] * quarter[0] + f[1] * quarter[1] + f[2] * quarter[2] + f[3] * quarter[3];
}

std::vector<Color> Links::transport(Workers& workers, const std::vector<Color>& radiosity) const {
  // Links with clusters on their receiving side: once each, then by every face below.
  const std::size_t base = first_of_cluster_[0];
  std::vector<Flow> flows(links_.size() - base);
  workers.parallel_for(flows.size(), 64, [&](std::size_t i) {
    flows[i] = flow(links_[base + i], radiosity);
    flows[i].flow *= links_[base + i].visibility;
  });
  std::vector<Color> arriving(shape_.elements.size(), Color(0));
  workers.parallel_for(shape_.elements.size(), 256, [&](std::size_t i) {
    const Element& element = shape_.elements[i];
    const Vec3 n = element.flat.normal;
    Color sum(0);
    for (std::size_t l = first_of_element_[i]; l < first_of_element_[i + 1]; ++l) {
      const Link& link = links_[l];
      if (link.plain()) {
        sum += link.visibility * unoccluded(link, radiosity);
      } else {
        const Flow f = flow(link, radiosity);
        sum += link.visibility * std::max(0.0f, glm::dot(n, f.towards)) * f.flow;
      }
    }
    if (element.parent == kNoNode) {
      for (NodeRef c = shape_.faces[i].parent; c != kNoNode; c = shape_.clusters[cluster_index(c)].parent)
        for (std::size_t l = first_of_cluster_[cluster_index(c)]; l < first_of_cluster_[cluster_index(c) + 1]; ++l)
          sum += std::max(0.0f, glm::dot(n, flows[l - base].towards)) * flows[l - base].flow;
    }
    arriving[i] = sum;
  });
  for (std::size_t i = shape_.faces.size(); i < arriving.size(); ++i) arriving[i] += arriving[shape_.elements[i].parent];
  return arriving;
}

}  // namespace ln::radiosity
