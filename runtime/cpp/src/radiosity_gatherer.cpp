#include "radiosity_gatherer.hpp"

#include <algorithm>
#include <glm/common.hpp>

namespace ln::radiosity {

namespace {

/// A source whose leaves differ from its mean by less than this share shines evenly.
constexpr float kEven = 0.1f;
/// Gathering goes down to cells of this radius, as a share of the distance; those of less than kFar count as points.
constexpr float kResolved = 0.12f, kFar = 0.08f;
/// Leaves of a larger radius, in half diagonals of the scene, gather at several points.
constexpr float kSmall = 1.0f / 16;

}  // namespace

std::vector<Color> Gatherer::at_leaves() const {
  const Shine shine(shape_, context_.workers(), light_.radiosity);
  const std::vector<Color> one(shape_.elements.size(), Color(1));
  const Shine even(shape_, context_.workers(), one);
  std::vector<Flow> flows(links_.size());
  std::vector<float> sums(links_.size());
  context_.workers().parallel_for(links_.size(), 64, [&](std::size_t l) {
    if (links_[l].plain()) return;
    flows[l] = links_.flow(links_[l], shine);
    sums[l] = links_.flow(links_[l], even).flow.x;
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
        const Gathered all = gather(Receiver(shape_, place), flows, sums, tracer);
        mean.E += all.E / static_cast<float>(points);
        mean.sum += all.sum / static_cast<float>(points);
      }
      found[i] = sum_correction(shape_, number, mean.sum) * mean.E;
    }
  });
  return found;
}

/// The middle of a cell says enough of it, but what stands before a large one may hide things from just there.
std::uint32_t Gatherer::points_in(const Element& element) {
  return static_cast<std::uint32_t>(std::clamp(sqr(element.flat.radius / kSmall), 1.0f, 16.0f));
}

/// What the links of a leaf, and of all that it is a part of, bring to a point of it.
Gatherer::Gathered Gatherer::gather(const Receiver& receiver, const std::vector<Flow>& flows, const std::vector<float>& sums,
                                    Tracer& tracer) const {
  Gathered all;
  const auto add_links = [&](NodeRef n) {
    const Links::Range range = links_.to(n);
    for (std::size_t l = range.first; l < range.end; ++l) {
      const Link& link = links_[l];
      Gathered g;
      if (link.plain())
        add_unoccluded(link.source, receiver, g);
      else
        g = unoccluded(link, flows[l], sums[l], receiver);
      occlude(g, link, receiver, tracer);
      all.E += g.E;
      all.sum += g.sum;
    }
  };
  for (std::uint32_t e = receiver.element; e != kNoNode; e = shape_.elements[e].parent) add_links(e);
  NodeRef c = shape_.faces[shape_.elements[receiver.element].face].parent;
  for (; c != kNoNode; c = shape_.clusters[cluster_index(c)].parent) add_links(c);
  return all;
}

/// What an element brings if nothing is in between: by its leaves where it is near, for radiosity varies over it.
void Gatherer::add_unoccluded(std::uint32_t element, const Receiver& receiver, Gathered& g) const {
  const Element& e = shape_.elements[element];
  const Vec3 way = e.flat.cell.center() - receiver.p;
  const float distance = glm::length(way), facing = glm::dot(way, receiver.n);
  if (!e.leaf() && e.flat.radius > kResolved * distance) {
    for (std::uint32_t c = 0; c < 4; ++c) add_unoccluded(e.children + c, receiver, g);
    return;
  }
  const bool far = e.flat.radius < kFar * distance && facing > e.flat.radius;
  const float f = far ? facing * std::max(0.0f, -glm::dot(way, e.flat.normal)) * e.flat.area * kInvPi / sqr(sqr(distance))
                      : point_form_factor(receiver.p, receiver.n, e.flat);
  g.E += f * light_.radiosity[element];
  g.sum += f;
}

/// The same of a link to or from a cluster, which brings `flow`, `sum` of form factors, to the center of its receiver.
Gatherer::Gathered Gatherer::unoccluded(const Link& link, const Flow& flow, float sum, const Receiver& receiver) const {
  const Vec3 source = shape_.center(link.source), way = source - receiver.p;
  const float facing = glm::dot(receiver.n, way), distance2 = glm::dot(way, way);
  if (!(facing > 0)) return {};
  const float least = sqr(shape_.radius(link.source)), far = glm::distance(source, shape_.center(link.receiver));
  const float f = facing / std::sqrt(distance2) * std::max(sqr(far), least) / std::max(distance2, least);
  return {f * flow.flow, f * sum};
}

/// Takes off what is hidden. In the mean over rays to points that are picked by what they bring, or, for the sum of form
/// factors of a source that does not shine evenly, to any.
void Gatherer::occlude(Gathered& g, const Link& link, const Receiver& receiver, Tracer& tracer) const {
  if (!(g.sum > 0)) return;
  const float importance = light_.brightness(link.source, link.receiver) * g.sum / allowed_;
  if (!link.plain() && kRaysOfError * importance < 1) return occlude_at_random(g, link, receiver, importance, tracer);
  const std::uint32_t rays = rays_of(importance);
  const float visible = visible_share(link, receiver, rays, true, tracer);
  const bool even =
      is_cluster(link.source) || light_.spread[link.source] <= kEven * max_component(light_.radiosity[link.source]);
  const bool closed = shape_.faces[shape_.elements[receiver.element].face].enclosed;
  g.E *= visible;
  g.sum *= even || !closed ? visible : visible_share(link, receiver, rays, false, tracer);
}

/// The same for a link that would deserve a part of a ray: some get a whole one, which then counts for others, too; they all
/// start from what the link is known to see.
void Gatherer::occlude_at_random(Gathered& g, const Link& link, const Receiver& receiver, float importance,
                                 Tracer& tracer) const {
  const float chance = kRaysOfError * importance;
  float visible = link.visibility;
  if (to_unit_float(hash32(receiver.element, hash32(link.receiver, link.source))) < chance)
    visible += (visible_share(link, receiver, 1, true, tracer) - visible) / chance;
  g.E *= visible;
  g.sum *= visible;
}

float Gatherer::visible_share(const Link& link, const Receiver& receiver, std::uint32_t rays, bool bright,
                              Tracer& tracer) const {
  constexpr std::uint32_t kTries = 4;  // to find a point that faces the receiver
  const std::uint32_t key = hash32(receiver.element, hash32(link.source, bright ? 2 : 3));
  const PairSequence sequence(key);
  std::uint32_t visible = 0;
  for (std::uint32_t r = 0; r < rays; ++r) {
    Hierarchy::Place place{};
    for (std::uint32_t i = kTries * r; i < kTries * (r + 1); ++i) {
      const PairOfPoints random = sequence[i];
      place = bright ? bright_place(link.source, random.pick.x, random.u) : shape_.place(link.source, random.pick.x, random.u);
      const Vec3 way = place.p - receiver.p;
      if (glm::dot(way, receiver.n) > 0 && glm::dot(way, shape_.elements[place.element].flat.normal) < 0) break;
    }
    if (!tracer.occluded(spawn_ray_to(receiver.at, shape_.locate(place)), hash32(key, r), node_)) ++visible;
  }
  return static_cast<float>(visible) / static_cast<float>(rays);
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
