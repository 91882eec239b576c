#include "ln/radiosity.hpp"

#include <algorithm>
#include <glm/common.hpp>

#include "ln/emitter_shapes.hpp"
#include "ln/error.hpp"
#include "ln/stats.hpp"
#include "radiosity_gatherer.hpp"
#include "radiosity_visibility.hpp"

namespace ln {

namespace radiosity {

namespace {

enum class Verdict : std::uint8_t { drop, keep, divide_receiver, divide_source };

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
/// Rays of a link that carries as much as it may err, in judging links.
constexpr float kRaysOfError = 4;
/// And in each of the gathers at leaves: they leave a few percent of the error that was there before, and the noise of the
/// last.
constexpr float kRaysInGathers[] = {1, 8};
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
        links_(shape_),
        light_(shape_) {}

  QuadTree run(RadiosityReport& report) {
    if (shape_.empty()) return QuadTree(patches_);
    light_.irradiance = sources();
    light_.pull();
    links_.set({{shape_.root(), shape_.root()}});
    // From coarse to fine: what is bright is known before anything is resolved.
    constexpr float kCoarser[] = {8, 3, 1};
    for (const float coarser : kCoarser) {
      if (!(light_.find_mean() > 0)) return QuadTree(patches_);
      refine(coarser * options_.error * light_.mean);
      if (coarser == 1) drop_hidden();
      correct_sums();
      report.residual = iterate(sources(), light_.irradiance, coarser > 1 ? kRoughly : options_.residual, report);
      light_.pull();
    }
    report.elements = shape_.elements.size();
    report.links = links_.size();
    for (const float rays : kRaysInGathers) correct(rays, report);
    return result();
  }

 private:
  // --- Links ----------------------------------------------------------------------------------------------------------------

  Verdict judge(Link& link, float allowed, Tracer& tracer) const {
    return link.plain() ? judge_elements(link, allowed, tracer) : judge_clusters(link, allowed, tracer);
  }

  Verdict judge_elements(Link& link, float allowed, Tracer& tracer) const {
    const Element &r = shape_.elements[link.receiver], &s = shape_.elements[link.source];
    if (r.face == s.face || !shape_.receives(link.receiver)) return Verdict::drop;
    const FormFactor f = form_factor(r.flat, s.flat);
    if (!(f.mean > 0) && !(f.spread > 0)) return Verdict::drop;
    const bool divide_r = shape_.divisible(link.receiver), divide_s = shape_.divisible(link.source);
    const float b = light_.brightness(link.source, link.receiver);
    const float distance = glm::distance(r.flat.cell.center(), s.flat.cell.center());
    const float error_r = b * f.spread;
    const float error_s = kSourceWeight * f.mean * quarter_spread(s) * std::min(1.0f, s.flat.radius / distance);
    if (error_r > allowed && divide_r && (error_r >= error_s || !divide_s)) return Verdict::divide_receiver;
    if (error_s > allowed && divide_s) return Verdict::divide_source;

    const float carried = b * f.mean;
    const std::uint32_t rays = rays_of(carried / allowed, kRaysOfError);
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
    for (std::uint32_t c = e.children; c < e.children + 4 && !e.leaf(); ++c) spread = std::max(spread, light_.spread[c]);
    return spread;
  }

