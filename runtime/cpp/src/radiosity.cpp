#include "ln/radiosity.hpp"

#include <algorithm>
#include <glm/common.hpp>

#include "ln/emitter_shapes.hpp"
#include "ln/error.hpp"
#include "ln/stats.hpp"
#include "radiosity_hierarchy.hpp"

namespace ln {

namespace radiosity {

namespace {

/// Light goes from `source` to `receiver`. Between elements as radiosity * factor * visibility of each quarter of the source,
/// the same all over the receiver; with a cluster, faces count with their own normals as if each were at the cluster's center.
struct Link {
  NodeRef receiver, source;
  float factor[4] = {};  // form factors of the source's quarters without occlusion, between elements
  float visibility = 0;
  std::uint32_t rays = 0;  // that have been cast for the visibility

  bool plain() const { return !is_cluster(receiver) && !is_cluster(source); }
};

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
/// Cells that are nearer to each other, in sums of their radii, look at each other by solid angle.
constexpr float kNear = 3;
/// How much the sums of form factors of a face are off by themselves, as a share.
constexpr float kErrorOfSums = 0.03f;
/// Sums of form factors are corrected by no more than this.
constexpr float kLargestCorrection = 1.5f;

class Solver {
 public:
  Solver(PrepareContext& context, NodeId node, const QuadTree& in, const RadiosityOptions& options)
      : context_(context), node_(node), options_(options), shape_(context, node, in, options), patches_(in.shared_patches()) {}

  QuadTree run(RadiosityReport& report) {
    if (shape_.empty()) return QuadTree(patches_);
    irradiance_.assign(shape_.elements.size(), Color(0));
    correction_.assign(shape_.elements.size(), 1.0f);
    pull();
    links_.push_back({shape_.root(), shape_.root()});
    // From coarse to fine: what is bright is known before anything is resolved.
    constexpr float kCoarser[] = {8, 3, 1};
    for (const float coarser : kCoarser) {
      refine(coarser * options_.error * mean_radiosity());
      correct_sums(report);
      iterate(coarser > 1 ? 0.03f : options_.residual, report);
    }
    report.elements = shape_.elements.size();
    report.links = links_.size();
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
  bool lit(NodeRef n) const {
    return is_cluster(n) ? cluster_lit_[cluster_index(n)] != 0 : !is_black(irradiance_[n] + shape_.elements[n].source);
  }

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
    // What will not be measured again may go. Other links stay, as those that seem visible by chance do.
    const bool hidden = link.visibility == 0 && link.rays >= rays_of(carried / (options_.error * mean_));
    return hidden ? Verdict::drop : Verdict::keep;
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
    const float source_area =
        is_cluster(link.source) ? shape_.clusters[cluster_index(link.source)].area : shape_.elements[link.source].flat.area;
    const float carried = b * std::min(1.0f, source_area * kInvPi / std::max(sqr(distance), 1e-12f));
    const float error = carried * std::min(1.0f, 2 * (radius_r + radius_s) / std::max(distance, 1e-6f));
    const bool larger_r = radius_r >= radius_s;
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

  /// Visibility by a number of rays between pairs of points, which are picked from several times as many by what they exchange:
  /// near things count more, and see more of each other.
  float visibility(const Link& link, std::uint32_t series, std::uint32_t rays, Tracer& tracer) const {
    constexpr std::uint32_t kFewest = 8, kOfEach = 4, kMost = kOfEach * kMostRays;
    const std::uint32_t key = hash32(link.receiver, hash32(link.source, series));
    const float radius_s = shape_.radius(link.source);
    const bool plain = link.plain();
    const bool near = plain && glm::distance(shape_.center(link.receiver), shape_.center(link.source)) <
                                   kNear * (radius_s + shape_.radius(link.receiver));
    AreaLight seen;
    if (near) {
      const SurfaceCell& cell = shape_.elements[link.source].flat.cell;
      seen = AreaLight(cell.o, DVec3(cell.a), DVec3(cell.b), cell.quad);
    }
    // In clusters many face away from each other, and very near pairs would drown the others.
    const std::uint32_t pairs = plain ? std::max(kFewest, kOfEach * rays) : kMost;
    const float softening = plain ? 0 : 0.25f * sqr(radius_s);
    Hierarchy::Point from[kMost], to[kMost];
    float sums[kMost];
    float sum = 0;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      const Vec2 pick = plain ? Vec2(0) : sobol_point(key, 0, i), u = sobol_point(key, 2, i);
      from[i] = shape_.point(link.receiver, pick.x, sobol_point(key, 1, i));
      float density = 1;  // of the direction to the source, or in proportion to that of the point on it
      if (near) {
        const AreaSample s = sample_solid_angle(seen, from[i].at.p, std::abs(seen.height(from[i].at.p)), u);
        density = s.pdf_w;
        to[i] = shape_.point(link.source, Vec2(s.s, s.t));
      } else {
        to[i] = shape_.point(link.source, pick.y, u);
      }
      const Vec3 way = to[i].at.p - from[i].at.p;
      const float facing_r = glm::dot(way, from[i].normal), facing_s = -glm::dot(way, to[i].normal),
                  distance2 = glm::dot(way, way);
      if (facing_r > 0 && facing_s > 0 && density > 0)
        sum += near ? facing_r / (std::sqrt(distance2) * density) : facing_r * facing_s / (distance2 * (distance2 + softening));
      sums[i] = sum;
    }
    if (!(sum > 0)) return 0;
    std::uint32_t visible = 0, last = kMost;
    bool last_visible = false;
    for (std::uint32_t j = 0; j < rays; ++j) {
      const float target = sum * (static_cast<float>(j) + 0.5f) / static_cast<float>(rays);
      const auto i = std::min(static_cast<std::uint32_t>(std::upper_bound(sums, sums + pairs, target) - sums), pairs - 1);
      if (i != last) last_visible = !tracer.occluded(spawn_ray_to(from[i].at, to[i].at), hash32(key, i), node_);
      last = i;
      visible += last_visible ? 1 : 0;
    }
    return static_cast<float>(visible) / static_cast<float>(rays);
  }

