#include "ln/quad_tree_sampling.hpp"

#include <algorithm>

#include "ln/diffuse_surface.hpp"
#include "ln/distribution.hpp"

namespace ln {

namespace {

/// Variation of less than this, in units of what noise makes on average, may be noise: of 100 noisy cells some 3 vary by more.
constexpr float kSignificance = 3;
/// Samples of a cell from which variation and noise can be told apart: four in each quarter.
constexpr int kSamplesToJudge = 16;
/// Numbers from here on stand for cells of no face's tree.
constexpr std::uint32_t kPilot = 0x80000000u;

/// What the samples of a cell say.
struct Estimate {
  Color mean{0};
  float noise = 0;            // variance of the mean, all channels together
  float variation = 0;        // mean squared difference of the quarters from the mean
  float variation_noise = 0;  // what of it is to be expected from noise alone
};

struct Cell {
  std::uint32_t slot;  // of the face in its batch
  std::uint32_t node;  // of the face
  int depth;
  DomainCell domain;
  int samples;
};

/// The tree of one face while it grows.
struct Face {
  std::uint32_t id;
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
        patches_(std::make_shared<const Patches>(context.scene().data())) {
    constexpr float kCellsAcross = 48;
    if (!(options_.cell > 0)) options_.cell = 1 / kCellsAcross;
    options_.depth = std::min(options_.depth, QuadTree::kMaxDepth);
  }

  /// Some faces at a time, so that the memory is that of the result and of one such batch.
  QuadTree run() {
    constexpr std::size_t kCellsOfBatch = 1 << 16;
    find_faces();
    const float threshold = sqr(options_.error) * mean_square();
    QuadTree tree(patches_);
    std::vector<Cell> cells;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      add_first_cells(cells, ids_[i]);
      if (cells.size() < kCellsOfBatch && i + 1 < ids_.size()) continue;
      while (!cells.empty()) cells = split(cells, estimate_all(cells), threshold);
      const QuadTree batch = assemble();
      for (const Face& face : faces_)
        if (batch.lit(face.id)) tree.set(face.id, batch.face_nodes(face.id));
      faces_.clear();
    }
    return tree;
  }

 private:
  static std::uint32_t seed_hash(std::uint64_t seed) {
    return hash32(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32));
  }

  /// The faces that can use irradiance.
  void find_faces() {
    const Scene& scene = context_.scene();
    std::vector<std::uint8_t> wanted(2 * scene.data().parts.size());
    for (std::uint32_t part = 0; part < scene.data().parts.size(); ++part)
      for (std::uint32_t side = 0; side < 2; ++side)
        wanted[2 * part + side] = options_.to(scene.part_tags(part)) && scatters_diffusely(scene, part, side == 0) ? 1 : 0;
    for (std::uint32_t face = 0; face < patches_->face_count(); ++face)
      if (wanted[2 * patches_->part(face / 2) + face % 2] && area(patches_->surface(face / 2)) > 0) ids_.push_back(face);
  }

  /// How often a face is cut into cells of about the size that is wanted.
  int first_depth(std::uint32_t face) const {
    const float share = area(patches_->surface(face / 2)) / sqr(options_.cell);
    return std::clamp(static_cast<int>(std::ceil(0.5f * std::log2(share))), 0, options_.depth);
  }

  void add_first_cells(std::vector<Cell>& cells, std::uint32_t face) {
    const float share = area(patches_->surface(face / 2)) / sqr(options_.cell);
    const int samples = std::clamp(static_cast<int>(share * static_cast<float>(options_.samples)),
                                   std::min(4, options_.samples), options_.samples);
    const auto slot = static_cast<std::uint32_t>(faces_.size());
    faces_.push_back({face, std::vector<QuadTreeNode>(1), std::vector<float>(1)});
    grow(cells, {slot, 0, 0, patches_->domain(face / 2), samples}, first_depth(face));
  }

  /// Cuts a cell until it has the depth `wanted`, and collects what it becomes.
  void grow(std::vector<Cell>& cells, const Cell& cell, int wanted) {
    if (cell.depth == wanted) {
      cells.push_back(cell);
      return;
    }
    Face& face = faces_[cell.slot];
    const auto first = static_cast<std::uint32_t>(face.nodes.size());
    face.nodes[cell.node].children = first;
    face.nodes.resize(first + 4);
    face.noise.resize(first + 4);
    for (int i = 0; i < 4; ++i)
      grow(cells, {cell.slot, first + static_cast<std::uint32_t>(i), cell.depth + 1, cell.domain.child(i), cell.samples},
           wanted);
  }

