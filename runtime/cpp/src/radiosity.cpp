#include "ln/radiosity.hpp"

#include <algorithm>
#include <glm/common.hpp>

#include "ln/emitter_shapes.hpp"
#include "ln/error.hpp"
#include "ln/stats.hpp"
#include "radiosity_links.hpp"

namespace ln {

namespace radiosity {

namespace {

enum class Verdict : std::uint8_t { drop, keep, divide_receiver, divide_source };

constexpr std::uint32_t kMostRays = 16;
/// Rays of a link that carries as much as it may err.
constexpr float kRaysOfError = 4;
/// A dark surface counts as this bright, in means of the radiosity, where light arrives: its form factors are needed for the
/// sum of all, which is known.
constexpr float kDarkest = 1;
/// Weight of errors from uneven sources: unlike others they have mostly the same sign, since bright places are near to each
/// other.
constexpr float kSourceWeight = 4;
/// A link between things that overlap errs by so many times what it carries.
constexpr float kOverlapping = 8;
/// Cells that are nearer to each other, in sums of their radii, look at each other by solid angle.
constexpr float kNear = 3;
/// Rays of a link that is dropped when all of them are blocked.
constexpr std::uint32_t kRaysOfHidden = 8;
/// A point counts as this bright at least, in means of the radiosity, when points are picked for rays.
constexpr float kFaintest = 1e-3f;
/// Gathers at leaves: each leaves a few percent of the error that was there before.
constexpr int kGathers = 2;
/// Sums of form factors are corrected by no more than this.
constexpr float kLargestCorrection = 1.5f;
/// A source whose leaves differ from its mean by less than this share shines evenly.
constexpr float kEven = 0.1f;
/// Gathering goes down to cells of this radius, as a share of the distance; those of less than kFar count as points.
constexpr float kResolved = 0.12f, kFar = 0.08f;
/// Leaves of a larger radius, in half diagonals of the scene, gather at several points.
constexpr float kSmall = 1.0f / 16;
/// Residual of iterations whose result is not the last one.
constexpr float kRoughly = 0.03f;

class Solver {
 public:
  Solver(PrepareContext& context, NodeId node, const QuadTree& in, const RadiosityOptions& options)
      : context_(context),
        node_(node),
        options_(options),
        shape_(context, node, in, options),
        patches_(in.shared_patches()),
        links_(shape_) {}

  QuadTree run(RadiosityReport& report) {
    if (shape_.empty()) return QuadTree(patches_);
    irradiance_ = sources();
    pull(irradiance_, radiosity_);
    links_.set({{shape_.root(), shape_.root()}});
    // From coarse to fine: what is bright is known before anything is resolved.
    constexpr float kCoarser[] = {8, 3, 1};
    for (const float coarser : kCoarser) {
      if (!(mean_radiosity() > 0)) return QuadTree(patches_);
      refine(coarser * options_.error * mean_);
      if (coarser == 1) drop_hidden();
      correct_sums();
      report.residual = iterate(sources(), irradiance_, coarser > 1 ? kRoughly : options_.residual, report);
      pull(irradiance_, radiosity_);
    }
    report.elements = shape_.elements.size();
    report.links = links_.size();
    for (int i = 0; i < kGathers; ++i) correct(report);
    return result();
  }

 private:
  // --- Links ----------------------------------------------------------------------------------------------------------------

  float brightness(NodeRef source, NodeRef receiver) const {
    return std::max(brightness(source), lit(receiver) ? kDarkest * mean_ : 0.0f);
  }
  float brightness(NodeRef n) const {
    return is_cluster(n) ? cluster_brightness_[cluster_index(n)] : max_component(radiosity_[n]);
  }
  bool lit(NodeRef n) const { return is_cluster(n) ? cluster_lit_[cluster_index(n)] != 0 : !is_black(irradiance_[n]); }

  Verdict judge(Link& link, float allowed, Tracer& tracer) const {
    return link.plain() ? judge_elements(link, allowed, tracer) : judge_clusters(link, allowed, tracer);
  }

