#include "ln/quad_tree_sampling.hpp"

#include "ln/diffuse_surface.hpp"

namespace ln {

namespace {

/// Variation of less than this, in units of what noise makes on average, may be noise: of 100 noisy cells some 3 vary by more.
constexpr float kSignificance = 3;

/// What the samples of a cell say.
struct Estimate {
  Color mean{0};
  float noise = 0;            // variance of the mean, all channels together
  float variation = 0;        // mean squared difference of the quarters from the mean
  float variation_noise = 0;  // what of it is to be expected from noise alone
};

struct Cell {
  std::uint32_t face;
  std::uint32_t node;  // of the face
  int depth;
  DomainCell domain;
  int samples;
};

/// The tree of one face while it grows.
struct Face {
  std::vector<QuadTreeNode> nodes;
  std::vector<float> noise;  // by node: variance of its value
};

class Sampler {
 public:
  Sampler(PrepareContext& context, std::uint32_t key, const QuadTreeSampling& options, IrradianceSampler sample)
      : context_(context),
        key_(hash32(key, seed_hash(context.seed()))),
        options_(options),
        sample_(sample),
        patches_(std::make_shared<const Patches>(context.scene().data())),
        faces_(patches_->face_count()) {
    constexpr float kCellsAcross = 48;
    if (!(options_.cell > 0)) options_.cell = 1 / kCellsAcross;
    options_.depth = std::min(options_.depth, QuadTree::kMaxDepth);
  }

  QuadTree run() {
    std::vector<Cell> cells = first_cells();
    float threshold = -1;
    while (!cells.empty()) {
      std::vector<Estimate> estimates(cells.size());
      context_.parallel_for(cells.size(), [&](Tracer& tracer, std::size_t i) { estimates[i] = estimate(tracer, cells[i]); });
      for (std::size_t i = 0; i < cells.size(); ++i) {
        Face& face = faces_[cells[i].face];
        face.nodes[cells[i].node].value = estimates[i].mean;
        face.noise[cells[i].node] = estimates[i].noise;
      }
      if (threshold < 0) threshold = sqr(options_.error) * mean_square(cells, estimates);
      cells = split(cells, estimates, threshold);
    }
    return assemble();
  }

 private:
  static std::uint32_t seed_hash(std::uint64_t seed) {
    return hash32(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32));
  }

  /// Cells of about the size that is wanted, on all faces that can use irradiance.
  std::vector<Cell> first_cells() {
    const Scene& scene = context_.scene();
    std::vector<std::uint8_t> wanted(2 * scene.data().parts.size());
    for (std::uint32_t part = 0; part < scene.data().parts.size(); ++part)
      for (std::uint32_t side = 0; side < 2; ++side)
        wanted[2 * part + side] = options_.to(scene.part_tags(part)) && scatters_diffusely(scene, part, side == 0) ? 1 : 0;
    std::vector<Cell> cells;
    for (std::uint32_t face = 0; face < faces_.size(); ++face) {
      const std::uint32_t patch = face / 2;
      const float size = area(patches_->surface(patch));
      if (!wanted[2 * patches_->part(patch) + face % 2] || !(size > 0)) continue;
      const float share = size / sqr(options_.cell);
      const int depth = std::clamp(static_cast<int>(std::ceil(0.5f * std::log2(share))), 0, options_.depth);
      const int samples = std::clamp(static_cast<int>(share * static_cast<float>(options_.samples)),
                                     std::min(4, options_.samples), options_.samples);
      faces_[face].nodes.resize(1);
      faces_[face].noise.resize(1);
      grow(cells, {face, 0, 0, patches_->domain(patch), samples}, depth);
    }
    return cells;
  }

  /// Cuts a cell until it has the depth `wanted`, and collects what it becomes.
  void grow(std::vector<Cell>& cells, const Cell& cell, int wanted) {
    if (cell.depth == wanted) {
      cells.push_back(cell);
      return;
    }
    Face& face = faces_[cell.face];
    const auto first = static_cast<std::uint32_t>(face.nodes.size());
    face.nodes[cell.node].children = first;
    face.nodes.resize(first + 4);
    face.noise.resize(first + 4);
    for (int i = 0; i < 4; ++i)
      grow(cells, {cell.face, first + static_cast<std::uint32_t>(i), cell.depth + 1, cell.domain.child(i), cell.samples},
           wanted);
  }