  /// Samples all cells, and sets their values.
  std::vector<Estimate> estimate_all(const std::vector<Cell>& cells) {
    std::vector<Estimate> estimates(cells.size());
    context_.parallel_for(cells.size(), [&](Tracer& tracer, std::size_t i) {
      const Cell& cell = cells[i];
      estimates[i] = estimate(tracer, faces_[cell.slot].id, cell.node, cell.domain, cell.samples);
    });
    for (std::size_t i = 0; i < cells.size(); ++i) {
      Face& face = faces_[cells[i].slot];
      face.nodes[cells[i].node].value = estimates[i].mean;
      face.noise[cells[i].node] = estimates[i].noise;
    }
    return estimates;
  }

  Estimate estimate(Tracer& tracer, std::uint32_t face, std::uint32_t node, const DomainCell& domain, int samples) const {
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
    const std::uint32_t key = hash32(hash32(key_, face), node);
    for (int j = 0; j < samples; ++j) {
      const SampleStream random(key, static_cast<std::uint32_t>(j));
      const Vec2 u = random.get2(0, kOwn);
      Vec2 in_cell = DomainCell{Vec2(0), Vec2(1, 0), Vec2(0, 1), domain.quad}.point(u);
      const Vec2 st = domain.o + in_cell.x * domain.a + in_cell.y * domain.b;
      const Color E = sample_(tracer, random, patches_->hit(face / 2, st), Patches::is_front(face));
      quarter[descend(domain.quad, in_cell)].add(E);
    }
    Estimate e;
    Sum all;
    bool each_twice = true;
    for (const Sum& q : quarter) {
      all.sum += q.sum;
      all.squares += q.squares;
      all.n += q.n;
      each_twice = each_twice && q.n > 1;
    }
    e.mean = all.mean();
    for (const Sum& q : quarter) {
      if (q.n == 0) continue;
      const Color d = q.mean() - e.mean;
      e.noise += sqr(static_cast<float>(q.n) / static_cast<float>(all.n)) * q.noise();
      e.variation += 0.25f * glm::dot(d, d);
      e.variation_noise += 0.25f * 0.75f * q.noise();
    }
    if (!each_twice) e.noise = all.noise();  // with what the cell varies by, which cannot be told apart
    return e;
  }

  /// Mean of the squared irradiance over what is lit, from some of the first cells, picked by area.
  float mean_square() {
    constexpr std::uint32_t kCells = 1024;
    if (ids_.empty()) return 0;
    std::vector<double> areas;
    for (const std::uint32_t face : ids_) areas.push_back(static_cast<double>(area(patches_->surface(face / 2))));
    const Distribution by_area(areas);
    std::vector<Color> means(kCells);
    context_.parallel_for(kCells, [&](Tracer& tracer, std::size_t i) {
      const std::uint32_t face = ids_[by_area.sample((static_cast<float>(i) + 0.5f) / kCells).index];
      DomainCell cell = patches_->domain(face / 2);
      Vec2 st = cell.point(sobol_point(key_, 0, static_cast<std::uint32_t>(i)));
      for (int depth = first_depth(face); depth > 0; --depth) cell = cell.child(descend(cell.quad, st));
      means[i] = estimate(tracer, face, kPilot + static_cast<std::uint32_t>(i), cell, options_.samples).mean;
    });
    double sum = 0;
    int lit = 0;
    for (const Color& mean : means) {
      sum += static_cast<double>(glm::dot(mean, mean));
      lit += is_black(mean) ? 0 : 1;
    }
    return lit > 0 ? static_cast<float>(sum / lit) : 0.0f;
  }

  /// What is to be sampled next: the children of cells that vary by more than noise explains. Cells that may, but have too few
  /// samples to tell, come again with more.
  std::vector<Cell> split(const std::vector<Cell>& cells, const std::vector<Estimate>& estimates, float threshold) {
    std::vector<Cell> next;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Cell& cell = cells[i];
      const Estimate& e = estimates[i];
      const bool varies = e.variation - kSignificance * e.variation_noise > threshold;
      if (!varies || cell.depth >= options_.depth || cell.samples < options_.samples) continue;
      if (cell.samples < kSamplesToJudge) {
        next.push_back(cell);
        next.back().samples = kSamplesToJudge;
      } else {
        grow(next, cell, cell.depth + 1);
      }
    }
    return next;
  }

  /// The compressed trees of the batch.
  QuadTree assemble() const {
    QuadTree tree(patches_);
    std::vector<float> noise;
    for (const Face& face : faces_) {
      tree.set(face.id, face.nodes);
      if (!tree.lit(face.id)) continue;
      // Energy of the wavelets of each inner node that comes from noise, and the variance of its mean.
      std::vector<float> variance = face.noise, wavelets(face.nodes.size(), 0.0f);
      const float whole = area(patches_->surface(face.id / 2));
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
  std::vector<std::uint32_t> ids_;  // faces that are wanted
  std::vector<Face> faces_;         // of the batch
};

}  // namespace

QuadTree sample_quad_tree(PrepareContext& context, std::uint32_t key, const QuadTreeSampling& options,
                          IrradianceSampler sample) {
  return Sampler(context, key, options, sample).run();
}

}  // namespace ln
