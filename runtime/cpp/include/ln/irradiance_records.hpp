#pragma once
// Irradiance records in an octree, and their creation where they are missing (Ward, Rubinstein and Clear 1988; Ward and
// Heckbert 1992).

#include <cstdint>
#include <vector>

#include "ln/hemisphere.hpp"
#include "ln/prepare.hpp"

namespace ln {

struct TapFile;

/// A place where irradiance is wanted: one side of the surface at `hit`.
struct Receiver {
  Hit hit;
  bool front = true;
  Vec3 p{0}, n{0, 0, 1};    // n: shading normal on that side
  float footprint = 0;      // height of the picture as it appears there [normalised units]
  float above = kInfinity;  // distance of what is straight above, as far as that is known
};

struct IrradianceRecord {
  Vec3 p{0}, n{0, 0, 1};
  float exact = 0;          // distance at which the error of using the record has grown to what is allowed
  float reach = 0;          // the same, kept within bounds: how far the record is used at all
  float clear = kInfinity;  // up to there nothing that it saw stands in the way, to whichever side
  float above = kInfinity;  // as of Receiver
  IrradianceSample sample;
};

/// Irradiance at a point from records around it. Along the way from a record, irradiance changes by the mean of the gradients
/// at both ends (trapezoidal rule; that at the point is the records' mean): so curvature does no harm between records, whose
/// tangents would all lie on one side of it.
class InterpolatedIrradiance {
 public:
  InterpolatedIrradiance(const Vec3& p, const Vec3& n, bool gradients = true) : p_(p), n_(n), gradients_(gradients) {}

  void operator()(const IrradianceRecord& record, float weight) {
    weight_ += weight;
    sum_ += weight * record.sample.irradiance;
    if (!gradients_) return;
    const Vec3 way = p_ - record.p;
    sum_ += weight * (glm::cross(record.n, n_) * record.sample.rotation + 0.5f * (way * record.sample.translation));
    way_ += weight * way;
    slope_ += weight * record.sample.translation;
  }

  Color value() const {
    if (!(weight_ > 0)) return Color(0);
    return glm::max((sum_ + (0.5f / weight_) * (way_ * slope_)) / weight_, Color(0));
  }

 private:
  Vec3 p_, n_;
  bool gradients_;
  float weight_ = 0;  // sums, each term times its weight
  Color sum_{0};
  Vec3 way_{0};
  glm::mat3 slope_{0.0f};
};

/// How far records reach: the allowed error times the distance of the surroundings, but within bounds.
struct RecordSpacing {
  float error = 0.2f;                       // Ward's accuracy a
  float closest = 0.02f, farthest = 0.15f;  // bounds of the reach, as a share of the picture's height where the record is

  float least_reach(const Receiver& where) const { return closest * where.footprint; }
};

class IrradianceRecords {
 public:
  IrradianceRecords() = default;
  explicit IrradianceRecords(const RecordSpacing& spacing) : spacing_(spacing), nodes_(1) {}

  std::size_t size() const { return records_.size(); }
  bool empty() const { return records_.empty(); }
  const std::vector<IrradianceRecord>& records() const { return records_; }
  const RecordSpacing& spacing() const { return spacing_; }

  /// Adds a record. Neighbours limit each other: nothing is farther from one than from the other plus the way between them
  /// (Krivanek et al. 2006, "neighbor clamping").
  void add(const Receiver& where, const IrradianceSample& sample);

  /// Takes a new value for a record; its reach stays.
  void set_value(std::size_t index, const IrradianceSample& sample);

  /// How far each record reached when it was added, by which it lies in the octree.
  std::vector<float> first_reaches() const;
  /// Adds a record of another set as it is. All records of a set, in their order, make an equal set, to the last bit of what
  /// `visit` finds.
  void restore(const IrradianceRecord& record, float first_reach);

  Color mean_irradiance() const;

  /// Do the records whose error there is allowed weigh enough? None counts that is too far away to know of what is above.
  bool covers(const Receiver& where) const;

  /// Calls `visit(record, weight)` for records near the point. Weights fall to 0 with the error, like Tabellion and
  /// Lamorlette's (2004), but with its third power: where irradiance is curved, gradients lead astray with the square of the
  /// distance. `limit` <= kFar: the error at which they get to 0, in units of what is allowed. A record that is used farther
  /// away than it should be, as records in corners and gaps are, gives way to others. Returns how well the point is covered:
  /// enough, or not.
  template <class Visit>
  float visit(const Vec3& p, const Vec3& n, float limit, Visit&& visit) const {
    float sum = 0;
    for_near(p, n, limit, [&](const IrradianceRecord& record) {
      const float e = error(record, p, n);
      if (e >= limit || hidden(record, p)) return false;
      const float trust = cover_by(record, p, e, limit);
      visit(record, sqr(1 - e / limit) * trust);
      sum += trust;
      return false;
    });
    return sum;
  }

  static constexpr float kOverlap = 1.4f;  // usual limit: neighbouring records overlap, so that no border shows
  static constexpr float kFar = 3.0f;
  // Cover: one record suffices, unless it is far out of its depth, as those in corners and narrow gaps are. More is wanted
  // of places where records are made than of those that are read, which lie between them.
  static constexpr float kWanted = 0.12f, kEnough = 0.05f;

 private:
  /// What shows of most records that they are of no use somewhere; `reach` may have shrunk since.
  struct Entry {
    Vec3 p;
    float reach;
    Vec3 n;
    std::uint32_t record;
  };
  struct Node {
    std::int32_t children[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
    std::vector<Entry> entries;
  };