  Verdict judge_elements(Link& link, float allowed, Tracer& tracer) const {
    const Element &r = shape_.elements[link.receiver], &s = shape_.elements[link.source];
    if (r.face == s.face || !shape_.receives(link.receiver)) return Verdict::drop;
    const FormFactor f = form_factor(r.flat, s.flat);
    if (!(f.mean > 0) && !(f.spread > 0)) return Verdict::drop;
    const bool divide_r = shape_.divisible(link.receiver), divide_s = shape_.divisible(link.source);
    const float b = brightness(link.source, link.receiver);
    const float distance = glm::distance(r.flat.cell.center(), s.flat.cell.center());
    const float error_r = b * f.spread;
    const float error_s = kSourceWeight * f.mean * quarter_spread(s) * std::min(1.0f, s.flat.radius / distance);
    if (error_r > allowed && divide_r && (error_r >= error_s || !divide_s)) return Verdict::divide_receiver;
    if (error_s > allowed && divide_s) return Verdict::divide_source;

    const float carried = b * f.mean;
    const std::uint32_t rays = rays_of(carried / allowed);
    if ((divide_r || divide_s) && partly_hidden(link, rays, carried / allowed, tracer))
      return divide_r && (r.flat.area >= s.flat.area || !divide_s) ? Verdict::divide_receiver : Verdict::divide_source;
    if (link.rays == 0)
      for (int c = 0; c < 4; ++c) link.factor[c] = form_factor(r.flat, child(s.flat, c)).mean;
    measure_visibility(link, rays, tracer);
    return Verdict::keep;
  }

  /// How much the radiosity varies within a quarter of the element.
  float quarter_spread(const Element& e) const {
    float spread = 0;
    for (std::uint32_t c = e.children; c < e.children + 4 && !e.leaf(); ++c) spread = std::max(spread, spread_[c]);
    return spread;
  }

  Verdict judge_clusters(Link& link, float allowed, Tracer& tracer) const {
    if (!shape_.receives(link.receiver)) return Verdict::drop;
    const Vec3 way = shape_.center(link.source) - shape_.center(link.receiver);
    const float distance = glm::length(way), radius_r = shape_.radius(link.receiver), radius_s = shape_.radius(link.source);
    if (!is_cluster(link.receiver) && glm::dot(way, shape_.elements[link.receiver].flat.normal) < -radius_s)
      return Verdict::drop;
    if (!is_cluster(link.source) && glm::dot(way, shape_.elements[link.source].flat.normal) > radius_r) return Verdict::drop;

    const float b = brightness(link.source, link.receiver);
    const float carried =
        b * std::min(1.0f, shape_.largest_projected_area(link.source) * kInvPi / std::max(sqr(distance), 1e-12f));
    const bool larger_r = radius_r >= radius_s;
    const bool overlapping = distance < std::max(radius_r, radius_s);  // there is no direction from one to the other
    const float error = carried * (overlapping ? kOverlapping : std::min(1.0f, 2 * (radius_r + radius_s) / distance));
    if (error > allowed) return divided(link, larger_r);
    if (!(carried > 0)) return Verdict::keep;
    const std::uint32_t rays = rays_of(carried / allowed);
    if (partly_hidden(link, rays, carried / allowed, tracer)) return divided(link, larger_r);
    measure_visibility(link, rays, tracer);
    return Verdict::keep;
  }

  /// Divides the receiver or the source of a link with a cluster: one of them always can be.
  Verdict divided(const Link& link, bool receiver_first) const {
    const bool can_r = is_cluster(link.receiver) || shape_.divisible(link.receiver);
    const bool can_s = is_cluster(link.source) || shape_.divisible(link.source);
    return can_r && (receiver_first || !can_s) ? Verdict::divide_receiver : Verdict::divide_source;
  }

  /// Number of rays for a link that carries so many times what it may err.
  static std::uint32_t rays_of(float importance) {
    return static_cast<std::uint32_t>(std::clamp(kRaysOfError * importance, 1.0f, static_cast<float>(kMostRays)));
  }

  /// Does the link err too much as one whose ends see each other in part?
  bool partly_hidden(const Link& link, std::uint32_t rays, float importance, Tracer& tracer) const {
    if (importance <= 2) return false;
    const float visible = visibility(link, 0, rays, tracer);
    return importance * std::sqrt(visible * (1 - visible)) > 1;
  }

