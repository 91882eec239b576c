#include "radiosity_gatherer.hpp"

#include <algorithm>
#include <glm/common.hpp>

#include "radiosity_visibility.hpp"

namespace ln::radiosity {

namespace {

/// A source whose leaves differ from its mean by less than this share shines evenly.
constexpr float kEven = 0.1f;
/// Gathering goes down to cells of this radius, as a share of the distance, which count as points; to larger ones for things in
/// clusters.
constexpr float kResolved = 0.12f, kRoughlyResolved = 0.5f;
/// Leaves of a larger radius, in half diagonals of the scene, gather at several points.
constexpr float kSmall = 1.0f / 16;

}  // namespace

std::vector<Color> Gatherer::at_leaves() const {
  const Shine shine(shape_, context_.workers(), light_.radiosity);
  const std::vector<Color> uniform = shape_.uniform_shine();
  const Shine even(shape_, context_.workers(), uniform);
  std::vector<Gathered> from_clusters(links_.size());  // to the centers of the links' receivers, if they faced them
  context_.workers().parallel_for(links_.size(), 64, [&](std::size_t l) {
    if (is_cluster(links_[l].source))
      from_clusters[l] = {links_.flow(links_[l], shine).flow, links_.flow(links_[l], even).flow.x};
  });
  std::vector<Color> found(shape_.elements.size(), Color(0));
  context_.for_chunks(found.size(), 16, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    tracer.enter(node_);
    for (std::size_t i = begin; i < end; ++i) {
      const Element& element = shape_.elements[i];
      if (!element.leaf() || !shape_.faces[element.face].receives) continue;
      const auto number = static_cast<std::uint32_t>(i);
      const std::uint32_t points = points_in(element);
      Gathered mean;
      for (std::uint32_t k = 0; k < points; ++k) {
        const Hierarchy::Place place = points == 1 ? shape_.middle(number) : shape_.place(number, 0, sobol_point(number, 0, k));
        mean += gather(Receiver(shape_, place, k), from_clusters, tracer) / static_cast<float>(points);
      }
      found[i] = mean.E;
      if (shape_.enclosed(number)) found[i] *= sum_correction(shape_, number, mean.sum);
    }
  });
  return found;
}

/// The middle of a cell says enough of it, but what stands before a large one may hide things from just there.
std::uint32_t Gatherer::points_in(const Element& element) {
  return static_cast<std::uint32_t>(std::clamp(sqr(element.flat.radius / kSmall), 1.0f, 16.0f));
}

/// What the links of a leaf, and of all that it is a part of, bring to a point of it.
Gatherer::Gathered Gatherer::gather(const Receiver& receiver, const std::vector<Gathered>& from_clusters,
                                    Tracer& tracer) const {
  Gathered all;
  const auto add_links = [&](NodeRef n) {
    const Links::Range range = links_.to(n);
    for (std::size_t l = range.first; l < range.end; ++l) {
      const Link& link = links_[l];
      const Gathered g = is_cluster(link.source)
                             ? from_clusters[l] * towards(link, receiver)
                             : unoccluded(link.source, receiver, link.plain() ? kResolved : kRoughlyResolved);
      if (g.sum > 0) all += visible_part(g, link, receiver, tracer);
    }
  };
  for (std::uint32_t e = receiver.element; e != kNoNode; e = shape_.elements[e].parent) add_links(e);
  NodeRef c = shape_.faces[shape_.elements[receiver.element].face].parent;
  for (; c != kNoNode; c = shape_.clusters[cluster_index(c)].parent) add_links(c);
  return all;
}

/// What an element brings if nothing is in between: by its parts where it is near, for radiosity varies over it.
Gatherer::Gathered Gatherer::unoccluded(std::uint32_t source, const Receiver& receiver, float resolved) const {
  const Element& e = shape_.elements[source];
  const Vec3 way = e.flat.cell.center() - receiver.p;
  const float distance = glm::length(way), facing = glm::dot(way, receiver.n);
  Gathered g;
  if (!e.leaf() && e.flat.radius > resolved * distance) {
    for (std::uint32_t c = e.children; c < e.children + 4; ++c) g += unoccluded(c, receiver, resolved);
    return g;
  }
  const bool far = e.flat.radius < kResolved * distance && facing > e.flat.radius;
  g.sum = far ? facing * std::max(0.0f, -glm::dot(way, e.flat.normal)) * e.flat.area * kInvPi / sqr(sqr(distance))
              : point_form_factor(receiver.p, receiver.n, e.flat);
  g.E = g.sum * light_.radiosity[source];
  g.sum *= e.outermost;
  return g;
}