  Verdict judge_clusters(Link& link, float allowed, Tracer& tracer) const {
    if (!shape_.receives(link.receiver)) return Verdict::drop;
    const Vec3 way = shape_.center(link.source) - shape_.center(link.receiver);
    const float distance = glm::length(way), radius_r = shape_.radius(link.receiver), radius_s = shape_.radius(link.source);
    if (!is_cluster(link.receiver) && glm::dot(way, shape_.elements[link.receiver].flat.normal) < -radius_s)
      return Verdict::drop;
    if (!is_cluster(link.source) && glm::dot(way, shape_.elements[link.source].flat.normal) > radius_r) return Verdict::drop;

    const float b = light_.brightness(link.source, link.receiver);
    const float carried =
        b * std::min(1.0f, shape_.largest_projected_area(link.source) * kInvPi / std::max(sqr(distance), 1e-12f));
    const bool larger_r = radius_r >= radius_s;
    const bool overlapping = distance < std::max(radius_r, radius_s);  // there is no direction from one to the other
    const float error = carried * (overlapping ? kOverlapping : std::min(1.0f, 2 * (radius_r + radius_s) / distance));
    if (error > allowed) return divided(link, larger_r);
    if (!(carried > 0)) return Verdict::keep;
    const std::uint32_t rays = rays_of(carried / allowed, kRaysOfError);
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

  /// Visibility by a number of rays.
  float visibility(const Link& link, std::uint32_t series, std::uint32_t rays, Tracer& tracer) const {
    const std::uint32_t key = hash32(link.receiver, hash32(link.source, series));
    const PairSequence sequence(key);
    const bool plain = link.plain();
    const bool near = plain && glm::distance(shape_.center(link.receiver), shape_.center(link.source)) <
                                   kNear * (shape_.radius(link.source) + shape_.radius(link.receiver));
    AreaLight seen;
    if (near) {
      const SurfaceCell& cell = shape_.elements[link.source].flat.cell;
      seen = AreaLight(cell.o, DVec3(cell.a), DVec3(cell.b), cell.quad);
    }
    const float softening = plain ? 0 : softening_of(shape_.radius(link.source));
    Hierarchy::Place from[Candidates::kMost], to[Candidates::kMost];
    // In clusters many points face away from each other.
    const std::uint32_t wanted = std::max(8u, 4 * rays);
    Candidates candidates(rays, wanted, plain ? wanted : Candidates::kMost);
    while (!candidates.enough()) {
      const std::uint32_t i = candidates.count();
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
      const float weight = plain ? std::max(kFaintest * light_.mean, light_.brightness(to[i])) : 1.0f;
      const Vec3& n = shape_.elements[from[i].element].flat.normal;
      const Vec3& source_n = shape_.elements[to[i].element].flat.normal;
      candidates.add(weight *
                     (near ? exchange_by_direction(way, n, source_n, density) : exchange(way, n, source_n, softening)));
    }
    return candidates.visible_share([&](std::uint32_t i) {
      return !tracer.occluded(spawn_ray_to(shape_.locate(from[i]), shape_.locate(to[i])), hash32(key, i), node_);
    });
  }

  /// Replaces links that may err by more than `allowed` [W/m^2].
  void refine(float allowed) {
    light_.find_spreads();
    light_.summarise_clusters();
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
    shape_.measure_leaves(known);
    light_.pull();
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
      light_.add_children_of(n);
    }
    for (std::uint32_t c = 0; c < 4; ++c) use(shape_.elements[n].children + c);
  }

  // --- Solution -------------------------------------------------------------------------------------------------------------

  /// Irradiance on the leaves before any transport.
  std::vector<Color> sources() const {
    std::vector<Color> irradiance(shape_.elements.size(), Color(0));
    for (std::size_t i = 0; i < irradiance.size(); ++i)
      if (shape_.elements[i].leaf()) irradiance[i] = shape_.elements[i].source;
    return irradiance;
  }

  void correct_sums() {
    correction_.clear();
    const std::vector<Color> sums = links_.transport(context_.workers(), shape_.uniform_shine());
    for (const Color& sum : sums)
      correction_.push_back(sum_correction(shape_, static_cast<std::uint32_t>(correction_.size()), sum.x));
  }

  /// Jacobi iteration of E = added + K rho E for the leaves, K by links, until what is still to come is less than `residual` of
  /// what transport has brought; returns about which share that is.
  double iterate(const std::vector<Color>& added, std::vector<Color>& irradiance, float residual,
                 RadiosityReport& report) const {
    std::vector<Color> radiosity;
    double before = 0, to_come = 0;
    for (std::int64_t i = 0; i < options_.iterations; ++i) {
      light_.pull(irradiance, radiosity);
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

  /// Deferred correction: gathers once more, at points, and lets links transport only what that has changed. A link is wrong
  /// in the same way all over its receiver; so are its errors' errors, but they are small.
  void correct(float rays_of_error, RadiosityReport& report) {
    light_.find_spreads();
    std::vector<Color> change =
        Gatherer(context_, node_, shape_, links_, light_, options_.error * light_.mean, rays_of_error).at_leaves();
    const double size = total(change);
    for (std::size_t i = 0; i < change.size(); ++i)
      change[i] = shape_.elements[i].leaf() ? change[i] + shape_.elements[i].source - light_.irradiance[i] : Color(0);
    const std::vector<Color> added = change;
    iterate(added, change, kRoughly, report);
    report.correction = size > 0 ? total(change) / size : 0;
    for (std::size_t i = 0; i < change.size(); ++i)
      light_.irradiance[i] = glm::max(light_.irradiance[i] + change[i], shape_.elements[i].source);
    light_.pull();
  }
  /// Flux on the leaves, without regard to signs.
  double total(const std::vector<Color>& irradiance) const {
    double sum = 0;
    for (std::size_t i = 0; i < irradiance.size(); ++i)
      if (shape_.elements[i].leaf()) sum += absolute_flux(shape_.elements[i], irradiance[i]);
    return sum;
  }

  QuadTree result() const {
    const Scene& scene = context_.scene();
    QuadTree tree(patches_);
    std::vector<Color> scattered = light_.irradiance, radiosity;
    for (std::size_t i = 0; i < scattered.size(); ++i) scattered[i] -= shape_.elements[i].source;
    light_.pull(scattered, radiosity);
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
  Light light_;
  std::vector<float> correction_;  // by element, of what links bring
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
