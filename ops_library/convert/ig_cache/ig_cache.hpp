#pragma once

#include <limits>
#include <optional>
#include <string>

#include "ln/cache.hpp"
#include "ln/hemisphere_request.hpp"
#include "ln/operator.hpp"

namespace ln::ops {

/// Irradiance records, made before the picture where the eye will want them; see ig_cache.ln.
struct IGCache {
  NodeId node;
  float error = 0.2f;
  float closest = 0.02f, farthest = 0.15f;
  std::int64_t bounces = 6;
  std::string file;

  /// Reads the records from the file, if it is of use.
  void open(PrepareContext& context, const CacheKey& key) {
    cache_key_ = key;
    if (const auto found = read_cache<IrradianceRecordSets>(context, key, file)) {
      sets_ = std::move(*found);
      wanted_ = false;
    }
  }
  /// Must records be made?
  bool wanted() const { return wanted_; }

  void prepare(PrepareContext& context, const auto& samples) {
    key_ = hash32(hash32(static_cast<std::uint32_t>(context.seed()), static_cast<std::uint32_t>(context.seed() >> 32)), node);
    sets_.seen = IrradianceRecords({error, closest, farthest});
    sets_.beyond = IrradianceRecords({kCoarserError * error, kCoarser * closest, kCoarser * farthest});
    solve_beyond(context, samples);
    cover_seen(context, samples);
    if (cache_key_) write_cache(sets_, *cache_key_, file);
  }

  template <class Visit>
  void answer(RecordRequest<Visit>& request, const auto& samples) const {
    const Interaction& at = request.at();
    const Recursion& recursion = request.tracer().recursion(node);
    if (recursion.purpose) {
      static_cast<std::vector<Receiver>*>(recursion.purpose)->push_back({at.hit, at.front, at.at.p, at.frame.n, 0});
      return;
    }
    const auto read = [&](const IrradianceRecords& records, float limit) {
      return records.visit(at.at.p, at.frame.n, limit, request.visit);
    };
    if (recursion.depth > 0) {
      float cover = read(sets_.beyond, IrradianceRecords::kOverlap);
      if (cover <= IrradianceRecords::kEnough) cover += read(sets_.beyond, IrradianceRecords::kFar);
      if (cover == 0 && !sets_.beyond.empty()) request.visit(IrradianceRecord{.sample = {.irradiance = sets_.ambient}}, 1);
      return;
    }
    // What lies between the places that were looked at before, or in a gap, may be farther from records than is allowed.
    if (read(sets_.seen, IrradianceRecords::kOverlap) > IrradianceRecords::kEnough) return;
    const std::uint32_t key = hash32(request.random().bits(request.depth(), kRoulette));
    const Receiver where{at.hit, at.front, at.at.p, at.frame.n};
    request.visit(
        IrradianceRecord{.p = where.p, .n = where.n, .sample = sample(request.tracer(), where, key, kSpotShare, samples)}, 1);
  }

  /// The records, for taps.
  const IrradianceRecordSets& irradiance_records() const { return sets_; }

 private:
  // Records that the eye does not see: wider apart, made from fewer directions.
  static constexpr float kCoarser = 4, kCoarserError = 1, kBeyondShare = 0.125f;
  static constexpr float kSpotShare =
      1.0f / 12;  // of the directions, where something is sampled on the spot for a single request
  // Where they are wanted is found from about so many pixels, of places where others measure, and on all surfaces, then from
  // the records found so far.
  static constexpr std::size_t kProbes = 1024;
  static constexpr float kProbeShare = 1.0f / 32;
  static constexpr std::uint32_t kSpread = 64;
  static constexpr int kGenerations = 4;
  static constexpr int kWidestStride = 16;  // [pixels]

  /// Samples at a receiver; requests that come back to this node meanwhile are one level deeper. With `wanted`, they are noted
  /// there and answered by darkness.
  LN_NOINLINE IrradianceSample sample(Tracer& tracer, const Receiver& where, std::uint32_t key, float share,
                                      const auto& samples, std::vector<Receiver>* wanted = nullptr) const {
    Recursion& recursion = tracer.recursion(node);
    const Recursion before = recursion;
    recursion = {before.depth + 1, wanted};
    const IrradianceRecords& records = share < 1 ? sets_.beyond : sets_.seen;
    HemisphereRequest request(tracer, where, key, share, IrradianceRecords::kOverlap * records.spacing().least_reach(where));
    IrradianceSample result = samples(request);
    recursion = before;
    if (share < 1) result.nearest = kInfinity;  // guards against leaks that are seen only
    return result;
  }