/// What the flow from a cluster to the center of the link's receiver is multiplied by for a point of it.
float Gatherer::towards(const Link& link, const Receiver& receiver) const {
  const Vec3 source = shape_.center(link.source), way = source - receiver.p;
  const float facing = glm::dot(receiver.n, way), distance2 = glm::dot(way, way);
  if (!(facing > 0)) return 0;
  const float least = sqr(shape_.radius(link.source)), far = glm::distance(source, shape_.center(link.receiver));
  return facing / std::sqrt(distance2) * std::max(sqr(far), least) / std::max(distance2, least);
}

/// What is not hidden of what a link brings. Of links that deserve a part of a ray some get a whole one, which then counts for
/// others, too; they all start from what the link is known to see.
Gatherer::Gathered Gatherer::visible_part(const Gathered& g, const Link& link, const Receiver& receiver, Tracer& tracer) const {
  const bool enclosed = shape_.enclosed(receiver.element);
  // A dark source's form factor is needed where that of the sum of all corrects the others.
  const float brought = enclosed ? std::max(max_component(g.E), g.sum * light_.mean) : max_component(g.E);
  const float chance = rays_of_error_ * brought / allowed_;
  if (chance < 1) {
    float visible = link.visibility;
    if (to_unit_float(hash32(receiver.key, hash32(link.receiver, link.source))) < chance)
      visible += (seen(link.source, receiver, 1, true, tracer) - visible) / chance;
    return g * visible;
  }
  const std::uint32_t rays = rays_of(brought / allowed_, rays_of_error_);
  const float visible = seen(link.source, receiver, rays, true, tracer);
  const bool even =
      is_cluster(link.source) || light_.spread[link.source] <= kEven * max_component(light_.radiosity[link.source]);
  return {visible * g.E, g.sum * (even || !enclosed ? visible : seen(link.source, receiver, rays, false, tracer))};
}

/// The share of rays that get through to points of the source, which are picked by what they bring, or would if it shone
/// evenly.
float Gatherer::seen(NodeRef source, const Receiver& receiver, std::uint32_t rays, bool bright, Tracer& tracer) const {
  const std::uint32_t key = hash32(receiver.key, hash32(source, bright ? 2 : 3));
  const PairSequence sequence(key);
  const float softening = is_cluster(source) ? softening_of(shape_.radius(source)) : 0;
  Hierarchy::Place to[Candidates::kMost];
  // Few for clusters, which are costly, and of which many points may face away.
  const std::uint32_t wanted = (is_cluster(source) ? 2 : 4) * rays;
  Candidates candidates(rays, wanted, 8 * rays);
  while (!candidates.enough()) {
    const std::uint32_t i = candidates.count();
    const PairOfPoints random = sequence[i];
    to[i] = bright ? bright_place(source, random.pick.x, random.u) : shape_.place(source, random.pick.x, random.u);
    candidates.add(exchange(to[i].p - receiver.p, receiver.n, shape_.elements[to[i].element].flat.normal, softening));
  }
  return candidates.visible_share([&](std::uint32_t i) {
    return !tracer.occluded(spawn_ray_to(receiver.at, shape_.locate(to[i])), hash32(key, i), node_);
  });
}

/// A point of a leaf below an element, picked by its radiosity; of a cluster any.
Hierarchy::Place Gatherer::bright_place(NodeRef n, float pick, const Vec2& u) const {
  while (!is_cluster(n) && !shape_.elements[n].leaf()) {
    const std::uint32_t first = shape_.elements[n].children;
    float up_to[4], sum = 0;
    for (std::uint32_t c = 0; c < 4; ++c) up_to[c] = sum += mean_component(light_.radiosity[first + c]);
    if (!(sum > 0)) break;
    std::uint32_t c = 0;
    while (c < 3 && pick * sum >= up_to[c]) ++c;
    const float below = c > 0 ? up_to[c - 1] : 0;
    pick = std::min((pick * sum - below) / (up_to[c] - below), kOneMinusEpsilon);
    n = first + c;
  }
  return shape_.place(n, pick, u);
}

}  // namespace ln::radiosity
