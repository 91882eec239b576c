#include "ln/verify.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "ln/distribution.hpp"
#include "ln/material.hpp"
#include "ln/photon_map.hpp"
#include "ln/reference_paths.hpp"
#include "ln/sorted_photons.hpp"

namespace ln {

namespace {

constexpr double kStandardErrors = 4;
/// Where particles arrive in fewer batches than this, their spread says nothing. An energy of this many particles in the mean
/// stays unseen once in 20,000 times.
constexpr int kFewBatches = 8;
constexpr double kUnseen = 10;
constexpr std::size_t kChunk = 1024;  // of points or particles: what a worker does in one go

/// Mean of independent numbers and its standard error.
struct Estimate {
  double mean = 0, error = 0;
};

Estimate estimate(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Estimate result;
  for (const double v : values) result.mean += v / n;
  for (const double v : values) result.error += (v - result.mean) * (v - result.mean) / (n * (n - 1));
  result.error = std::sqrt(result.error);
  return result;
}

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string row(const char* wire, const std::string& surfaces, const std::string& found, const std::string& expected,
                const std::string& deviation, const std::string& allowed, const char* verdict) {
  return formatted("%-20s %-16s %12s %12s %10s %10s%s\n", wire, surfaces.c_str(), found.c_str(), expected.c_str(),
                   deviation.c_str(), allowed.c_str(), verdict);
}

/// [unit^2]
float triangle_area(const SceneData& data, const UVec3& i) {
  const Vec3 a = data.positions[i.x];
  return 0.5f * glm::length(glm::cross(data.positions[i.y] - a, data.positions[i.z] - a));
}

Distribution triangles_by_area(const SceneData& data) {
  std::vector<double> areas;
  for (const UVec3& i : data.triangles) areas.push_back(static_cast<double>(triangle_area(data, i)));
  return Distribution(areas);
}

/// What the surface at `hit` can scatter by, seen from the front or the back.
Events events_at(const Scene& scene, const Hit& hit, bool front) {
  SurfacePosition at;
  scene.locate(hit, at);
  const Vec3 n = front ? at.ng : -at.ng;
  return Interaction(scene, Ray{at.p + n, -n, kInfinity}, hit).bsdf().events();
}

/// A surface with partial coverage counts as if all of it were there.
float share_that_is_there(const Scene& scene, const Hit& hit) {
  if (hit.triangle < scene.data().alpha_begin) return 1;
  return std::max(coverage(scene.data(), hit.triangle, hit.u, hit.v), 1e-3f);
}

/// Adds `values`, element by element.
void add(std::vector<double>& sum, const std::vector<double>& values) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += values[i];
}

}  // namespace

// --- Representations -------------------------------------------------------------------------------------------------

class EnergySampler {
 public:
  EnergySampler(PrepareContext& context, const WireInfo& wire, const Distribution& triangles, std::uint32_t key,
                std::uint32_t points)
      : context_(context), wire_(wire), triangles_(triangles), key_(key), points_(points) {}

  /// Integral of the irradiance over both sides of all surfaces that count, by points of equal density.
  WireEnergy integral(IrradianceSource irradiance) const {
    std::vector<std::vector<double>> chunks((points_ - 1) / kChunk + 1, none());
    context_.for_chunks(points_, kChunk, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i)
        sample(SampleStream(key_, static_cast<std::uint32_t>(i)), tracer, irradiance, chunks[begin / kChunk]);
    });
    WireEnergy sum{none()};
    for (const auto& chunk : chunks) add(sum.flux, chunk);
    return sum;
  }

  WireEnergy sum(std::span<const Photon> photons) const {
    WireEnergy energy{none(), true};
    for (const Photon& photon : photons)
      energy.flux[place(photon.triangle)] += static_cast<double>(mean_component(photon.flux.unpack()));
    return energy;
  }

 private:
  std::vector<double> none() const { return std::vector<double>(static_cast<std::size_t>(wire_.paths.combinations())); }

  /// The combination of tags of a triangle's part.
  std::size_t place(std::uint32_t triangle) const {
    const Scene& scene = context_.scene();
    return static_cast<std::size_t>(wire_.paths.combination(scene.part_tags(scene.data().triangle_part[triangle])));
  }

  void sample(const SampleStream& random, Tracer& tracer, IrradianceSource irradiance, std::vector<double>& sum) const {
    const Distribution::Sample pick = triangles_.sample(random.get1(0, kOwn));
    const bool front = random.get1(0, kOwn + 1) < 0.5f;
    const Vec2 u = random.get2(0, kOwn + 2);
    const float root = std::sqrt(u.x);
    const Hit hit{0, pick.index, root * (1 - u.y), root * u.y};
    if (wire_.receivers != Events::all && !any(events_at(context_.scene(), hit, front) & wire_.receivers)) return;
    const SceneData& data = context_.scene().data();
    const float area = 2 * triangle_area(data, data.triangles[pick.index]) /
                       (pick.pmf * static_cast<float>(points_));  // that the point stands for
    sum[place(pick.index)] += static_cast<double>(mean_component(irradiance(tracer, random, hit, front)) * area);
  }

  PrepareContext& context_;
  const WireInfo& wire_;
  const Distribution& triangles_;
  std::uint32_t key_, points_;
};