  /// Replaces links that may err by more than `allowed` [W/m^2].
  void refine(float allowed) {
    summarise_clusters();
    const std::size_t known = shape_.elements.size();
    const std::size_t limit = available_memory_bytes() / 3 / (4 * sizeof(Link));
    std::vector<Link> open = std::move(links_), kept;
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
    links_ = std::move(kept);
    shape_.measure_albedo(known);
    std::sort(links_.begin(), links_.end(), [](const Link& x, const Link& y) {
      return x.receiver != y.receiver ? x.receiver < y.receiver : x.source < y.source;
    });
    index_links();
    pull();
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
      correction_.resize(count, correction_[n]);
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
        const float size = is_cluster(child) ? shape_.clusters[cluster_index(child)].area : shape_.elements[child].flat.area;
        sum += size * brightness(child);
        if (lit(child)) cluster_lit_[i] = 1;
      }
      cluster_brightness_[i] = sum / c.area;
    }
  }

  /// Where the links of each element and cluster begin; those with clusters are numbered, too.
  void index_links() {
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

  // --- Transport ------------------------------------------------------------------------------------------------------------

  /// Irradiance that a face with the normal n gets over a link with a cluster: flow * max(0, dot(n, towards)).
  struct Flow {
    Vec3 towards;  // the source
    Color flow;
  };
  Flow flow(const Link& link, const std::vector<Color>& radiosity) const {
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
    return {towards, sum * (link.visibility * kInvPi / std::max(distance2, sqr(shape_.radius(link.source))))};
  }

  /// What a link between elements brings without occlusion.
  Color gathered(const Link& link, const std::vector<Color>& radiosity) const {
    const Element& source = shape_.elements[link.source];
    const float* f = link.factor;
    if (source.leaf()) return (f[0] + f[1] + f[2] + f[3]) * radiosity[link.source];
    const Color* quarter = &radiosity[source.children];
    return f[0] * quarter[0] + f[1] * quarter[1] + f[2] * quarter[2] + f[3] * quarter[3];
  }

  /// Irradiance on each element that `radiosity` makes, without corrections.
  std::vector<Color> transport(const std::vector<Color>& radiosity) const {
    // Links with clusters on their receiving side: once each, then by every face below.
    const std::size_t base = first_of_cluster_[0];
    std::vector<Flow> flows(links_.size() - base);
    context_.workers().parallel_for(flows.size(), 64, [&](std::size_t i) { flows[i] = flow(links_[base + i], radiosity); });
    std::vector<Color> arriving(shape_.elements.size(), Color(0));
    context_.workers().parallel_for(shape_.elements.size(), 256, [&](std::size_t i) {
      const Element& element = shape_.elements[i];
      const Vec3 n = element.flat.normal;
      Color sum(0);
      for (std::size_t l = first_of_element_[i]; l < first_of_element_[i + 1]; ++l) {
        const Link& link = links_[l];
        if (link.plain()) {
          sum += link.visibility * gathered(link, radiosity);
        } else {
          const Flow f = flow(link, radiosity);
          sum += std::max(0.0f, glm::dot(n, f.towards)) * f.flow;
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

  /// Radiosity of leaves from their irradiance, means and spreads of the others.
  void pull() {
    const std::size_t count = shape_.elements.size();
    radiosity_.resize(count);
    spread_.assign(count, 0.0f);
    for (std::size_t i = count; i-- > 0;) {
      const Element& e = shape_.elements[i];
      if (e.leaf()) {
        radiosity_[i] = e.albedo * (e.source + irradiance_[i]);
        continue;
      }
      radiosity_[i] = irradiance_[i] = Color(0);
      for (std::uint32_t c = e.children; c < e.children + 4; ++c) {
        radiosity_[i] += 0.25f * radiosity_[c];
        irradiance_[i] += 0.25f * irradiance_[c];
      }
      for (std::uint32_t c = e.children; c < e.children + 4; ++c) {
        const Color d = glm::abs(radiosity_[c] - radiosity_[i]);
        spread_[i] = std::max(spread_[i], max_component(d) + spread_[c]);
      }
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

  /// Form factors of a cell add up to the share of surfaces in what it sees. Where that is 1, each cell is corrected to it;
  /// elsewhere only whole faces are, to what rays from them have found, as far as that is known better than the sums.
  void correct_sums(RadiosityReport& report) {
    std::vector<Color> sums = transport(std::vector<Color>(shape_.elements.size(), Color(1)));
    double off = 0, whole = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const auto e = static_cast<NodeRef>(i);
      const float sum = sums[i].x;
      correction_[i] = sum > 0 ? std::clamp(1 / sum, 1 / kLargestCorrection, kLargestCorrection) : 1.0f;
      if (!shape_.elements[i].leaf() || !face_of(e).enclosed() || !lit(e) || !shape_.receives(e)) continue;
      const auto a = static_cast<double>(shape_.elements[i].flat.area);
      off += a * std::abs(1 - static_cast<double>(sum));
      whole += a;
    }
    report.mean_correction = whole > 0 ? off / whole : 0;

    // From leaves to faces. The mean of all open faces is known best.
    for (std::size_t i = sums.size(); i-- > 0;) {
      const Element& e = shape_.elements[i];
      if (!e.leaf()) sums[i] = 0.25f * (sums[e.children] + sums[e.children + 1] + sums[e.children + 2] + sums[e.children + 3]);
    }
    double found = 0, seen = 0;
    for (std::size_t i = 0; i < shape_.faces.size(); ++i) {
      const Face& face = shape_.faces[i];
      if (face.enclosed() || !face.receives) continue;
      const auto a = static_cast<double>(shape_.elements[i].flat.area);
      found += a * static_cast<double>(sums[i].x);
      seen += a * static_cast<double>(face.seen());
    }
    const float all = found > 0 ? static_cast<float>(seen / found) : 1.0f;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const Face& face = face_of(static_cast<NodeRef>(i));
      if (face.enclosed()) continue;
      const float sum = sums[shape_.elements[i].face].x,
                  variance = (1 - face.seen()) / std::max(1.0f, static_cast<float>(face.hits));
      const float trust = sqr(kErrorOfSums) / (sqr(kErrorOfSums) + variance);
      const float own = sum > 0 ? face.seen() / sum / all : 1.0f;
      correction_[i] = std::clamp(all * (1 + trust * (own - 1)), 1 / kLargestCorrection, kLargestCorrection);
    }
  }
  const Face& face_of(NodeRef element) const { return shape_.faces[shape_.elements[element].face]; }

  /// Jacobi iteration until what is still to come is less than `residual` of what is there.
  void iterate(float residual, RadiosityReport& report) {
    double before = 0;
    for (std::int64_t i = 0; i < options_.iterations; ++i) {
      std::vector<Color> next = transport(radiosity_);
      double change = 0, size = 0;
      for (std::size_t k = 0; k < next.size(); ++k) {
        const Element& e = shape_.elements[k];
        if (!e.leaf()) continue;
        next[k] = shape_.faces[e.face].receives ? next[k] * correction_[k] : Color(0);
        const auto a = static_cast<double>(e.flat.area);
        const Color d = glm::abs(next[k] - irradiance_[k]);
        change += a * static_cast<double>(d.x + d.y + d.z);
        size += a * static_cast<double>(next[k].x + next[k].y + next[k].z);
      }
      irradiance_ = std::move(next);
      pull();
      // Changes fall like a geometric series.
      const double ratio = before > 0 ? std::min(change / before, 0.999) : 0.9;
      before = change;
      ++report.iterations;
      report.residual = size > 0 ? change / size * ratio / (1 - ratio) : 0;
      if (report.residual <= static_cast<double>(residual)) break;
    }
  }

  QuadTree result() const {
    const Scene& scene = context_.scene();
    QuadTree tree(patches_);
    for (std::uint32_t i = 0; i < shape_.faces.size(); ++i) {
      const Face& face = shape_.faces[i];
      const bool wanted = options_.to(scene.part_tags(patches_->part(face.id / 2)));
      if (!face.receives || !wanted) continue;
      std::vector<QuadTreeNode> nodes{{irradiance_[i]}};
      std::vector<std::uint32_t> from{i};
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const Element& e = shape_.elements[from[k]];
        if (e.leaf()) continue;
        nodes[k].children = static_cast<std::uint32_t>(nodes.size());
        for (std::uint32_t c = e.children; c < e.children + 4; ++c) {
          nodes.push_back({irradiance_[c]});
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

  std::vector<Link> links_;  // those of elements first, in order of receivers
  std::vector<std::size_t> first_of_element_, first_of_cluster_;
  std::vector<Color> radiosity_, irradiance_;  // by element; irradiance: what is solved for
  std::vector<float> spread_;                  // by element: how much its leaves' radiosity differs from its own
  std::vector<float> correction_;              // by element, of leaves
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