  /// Error of using a record at a point, in units of what is allowed (Ward et al. 1988, eq. 4). Distance from the tangent
  /// plane counts four times: what lies on another level (steps, table and floor) has other surroundings. No record serves
  /// what lies behind it (their "in front" test), nor what lies beyond the thing above it.
  float error(const IrradianceRecord& record, const Vec3& p, const Vec3& n) const {
    constexpr float kBehind = 0.02f;  // as a share of the distance: surfaces may be a little curved
    const Vec3 d = p - record.p;
    const float distance = glm::length(d), height = 0.5f * glm::dot(d, record.n + n);
    if (height < -kBehind * distance || height > 0.5f * record.above) return kInfinity;
    const float turned = safe_sqrt(1 - glm::dot(n, record.n));
    return std::sqrt(sqr(distance) + sqr(4 * height)) / record.reach + turned / spacing_.error;
  }

  /// Did the record see something that stands between it and the point?
  static bool hidden(const IrradianceRecord& record, const Vec3& p) {
    return glm::distance(p, record.p) > record.clear && beyond_horizon(record, p);
  }
  static bool beyond_horizon(const IrradianceRecord& record, const Vec3& p);

  static float cover_by(const IrradianceRecord& record, const Vec3& p, float e, float limit) {
    return (1 - e / limit) * record.exact / std::max(record.exact, glm::distance(p, record.p));
  }

  /// Calls `use(record)` for all records whose error may be below `limit`, until it says true.
  template <class Use>
  void for_near(const Vec3& p, const Vec3& n, float limit, Use&& use) const {
    if (nodes_.empty()) return;
    const float least_cos = 1 - sqr(limit * spacing_.error);
    Vec3 centre(0);
    float half = 1;
    for (std::int32_t node = 0; node >= 0;) {
      for (const Entry& entry : nodes_[node].entries) {
        const Vec3 d = p - entry.p;
        if (glm::dot(d, d) >= sqr(limit * entry.reach) || glm::dot(n, entry.n) <= least_cos) continue;
        if (use(records_[entry.record])) return;
      }
      const int octant = (p.x > centre.x) | (p.y > centre.y) << 1 | (p.z > centre.z) << 2;
      half *= 0.5f;
      centre += Vec3(octant & 1 ? half : -half, octant & 2 ? half : -half, octant & 4 ? half : -half);
      node = nodes_[node].children[octant];
    }
  }

  /// What is straight above a record bounds its reach, as if all that is above were not much farther away.
  float reach_below(const Receiver& where) const {
    constexpr float kWide = 2;  // harmonic mean distance of a wide ceiling in units of its height, 1.5, and some more
    return std::max(spacing_.error * kWide * where.above, least_exact(where));
  }
  float least_exact(const Receiver& where) const {
    constexpr float kLeast = 1.0f / 40;  // bounds the number of records in gaps
    return kLeast * spacing_.least_reach(where);
  }
  /// How far away a record's surroundings are, as its neighbours and its gradient know them.
  float surroundings(const IrradianceRecord& record) const { return record.exact / spacing_.error; }

  void insert(const Entry& entry, std::int32_t node, const Vec3& centre, float half);

  RecordSpacing spacing_;
  std::vector<IrradianceRecord> records_;
  std::vector<Node> nodes_;
};

/// The records of a wire.
struct IrradianceRecordSets {
  IrradianceRecords seen{};    // where results look at surfaces
  IrradianceRecords beyond{};  // coarser ones where they do not, but the records get their light from
  Color ambient{0};            // [W/m^2] for surfaces beyond that no record reaches
};

void write_tap(const TapFile& tap, const IrradianceRecordSets& sets);

/// Makes a record's sample: the receiver and a key for its random numbers.
using SampleIrradiance = FunctionRef<IrradianceSample(Tracer&, const Receiver&, std::uint32_t key)>;

/// Adds records until all of `wanted` are covered; returns where, in the order of the records. Batches are chosen by hash and
/// sampled on all cores with the records so far only read, so that the result does not depend on the number of threads.
std::vector<Receiver> cover(PrepareContext& context, IrradianceRecords& records, const std::vector<Receiver>& wanted,
                            std::uint32_t key, SampleIrradiance sample);

/// Records that get their light from each other, bounce after bounce: E_(n+1) = T(direct + E_n). As the same directions are
/// followed each time, the difference of two rounds is the light of one more bounce, without noise of its own.
class BounceSeries {
 public:
  /// `records` hold the first bounce.
  explicit BounceSeries(IrradianceRecords& records);

  /// Samples all records anew, with the `key` that they were made with (see `cover`).
  void add(PrepareContext& context, const std::vector<Receiver>& places, std::uint32_t key, SampleIrradiance sample);
  /// Is the light of the last bounce negligible?
  bool converged() const;
  /// Adds what further bounces bring, as a geometric series.
  void add_remaining();

 private:
  IrradianceRecords& records_;
  std::vector<IrradianceSample> last_;  // what the last bounce brought to each record
  DVec3 last_sum_{0}, ratio_{0};        // of irradiances: of the last bounce; and its ratio to the one before
};

/// The diffuse surfaces that the eye sees at the centres of pixels (x, y) which `choose` picks, through specular ones too, in
/// the order of pixels. Camera rays at the cost of `node`.
std::vector<Receiver> seen_receivers(PrepareContext& context, NodeId node, FunctionRef<bool(int x, int y)> choose,
                                     FunctionRef<bool(const Receiver&)> keep);

/// The places on surfaces where probes and lightmaps measure, evenly thinned out where they are more than `most`. There is no
/// picture there: the whole scene counts as one.
std::vector<Receiver> measured_receivers(PrepareContext& context, NodeId node, std::size_t most);

/// About `count` places spread evenly over all surfaces that scatter diffusely, for what nobody has announced.
std::vector<Receiver> spread_receivers(PrepareContext& context, std::uint32_t count);

}  // namespace ln