WireEnergy wire_energy(const EnergySampler& sampler, IrradianceSource irradiance) { return sampler.integral(irradiance); }
WireEnergy wire_energy(const EnergySampler& sampler, const Photons& photons) { return sampler.sum(photons.hits); }
WireEnergy wire_energy(const EnergySampler& sampler, const SortedPhotons& photons) { return sampler.sum(photons.hits); }

WireEnergy wire_energy(const EnergySampler&, const PhotonMap& map) {
  double sum = 0;
  for (std::uint32_t slot = 0; slot < map.size(); ++slot) sum += static_cast<double>(mean_component(map.flux(slot)));
  return {{sum}, true};
}

// --- Comparison ------------------------------------------------------------------------------------------------------

/// The wires so far, and what the batches have brought.
class Verification::Comparisons {
 public:
  Comparisons(const Scene& scene, const ProgramInfo& program, std::span<const TagRule> tags, std::uint32_t samples)
      : scene_(scene), program_(program), tags_(tags), samples_(samples), triangles_(triangles_by_area(scene.data())) {}

  void begin(PrepareContext& context) {
    context_ = &context;
    next_ = 0;
  }

  void measure(const WireInfo& wire, FunctionRef<WireEnergy(const EnergySampler&)> energy) {
    const std::uint32_t key = this->key();
    Comparison& comparison = next(wire, wire.reason);
    if (!comparison.reason.empty()) return;
    WireEnergy found = energy(EnergySampler(*context_, wire, triangles_, key, samples_));
    comparison.at_shading_normals = found.at_shading_normals;
    comparison.found.push_back(std::move(found.flux));
  }

  void leave_out(const WireInfo& wire) { next(wire, "its representation is private to what reads it"); }

  void trace_reference();
  VerificationReport report() const;

 private:
  struct Comparison {
    WireInfo wire;
    std::string reason;
    bool at_shading_normals = false;
    std::vector<std::vector<double>> found, expected;  // by batch
    std::vector<double> routes;                        // the expected energy without regard to signs, sum of all batches
  };
  /// Of one wire, by combination of tags.
  struct Sums {
    std::vector<double> expected, routes;
  };
  /// What some particles brought: by wire, and the most that one of them brought anywhere.
  struct Arrived {
    std::vector<Sums> sums;
    double heaviest = 0;
  };

  Comparison& next(const WireInfo& wire, const char* reason) {
    if (next_ == comparisons_.size()) {
      const auto classes = static_cast<std::size_t>(wire.paths.combinations());
      comparisons_.push_back({wire, reason, false, {}, {}, std::vector<double>(classes)});
    }
    return comparisons_[next_++];
  }

  /// Of the random numbers for what comes next in this batch.
  std::uint32_t key() const {
    const std::uint64_t seed = context_->seed();
    return hash32(hash32(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)),
                  0x76657269u + static_cast<std::uint32_t>(next_));
  }

  /// One particle of each class of emitters.
  void trace(Random random, Tracer& tracer, Arrived& arrived) const;
  void receive(const Comparison& comparison, int state, const Interaction& at, const Color& flux, Sums& sums) const;
  /// Adds a row to the table; returns whether the wire is within its bounds on these surfaces.
  bool compare(const Comparison& comparison, std::size_t place, std::string& table) const;
  /// Does any of the wire's paths end on surfaces with this combination of tags?
  static bool may_arrive(const WireInfo& wire, std::size_t place);
  std::string surfaces(const PathLanguage& paths, std::size_t place) const;

  const Scene& scene_;
  const ProgramInfo& program_;
  std::span<const TagRule> tags_;
  std::uint32_t samples_;
  Distribution triangles_;
  PrepareContext* context_ = nullptr;
  std::unique_ptr<EmitterClasses> emitters_;
  std::vector<Comparison> comparisons_;
  std::size_t next_ = 0;
  double heaviest_ = 0;  // energy of a particle, before it is divided by their number
};