  /// Places where this node is asked for light, when it makes samples at `origins` (few directions each). Answered by darkness.
  std::vector<Receiver> asked_from(PrepareContext& context, const std::vector<Receiver>& origins, const auto& samples) const {
    std::vector<std::vector<Receiver>> wanted(origins.size());
    const View& view = context.view();
    context.for_chunks(origins.size(), 16, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
      for (std::size_t i = begin; i < end; ++i) {
        sample(tracer, origins[i], hash32(key_, static_cast<std::uint32_t>(i)), kProbeShare, samples, &wanted[i]);
        for (Receiver& place : wanted[i])
          place.footprint = origins[i].footprint + (view.width > 0 ? view.rays.height_at(place.hit.t) : 0);
      }
    });
    std::vector<Receiver> all;
    for (const auto& some : wanted) all.insert(all.end(), some.begin(), some.end());
    return all;
  }

  /// Irradiance at surfaces that the eye does not see, where this node feeds itself: the fixed point of one more bounce. Each
  /// round follows the same directions, so rounds differ by the light of one more bounce only.
  void solve_beyond(PrepareContext& context, const auto& samples) {
    const View& view = context.view();
    const int stride = 1 + static_cast<int>(std::sqrt(static_cast<float>(view.width) * static_cast<float>(view.height) /
                                                      static_cast<float>(kProbes)));
    const std::vector<Receiver> seen = seen_receivers(
        context, node, [&](int x, int y) { return x % stride == 0 && y % stride == 0; }, [](const Receiver&) { return true; });
    std::vector<Receiver> places;
    for (std::vector<Receiver> origins :
         {seen, measured_receivers(context, node, kProbes), spread_receivers(context, kSpread)}) {
      for (int generation = 0; generation < kGenerations && !origins.empty(); ++generation) {
        origins = cover(context, sets_.beyond, asked_from(context, origins, samples), key_,
                        [&](Tracer& tracer, const Receiver& where, std::uint32_t key) {
                          std::vector<Receiver> ignored;
                          return sample(tracer, where, key, kBeyondShare, samples, &ignored);
                        });
        places.insert(places.end(), origins.begin(), origins.end());
      }
    }
    BounceSeries series(sets_.beyond);
    const auto with_bounces_so_far = [&](Tracer& tracer, const Receiver& where, std::uint32_t key) {
      return sample(tracer, where, key, kBeyondShare, samples);
    };
    for (std::int64_t round = 1; round < bounces && !series.converged(); ++round)
      series.add(context, places, key_, with_bounces_so_far);
    series.add_remaining();
    sets_.ambient = sets_.beyond.mean_irradiance();
  }

  /// Records where the eye sees surfaces, from a wide grid of pixels to all of them, and where probes and lightmaps measure.
  void cover_seen(PrepareContext& context, const auto& samples) {
    const auto exactly = [&](Tracer& tracer, const Receiver& where, std::uint32_t key) {
      return sample(tracer, where, key, 1, samples);
    };
    for (int stride = kWidestStride; stride > 0; stride /= 2) {
      const auto on_grid = [](int x, int y, int width) { return x % width == 0 && y % width == 0; };
      std::vector<Receiver> wanted = seen_receivers(
          context, node,
          [&](int x, int y) { return on_grid(x, y, stride) && (stride == kWidestStride || !on_grid(x, y, 2 * stride)); },
          [&](const Receiver& r) { return !sets_.seen.covers(r); });
      cover(context, sets_.seen, wanted, key_ + 1, exactly);
    }
    cover(context, sets_.seen, measured_receivers(context, node, std::numeric_limits<std::size_t>::max()), key_ + 1, exactly);
  }

 public:
  // State.
  std::uint32_t key_ = 0;  // of random numbers
  IrradianceRecordSets sets_{};
  std::optional<CacheKey> cache_key_{};
  bool wanted_ = true;
};

}  // namespace ln::ops