  /// With other rays than those that have decided to keep the link: of all links that seem to see each other wholly, some do so
  /// by chance, and would on the average see too much.
  void measure_visibility(Link& link, std::uint32_t rays, Tracer& tracer) const {
    if (link.rays >= rays) return;
    link.visibility = visibility(link, 1, rays, tracer);
    link.rays = rays;
  }

  /// Mean radiosity of the leaf that a point lies in.
  float brightness(const Hierarchy::Place& place) const {
    std::uint32_t e = place.element;
    for (Vec2 st = place.st; !shape_.elements[e].leaf();)
      e = shape_.elements[e].children + static_cast<std::uint32_t>(descend(shape_.elements[e].domain.quad, st));
    return mean_component(radiosity_[e]);
  }

  /// Visibility by a number of rays between pairs of points, which are picked from several times as many by what they exchange:
  /// near things count more, and see more of each other; what is bright sees other things than what lies in the same shadow.
  float visibility(const Link& link, std::uint32_t series, std::uint32_t rays, Tracer& tracer) const {
    constexpr std::uint32_t kFewest = 8, kOfEach = 4, kMost = kOfEach * kMostRays;
    const std::uint32_t key = hash32(link.receiver, hash32(link.source, series));
    const PairSequence sequence(key);
    const float radius_s = shape_.radius(link.source);
    const bool plain = link.plain();
    const bool near = plain && glm::distance(shape_.center(link.receiver), shape_.center(link.source)) <
                                   kNear * (radius_s + shape_.radius(link.receiver));
    AreaLight seen;
    if (near) {
      const SurfaceCell& cell = shape_.elements[link.source].flat.cell;
      seen = AreaLight(cell.o, DVec3(cell.a), DVec3(cell.b), cell.quad);
    }
    const float softening = plain ? 0 : 0.25f * sqr(radius_s);  // else very near pairs in clusters would drown the others
    Hierarchy::Place from[kMost], to[kMost];
    float sums[kMost];
    float sum = 0;
    // In clusters many face away from each other: there are more pairs until two face each other.
    const std::uint32_t wanted = std::max(kFewest, kOfEach * rays);
    std::uint32_t pairs = 0;
    for (; pairs < (sum > 0 || plain ? wanted : kMost); ++pairs) {
      const std::uint32_t i = pairs;
      const PairOfPoints point = sequence[i];
      from[i] = shape_.place(link.receiver, point.pick.x, point.u);
      float density = 1;  // of the direction to the source, or in proportion to that of the point on it
      if (near) {
        const AreaSample s = sample_solid_angle(seen, from[i].p, std::abs(seen.height(from[i].p)), point.v);
        density = s.pdf_w;
        to[i] = shape_.place(link.source, Vec2(s.s, s.t));
      } else {
        to[i] = shape_.place(link.source, point.pick.y, point.v);
      }
      const Vec3 way = to[i].p - from[i].p;
      const float weight = plain ? std::max(kFaintest * mean_, brightness(to[i])) : 1.0f;
      const float facing_r = glm::dot(way, shape_.elements[from[i].element].flat.normal),
                  facing_s = -glm::dot(way, shape_.elements[to[i].element].flat.normal), distance2 = glm::dot(way, way);
      if (facing_r > 0 && facing_s > 0 && density > 0)
        sum += weight * (near ? facing_r / (std::sqrt(distance2) * density)
                              : facing_r * facing_s / (distance2 * (distance2 + softening)));
      sums[i] = sum;
    }
    if (!(sum > 0)) return 0;
    std::uint32_t visible = 0, last = kMost;
    bool last_visible = false;
    for (std::uint32_t j = 0; j < rays; ++j) {
      const float target = sum * (static_cast<float>(j) + 0.5f) / static_cast<float>(rays);
      const auto i = std::min(static_cast<std::uint32_t>(std::upper_bound(sums, sums + pairs, target) - sums), pairs - 1);
      if (i != last)
        last_visible = !tracer.occluded(spawn_ray_to(shape_.locate(from[i]), shape_.locate(to[i])), hash32(key, i), node_);
      last = i;
      visible += last_visible ? 1 : 0;
    }
    return static_cast<float>(visible) / static_cast<float>(rays);
  }