  Estimate estimate(Tracer& tracer, const Cell& cell) const {
    struct Sum {
      Color sum{0}, squares{0};
      int n = 0;
      void add(const Color& c) {
        sum += c;
        squares += c * c;
        ++n;
      }
      Color mean() const { return sum / static_cast<float>(n); }
      /// Variance of the mean.
      float noise() const {
        if (n < 2) return 0;
        const Color v = squares / static_cast<float>(n) - mean() * mean();
        return std::max(0.0f, v.x + v.y + v.z) / static_cast<float>(n - 1);
      }
    };
    Sum quarter[4];
    const std::uint32_t key = hash32(hash32(key_, cell.face), cell.node);
    const Vec2 whole[2] = {cell.domain.a, cell.domain.b};
    for (int j = 0; j < cell.samples; ++j) {
      const SampleStream random(key, static_cast<std::uint32_t>(j));
      const Vec2 u = random.get2(0, kOwn);
      Vec2 in_cell = DomainCell{Vec2(0), Vec2(1, 0), Vec2(0, 1), cell.domain.quad}.point(u);
      const Vec2 st = cell.domain.o + in_cell.x * whole[0] + in_cell.y * whole[1];
      const Color E = sample_(tracer, random, patches_->hit(cell.face / 2, st), Patches::is_front(cell.face));
      quarter[descend(cell.domain.quad, in_cell)].add(E);
    }
    Estimate e;
    Color sum(0);
    int n = 0;
    for (const Sum& q : quarter) {
      sum += q.sum;
      n += q.n;
    }
    e.mean = sum / static_cast<float>(n);
    for (const Sum& q : quarter) {
      if (q.n == 0) continue;
      const Color d = q.mean() - e.mean;
      e.noise += sqr(static_cast<float>(q.n) / static_cast<float>(n)) * q.noise();
      e.variation += 0.25f * glm::dot(d, d);
      e.variation_noise += 0.25f * 0.75f * q.noise();
    }
    return e;
  }

  /// Mean of the squared irradiance over what is lit.
  float mean_square(const std::vector<Cell>& cells, const std::vector<Estimate>& estimates) const {
    double sum = 0, whole = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (is_black(estimates[i].mean)) continue;
      const double a = static_cast<double>(area(surface_cell(patches_->surface(cells[i].face / 2), cells[i].domain)));
      sum += a * static_cast<double>(glm::dot(estimates[i].mean, estimates[i].mean));
      whole += a;
    }
    return whole > 0 ? static_cast<float>(sum / whole) : 0.0f;
  }

  std::vector<Cell> split(const std::vector<Cell>& cells, const std::vector<Estimate>& estimates, float threshold) {
    std::vector<Cell> next;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Estimate& e = estimates[i];
      const bool varies = e.variation - kSignificance * e.variation_noise > threshold;
      if (!varies || cells[i].depth >= options_.depth || cells[i].samples < options_.samples) continue;
      grow(next, cells[i], cells[i].depth + 1);
    }
    return next;
  }

  QuadTree assemble() const {
    QuadTree tree(patches_);
    std::vector<float> noise;
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      const Face& face = faces_[f];
      if (face.nodes.empty()) continue;
      tree.set(f, face.nodes);
      if (!tree.lit(f)) continue;
      // Energy of the wavelets of each inner node that comes from noise, and the variance of its mean.
      std::vector<float> variance = face.noise, wavelets(face.nodes.size(), 0.0f);
      const float whole = area(patches_->surface(f / 2));
      std::vector<float> cell_area(face.nodes.size(), whole);
      for (std::size_t i = 0; i < face.nodes.size(); ++i)
        for (std::uint32_t k = 0; k < 4 && !face.nodes[i].leaf(); ++k) cell_area[face.nodes[i].children + k] = cell_area[i] / 4;
      for (std::size_t i = face.nodes.size(); i-- > 0;) {
        if (face.nodes[i].leaf()) continue;
        float sum = 0;
        for (std::uint32_t k = 0; k < 4; ++k) sum += variance[face.nodes[i].children + k];
        variance[i] = sum / 16;
        wavelets[i] = kSignificance * cell_area[i] * 0.25f * 0.75f * sum;
      }
      noise.insert(noise.end(), wavelets.begin(), wavelets.end());
    }
    if (options_.error > 0) tree.compress(options_.error, noise);
    return tree;
  }

  PrepareContext& context_;
  std::uint32_t key_;
  QuadTreeSampling options_;
  IrradianceSampler sample_;
  std::shared_ptr<const Patches> patches_;
  std::vector<Face> faces_;
};

}  // namespace

QuadTree sample_quad_tree(PrepareContext& context, std::uint32_t key, const QuadTreeSampling& options,
                          IrradianceSampler sample) {
  return Sampler(context, key, options, sample).run();
}

}  // namespace ln