void Verification::Comparisons::trace_reference() {
  if (comparisons_.empty()) return;
  if (!emitters_) emitters_ = std::make_unique<EmitterClasses>(scene_, comparisons_.front().wire.paths);
  const std::vector<double> none(static_cast<std::size_t>(comparisons_.front().wire.paths.combinations()));
  std::vector<Arrived> chunks((samples_ - 1) / kChunk + 1, {std::vector<Sums>(comparisons_.size(), {none, none})});
  const std::uint32_t key = this->key();
  context_->for_chunks(samples_, kChunk, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    for (std::size_t i = begin; i < end; ++i) trace(Random(key, i), tracer, chunks[begin / kChunk]);
  });
  for (std::size_t w = 0; w < comparisons_.size(); ++w) {
    std::vector<double> sum = none;
    for (const Arrived& chunk : chunks) {
      add(sum, chunk.sums[w].expected);
      add(comparisons_[w].routes, chunk.sums[w].routes);
    }
    for (double& s : sum) s /= samples_;
    comparisons_[w].expected.push_back(std::move(sum));
  }
  for (const Arrived& chunk : chunks) heaviest_ = std::max(heaviest_, chunk.heaviest);
}

void Verification::Comparisons::trace(Random random, Tracer& tracer, Arrived& arrived) const {
  std::vector<int> states(comparisons_.size());  // of each wire's language
  for (const EmitterClass& source : emitters_->all()) {
    for (std::size_t w = 0; w < states.size(); ++w) states[w] = comparisons_[w].wire.paths.after(0, source.letter);
    trace_particle(
        tracer, 0, *source.emitters, random,
        [&](const Interaction& at, const Ray&, const Color& flux) {
          bool goes_on = false;
          arrived.heaviest = std::max(arrived.heaviest, static_cast<double>(mean_component(flux)));
          for (std::size_t w = 0; w < states.size(); ++w) {
            if (states[w] < 0) continue;
            goes_on = true;
            receive(comparisons_[w], states[w], at, flux, arrived.sums[w]);
          }
          return EventChoice{goes_on, goes_on, goes_on};
        },
        [&](const Interaction& at, int event) {
          for (std::size_t w = 0; w < states.size(); ++w) {
            const PathLanguage& paths = comparisons_[w].wire.paths;
            if (states[w] >= 0) states[w] = paths.after(states[w], paths.event(event, scene_.part_tags(at.part)));
          }
        });
  }
}

void Verification::Comparisons::receive(const Comparison& comparison, int state, const Interaction& at, const Color& flux,
                                        Sums& sums) const {
  const WireInfo& wire = comparison.wire;
  if (wire.receivers != Events::all && !any(at.bsdf().events() & wire.receivers)) return;
  const TagSet tags = scene_.part_tags(at.part);
  const int received = wire.paths.after(state, wire.paths.event(0, tags));
  const int seen = received < 0 ? -1 : wire.paths.after(received, wire.paths.eye());
  if (seen < 0) return;
  const float weight = (comparison.at_shading_normals ? arrival_factor(at) : 1.0f) / share_that_is_there(scene_, at.hit);
  const auto energy = static_cast<double>(mean_component(flux) * weight);
  const auto place = static_cast<std::size_t>(wire.paths.combination(tags)), end = static_cast<std::size_t>(seen);
  sums.expected[place] += energy * wire.counts[end];
  sums.routes[place] += energy * wire.routes[end];
}