  /// Replaces links that may err by more than `allowed` [W/m^2].
  void refine(float allowed) {
    find_spreads();
    summarise_clusters();
    const std::size_t known = shape_.elements.size();
    const std::size_t limit = available_memory_bytes() / 3 / (4 * sizeof(Link));
    std::vector<Link> open = links_.take(), kept;
    std::vector<Verdict> verdicts;
    while (!open.empty()) {
      verdicts.resize(open.size());
      context_.for_chunks(open.size(), 256, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
        tracer.enter(node_);
        for (std::size_t i = begin; i < end; ++i) verdicts[i] = judge(open[i], allowed, tracer);
      });
      std::vector<Link> next;
      for (std::size_t i = 0; i < open.size(); ++i) {
        const Link& link = open[i];
        if (verdicts[i] == Verdict::keep) kept.push_back(link);
        if (verdicts[i] == Verdict::divide_receiver)
          for_children(link.receiver, [&](NodeRef child) { next.push_back({child, link.source}); });
        if (verdicts[i] == Verdict::divide_source)
          for_children(link.source, [&](NodeRef child) { next.push_back({link.receiver, child}); });
      }
      if (kept.size() + next.size() > limit)
        throw Error("radiosity needs more than " + std::to_string(limit) +
                    " links between surfaces, a third of the free memory; raise its parameter 'error'");
      open = std::move(next);
    }
    links_.set(std::move(kept));
    shape_.measure_albedo(known);
    pull(irradiance_, radiosity_);
  }

  /// Links of few rays stay, as those that seem visible by chance do: rays are cast for them again at the end.
  void drop_hidden() {
    std::vector<Link> links = links_.take();
    std::erase_if(links, [](const Link& link) { return link.visibility == 0 && link.rays >= kRaysOfHidden; });
    links_.set(std::move(links));
  }

  template <class Use>
  void for_children(NodeRef n, Use&& use) {
    if (is_cluster(n)) {
      use(shape_.clusters[cluster_index(n)].child[0]);
      use(shape_.clusters[cluster_index(n)].child[1]);
      return;
    }
    if (shape_.elements[n].leaf()) {
      shape_.divide(n);
      const std::size_t count = shape_.elements.size();
      radiosity_.resize(count, radiosity_[n]);
      irradiance_.resize(count, irradiance_[n]);
      spread_.resize(count, 0.0f);
    }
    for (std::uint32_t c = 0; c < 4; ++c) use(shape_.elements[n].children + c);
  }

  /// Mean brightness and whether any light arrives, by cluster.
  void summarise_clusters() {
    cluster_brightness_.assign(shape_.clusters.size(), 0);
    cluster_lit_.assign(shape_.clusters.size(), 0);
    for (std::size_t i = shape_.clusters.size(); i-- > 0;) {
      const Cluster& c = shape_.clusters[i];
      float sum = 0;
      for (const NodeRef child : c.child) {
        sum += shape_.area(child) * brightness(child);
        if (lit(child)) cluster_lit_[i] = 1;
      }
      cluster_brightness_[i] = sum / c.area;
    }
  }

  // --- Solution -------------------------------------------------------------------------------------------------------------

  /// Irradiance on the leaves before any transport.
  std::vector<Color> sources() const {
    std::vector<Color> irradiance(shape_.elements.size(), Color(0));
    for (std::size_t i = 0; i < irradiance.size(); ++i)
      if (shape_.elements[i].leaf()) irradiance[i] = shape_.elements[i].source;
    return irradiance;
  }

  /// Radiosity of the leaves from their irradiance; means of both for all others.
  void pull(std::vector<Color>& irradiance, std::vector<Color>& radiosity) const {
    const std::size_t count = shape_.elements.size();
    radiosity.resize(count);
    for (std::size_t i = count; i-- > 0;) {
      const Element& e = shape_.elements[i];
      if (e.leaf()) {
        radiosity[i] = e.albedo * irradiance[i];
        continue;
      }
      radiosity[i] = irradiance[i] = Color(0);
      for (std::uint32_t c = e.children; c < e.children + 4; ++c) {
        radiosity[i] += 0.25f * radiosity[c];
        irradiance[i] += 0.25f * irradiance[c];
      }
    }
  }