std::string Verification::Comparisons::surfaces(const PathLanguage& paths, std::size_t place) const {
  std::string text;
  for (std::size_t i = 0; i < paths.tags().size(); ++i) {
    const auto rule = std::find_if(tags_.begin(), tags_.end(), [&](const TagRule& r) { return r.tag == paths.tags()[i]; });
    if (place >> i & 1u && rule != tags_.end()) text += (text.empty() ? "" : "&") + std::string(rule->name);
  }
  if (!text.empty()) return text;
  return paths.tags().empty() ? "all" : "other";
}

bool Verification::Comparisons::may_arrive(const WireInfo& wire, std::size_t place) {
  for (int state = 0; state < static_cast<int>(wire.counts.size()); ++state) {
    const int received = wire.paths.after(state, wire.paths.event_at(0, static_cast<int>(place)));
    if (received >= 0 && wire.paths.after(received, wire.paths.eye()) >= 0) return true;
  }
  return false;
}

bool Verification::Comparisons::compare(const Comparison& comparison, std::size_t place, std::string& table) const {
  // One number for all classes is compared with the sum of the others.
  const bool together = comparison.found.front().size() == 1;
  const auto of_place = [&](const std::vector<double>& classes) {
    double sum = 0;
    for (std::size_t c = 0; c < classes.size(); ++c) sum += together || c == place ? classes[c] : 0;
    return sum;
  };
  const auto estimated = [&](const std::vector<std::vector<double>>& batches) {
    std::vector<double> values;
    for (const auto& batch : batches) values.push_back(of_place(batch));
    return estimate(values);
  };
  const Estimate found = estimated(comparison.found), expected = estimated(comparison.expected);
  const double particles = static_cast<double>(samples_) * static_cast<double>(comparison.expected.size());
  const double routes = of_place(comparison.routes) / particles;
  double allowed =
      static_cast<double>(comparison.wire.bias) * routes + kStandardErrors * std::hypot(found.error, expected.error);
  const auto batches = std::count_if(comparison.expected.begin(), comparison.expected.end(),
                                     [&](const auto& batch) { return of_place(batch) != 0; });
  if (batches < kFewBatches && (together || may_arrive(comparison.wire, place))) allowed += kUnseen * heaviest_ / particles;
  const bool fine = std::abs(found.mean - expected.mean) <= allowed;
  const double watts = scene_.data().unit * scene_.data().unit;
  const auto percent = [&](const char* format, double energy) {
    return routes > 0 ? formatted(format, 100 * energy / routes) : std::string("-");
  };
  table += row(program_.nodes[comparison.wire.node].name, together ? "all" : surfaces(comparison.wire.paths, place),
               formatted("%.5g", found.mean * watts), formatted("%.5g", expected.mean * watts),
               percent("%+.2f%%", found.mean - expected.mean), percent("%.2f%%", allowed), fine ? "" : "   DEVIATES");
  return fine;
}

VerificationReport Verification::Comparisons::report() const {
  VerificationReport report;
  report.table = row("wire", "surfaces", "found [W]", "expected [W]", "deviation", "allowed", "");
  for (const Comparison& c : comparisons_) {
    if (!c.reason.empty()) {
      report.table += formatted("%-20s not compared: %s\n", program_.nodes[c.wire.node].name, c.reason.c_str());
      continue;
    }
    std::set<std::size_t> places;
    for (std::uint32_t part = 0; part < scene_.data().parts.size(); ++part)
      places.insert(c.found.front().size() == 1 ? 0
                                                : static_cast<std::size_t>(c.wire.paths.combination(scene_.part_tags(part))));
    bool fine = true;
    for (const std::size_t place : places) fine = compare(c, place, report.table) && fine;
    if (!fine) ++report.deviating_wires;
  }
  return report;
}

Verification::Verification(const Scene& scene, const ProgramInfo& program, std::span<const TagRule> tags, std::uint32_t samples)
    : comparisons_(std::make_unique<Comparisons>(scene, program, tags, samples)) {}

Verification::~Verification() = default;

void Verification::begin_batch(PrepareContext& context) { comparisons_->begin(context); }
void Verification::measure_energy(const WireInfo& wire, FunctionRef<WireEnergy(const EnergySampler&)> energy) {
  comparisons_->measure(wire, energy);
}
void Verification::leave_out(const WireInfo& wire) { comparisons_->leave_out(wire); }
void Verification::end_batch() { comparisons_->trace_reference(); }
VerificationReport Verification::report() const { return comparisons_->report(); }

}  // namespace ln