  void find_spreads() {
    spread_.assign(shape_.elements.size(), 0.0f);
    for (std::size_t i = spread_.size(); i-- > 0;) {
      const Element& e = shape_.elements[i];
      for (std::uint32_t c = e.children; c < e.children + 4 && !e.leaf(); ++c)
        spread_[i] = std::max(spread_[i], max_component(glm::abs(radiosity_[c] - radiosity_[i])) + spread_[c]);
    }
  }

  /// Area mean of the radiosity, of its brightest channel.
  float mean_radiosity() {
    double sum = 0, whole = 0;
    for (std::size_t i = 0; i < shape_.faces.size(); ++i) {
      const auto a = static_cast<double>(shape_.elements[i].flat.area);
      sum += a * static_cast<double>(max_component(radiosity_[i]));
      whole += a;
    }
    mean_ = static_cast<float>(sum / whole);
    return mean_;
  }

  /// Form factors of a cell add up to 1 where its face sees nothing but surfaces, and nowhere to more.
  void correct_sums() {
    correction_.clear();
    const std::vector<Color> sums = links_.transport(context_.workers(), std::vector<Color>(shape_.elements.size(), Color(1)));
    for (const Color& sum : sums) correction_.push_back(correction(static_cast<std::uint32_t>(correction_.size()), sum.x));
  }
  float correction(std::uint32_t element, float sum) const {
    if (!(sum > 0)) return 1;
    const bool closed = shape_.faces[shape_.elements[element].face].enclosed;
    return std::clamp(1 / sum, 1 / kLargestCorrection, closed ? kLargestCorrection : 1.0f);
  }

  /// Jacobi iteration of E = added + K rho E for the leaves, K by links, until what is still to come is less than `residual` of
  /// what transport has brought; returns about which share that is.
  double iterate(const std::vector<Color>& added, std::vector<Color>& irradiance, float residual,
                 RadiosityReport& report) const {
    std::vector<Color> radiosity;
    double before = 0, to_come = 0;
    for (std::int64_t i = 0; i < options_.iterations; ++i) {
      pull(irradiance, radiosity);
      std::vector<Color> next = links_.transport(context_.workers(), radiosity);
      double change = 0, size = 0;
      for (std::size_t k = 0; k < next.size(); ++k) {
        const Element& e = shape_.elements[k];
        if (!e.leaf()) continue;
        next[k] *= shape_.faces[e.face].receives ? correction_[k] : 0.0f;
        size += absolute_flux(e, next[k]);
        next[k] += added[k];
        change += absolute_flux(e, next[k] - irradiance[k]);
      }
      irradiance = std::move(next);
      // Changes fall like a geometric series.
      const double ratio = before > 0 ? std::min(change / before, 0.999) : 0.9;
      before = change;
      ++report.iterations;
      to_come = size > 0 ? change / size * ratio / (1 - ratio) : 0;
      if (to_come <= static_cast<double>(residual)) break;
    }
    return to_come;
  }
  static double absolute_flux(const Element& e, const Color& irradiance) {
    const Color size = glm::abs(irradiance);
    return static_cast<double>(e.flat.area) * static_cast<double>(size.x + size.y + size.z);
  }

  // --- Gathering ------------------------------------------------------------------------------------------------------------

  /// Deferred correction: gathers once more, at points, and lets links transport only what that has changed. A link is wrong
  /// in the same way all over its receiver; so are its errors' errors, but they are small.
  void correct(RadiosityReport& report) {
    std::vector<Color> change = gather_at_leaves();
    const double size = total(change);
    for (std::size_t i = 0; i < change.size(); ++i)
      change[i] = shape_.elements[i].leaf() ? change[i] + shape_.elements[i].source - irradiance_[i] : Color(0);
    const std::vector<Color> added = change;
    iterate(added, change, kRoughly, report);
    report.correction = size > 0 ? total(change) / size : 0;
    for (std::size_t i = 0; i < change.size(); ++i)
      irradiance_[i] = glm::max(irradiance_[i] + change[i], shape_.elements[i].source);
    pull(irradiance_, radiosity_);
  }
  /// Flux on the leaves, without regard to signs.
  double total(const std::vector<Color>& irradiance) const {
    double sum = 0;
    for (std::size_t i = 0; i < irradiance.size(); ++i)
      if (shape_.elements[i].leaf()) sum += absolute_flux(shape_.elements[i], irradiance[i]);
    return sum;
  }

  /// Irradiance in the middle of each leaf that `radiosity_` makes, with form factors of and rays from that point; on large
  /// leaves the mean of several points.
  std::vector<Color> gather_at_leaves() {
    find_spreads();
    const Shine shine(shape_, context_.workers(), radiosity_);
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
          const Hierarchy::Place place =
              points == 1 ? shape_.middle(number) : shape_.place(number, 0, sobol_point(number, 0, k));
          const Gathered all = gather(Receiver(shape_, place), flows, sums, tracer);
          mean.E += all.E / static_cast<float>(points);
          mean.sum += all.sum / static_cast<float>(points);
        }
        found[i] = correction(number, mean.sum) * mean.E;
      }
    });
    return found;
  }

  /// The middle of a cell says enough of it, but what stands before a large one may hide things from just there.
  static std::uint32_t points_in(const Element& element) {
    return static_cast<std::uint32_t>(std::clamp(sqr(element.flat.radius / kSmall), 1.0f, 16.0f));
  }

  struct Gathered {
    Color E{0};
    float sum = 0;  // of form factors
  };

  struct Receiver {
    Receiver(const Hierarchy& shape, const Hierarchy::Place& place)
        : element(place.element), p(place.p), n(shape.elements[place.element].flat.normal), at(shape.locate(place)) {}
    std::uint32_t element;
    Vec3 p, n;
    SurfacePosition at;
  };

  /// What the links of a leaf, and of all that it is a part of, bring to a point of it.
  Gathered gather(const Receiver& receiver, const std::vector<Flow>& flows, const std::vector<float>& sums,
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
  void add_unoccluded(std::uint32_t element, const Receiver& receiver, Gathered& g) const {
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
    g.E += f * radiosity_[element];
    g.sum += f;
  }

  /// The same of a link to or from a cluster, which brings `flow`, `sum` of form factors, to the center of its receiver.
  Gathered unoccluded(const Link& link, const Flow& flow, float sum, const Receiver& receiver) const {
    const Vec3 source = shape_.center(link.source), way = source - receiver.p;
    const float facing = glm::dot(receiver.n, way), distance2 = glm::dot(way, way);
    if (!(facing > 0)) return {};
    const float least = sqr(shape_.radius(link.source)), far = glm::distance(source, shape_.center(link.receiver));
    const float f = facing / std::sqrt(distance2) * std::max(sqr(far), least) / std::max(distance2, least);
    return {f * flow.flow, f * sum};
  }

  /// Takes off what is hidden. In the mean over rays to points that are picked by what they bring, or, for the sum of form
  /// factors of a source that does not shine evenly, to any.
  void occlude(Gathered& g, const Link& link, const Receiver& receiver, Tracer& tracer) const {
    if (!(g.sum > 0)) return;
    const float importance = brightness(link.source, link.receiver) * g.sum / (options_.error * mean_);
    if (!link.plain() && kRaysOfError * importance < 1) return occlude_at_random(g, link, receiver, importance, tracer);
    const std::uint32_t rays = rays_of(importance);
    const float visible = visible_share(link, receiver, rays, true, tracer);
    const bool even = is_cluster(link.source) || spread_[link.source] <= kEven * max_component(radiosity_[link.source]);
    const bool closed = shape_.faces[shape_.elements[receiver.element].face].enclosed;
    g.E *= visible;
    g.sum *= even || !closed ? visible : visible_share(link, receiver, rays, false, tracer);
  }

  /// The same for a link that would deserve a part of a ray: some get a whole one, which then counts for others, too; they all
  /// start from what the link is known to see.
  void occlude_at_random(Gathered& g, const Link& link, const Receiver& receiver, float importance, Tracer& tracer) const {
    const float chance = kRaysOfError * importance;
    float visible = link.visibility;
    if (to_unit_float(hash32(receiver.element, hash32(link.receiver, link.source))) < chance)
      visible += (visible_share(link, receiver, 1, true, tracer) - visible) / chance;
    g.E *= visible;
    g.sum *= visible;
  }

  float visible_share(const Link& link, const Receiver& receiver, std::uint32_t rays, bool bright, Tracer& tracer) const {
    constexpr std::uint32_t kTries = 4;  // to find a point that faces the receiver
    const std::uint32_t key = hash32(receiver.element, hash32(link.source, bright ? 2 : 3));
    const PairSequence sequence(key);
    std::uint32_t visible = 0;
    for (std::uint32_t r = 0; r < rays; ++r) {
      Hierarchy::Place place{};
      for (std::uint32_t i = kTries * r; i < kTries * (r + 1); ++i) {
        const PairOfPoints random = sequence[i];
        place =
            bright ? bright_place(link.source, random.pick.x, random.u) : shape_.place(link.source, random.pick.x, random.u);
        const Vec3 way = place.p - receiver.p;
        if (glm::dot(way, receiver.n) > 0 && glm::dot(way, shape_.elements[place.element].flat.normal) < 0) break;
      }
      if (!tracer.occluded(spawn_ray_to(receiver.at, shape_.locate(place)), hash32(key, r), node_)) ++visible;
    }
    return static_cast<float>(visible) / static_cast<float>(rays);
  }

  /// A point of a leaf below an element, picked by its radiosity; of a cluster any.
  Hierarchy::Place bright_place(NodeRef n, float pick, const Vec2& u) const {
    while (!is_cluster(n) && !shape_.elements[n].leaf()) {
      const std::uint32_t first = shape_.elements[n].children;
      float up_to[4], sum = 0;
      for (std::uint32_t c = 0; c < 4; ++c) up_to[c] = sum += mean_component(radiosity_[first + c]);
      if (!(sum > 0)) break;
      std::uint32_t c = 0;
      while (c < 3 && pick * sum >= up_to[c]) ++c;
      const float below = c > 0 ? up_to[c - 1] : 0;
      pick = std::min((pick * sum - below) / (up_to[c] - below), kOneMinusEpsilon);
      n = first + c;
    }
    return shape_.place(n, pick, u);
  }

  QuadTree result() const {
    const Scene& scene = context_.scene();
    QuadTree tree(patches_);
    std::vector<Color> scattered = irradiance_, radiosity;
    for (std::size_t i = 0; i < scattered.size(); ++i) scattered[i] -= shape_.elements[i].source;
    pull(scattered, radiosity);
    for (std::uint32_t i = 0; i < shape_.faces.size(); ++i) {
      const Face& face = shape_.faces[i];
      const bool wanted = options_.to(scene.part_tags(patches_->part(face.id / 2)));
      if (!face.receives || !wanted) continue;
      std::vector<QuadTreeNode> nodes{{scattered[i]}};
      std::vector<std::uint32_t> from{i};
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const Element& e = shape_.elements[from[k]];
        if (e.leaf()) continue;
        nodes[k].children = static_cast<std::uint32_t>(nodes.size());
        for (std::uint32_t c = e.children; c < e.children + 4; ++c) {
          nodes.push_back({scattered[c]});
          from.push_back(c);
        }
      }
      tree.set(face.id, std::move(nodes));
    }
    tree.compress(0.25f * options_.error);
    return tree;
  }

  PrepareContext& context_;
  NodeId node_;
  RadiosityOptions options_;
  Hierarchy shape_;
  std::shared_ptr<const Patches> patches_;

  Links links_;
  std::vector<Color> radiosity_, irradiance_;  // by element; irradiance: all of it, that of the input too
  std::vector<float> correction_;              // by element, of what links bring
  std::vector<float> spread_;                  // by element: how much its leaves' radiosity differs from its own
  std::vector<float> cluster_brightness_;
  std::vector<std::uint8_t> cluster_lit_;
  float mean_ = 0;  // radiosity
};

}  // namespace

}  // namespace radiosity

QuadTree solve_radiosity(PrepareContext& context, NodeId node, const QuadTree& in, const RadiosityOptions& options,
                         RadiosityReport* report) {
  if (in.empty()) return in;
  RadiosityReport unused;
  return radiosity::Solver(context, node, in, options).run(report ? *report : unused);
}

}  // namespace ln
