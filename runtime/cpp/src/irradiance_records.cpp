#include "ln/irradiance_records.hpp"

#include <numeric>

#include "ln/diffuse_surface.hpp"
#include "ln/distribution.hpp"
#include "ln/patches.hpp"
#include "ln/receiver.hpp"

namespace ln {

namespace {

/// Gradients that are steeper than the surroundings allow come from noise, or from something that is very near.
void limit_gradients(IrradianceSample& sample, float surroundings) {
  for (int c = 0; c < 3; ++c) {
    const float steepest = sample.irradiance[c] / surroundings, found = glm::length(sample.translation[c]);
    if (found > steepest) sample.translation[c] *= steepest / found;
  }
}

/// a + factor * b, but for the distance.
IrradianceSample combined(const IrradianceSample& a, const Color& factor, const IrradianceSample& b) {
  IrradianceSample sum = a;
  sum.irradiance += factor * b.irradiance;
  for (int c = 0; c < 3; ++c) {
    sum.rotation[c] += factor[c] * b.rotation[c];
    sum.translation[c] += factor[c] * b.translation[c];
  }
  return sum;
}

/// Longest side of the scene's bounding box [normalised units].
float scene_size(const SceneData& data) {
  Vec3 low(kInfinity), high(-kInfinity);
  for (const Vec3& p : data.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return data.positions.empty() ? 2.0f : max_component(high - low);
}

/// A receiver that is not seen in a picture.
Receiver receiver_on(const Scene& scene, const Hit& hit, bool front, float footprint) {
  const Interaction at(scene, hit, front, white_receiver());
  return {hit, front, at.at.p, at.frame.n, footprint};
}

/// Distance of what is straight above the surface.
float distance_above(Tracer& tracer, NodeId node, const Interaction& at) {
  const Vec3 up = at.front ? at.at.ng : -at.at.ng;
  return tracer.intersect(spawn_ray(at.at, up), 0, node, RayKind::gather).t;
}

/// Random numbers of record `index`.
std::uint32_t record_key(std::uint32_t key, std::size_t index) { return hash32(key, static_cast<std::uint32_t>(index)); }

}  // namespace

void IrradianceRecords::add(const Receiver& where, const IrradianceSample& sample) {
  IrradianceRecord record{where.p, where.n, 0, 0, kInfinity, where.above, sample};
  for (const float inverse : sample.horizon) record.clear = std::min(record.clear, 1 / inverse);

  // Where irradiance changes fast, the record reaches less far.
  const Color E = sample.irradiance;
  const float slope = glm::length(sample.translation * Vec3(1)), sum = E.x + E.y + E.z;
  float distance = std::min(sample.distance, slope > 0 ? sum / slope : kInfinity);
  // No record reaches past the edge of what it sees: there may be a gap behind.
  distance = std::min(distance, sample.nearest / spacing_.error);
  for_near(record.p, record.n, kFar, [&](const IrradianceRecord& near) {
    if (glm::dot(near.n, record.n) > 0.5f)
      distance = std::min(distance, near.sample.distance + glm::distance(near.p, record.p));
    return false;
  });
  const float low = spacing_.least_reach(where), high = spacing_.farthest * where.footprint;
  record.exact = std::clamp(std::min(spacing_.error * distance, high), least_exact(where), reach_below(where));
  record.reach = std::max(record.exact, low);
  record.sample.distance = record.reach / spacing_.error;
  limit_gradients(record.sample, surroundings(record));

  for_near(record.p, record.n, kFar, [&](const IrradianceRecord& near) {
    if (glm::dot(near.n, record.n) <= 0.5f) return false;
    IrradianceRecord& other = records_[static_cast<std::size_t>(&near - records_.data())];
    const float limit = record.sample.distance + glm::distance(near.p, record.p);
    other.exact = std::min(other.exact, spacing_.error * limit);
    if (other.sample.distance > limit) {
      other.reach = std::max(spacing_.error * limit, low);
      other.sample.distance = other.reach / spacing_.error;
    }
    limit_gradients(other.sample, surroundings(other));
    return false;
  });
  restore(record, record.reach);
}

void IrradianceRecords::restore(const IrradianceRecord& record, float first_reach) {
  insert({record.p, first_reach, record.n, static_cast<std::uint32_t>(records_.size())}, 0, Vec3(0), 1);
  records_.push_back(record);
}

std::vector<float> IrradianceRecords::first_reaches() const {
  std::vector<float> reaches(records_.size());
  for (const Node& node : nodes_)
    for (const Entry& entry : node.entries) reaches[entry.record] = entry.reach;
  return reaches;
}

void IrradianceRecords::set_value(std::size_t index, const IrradianceSample& sample) {
  IrradianceRecord& record = records_[index];
  const float distance = record.sample.distance;
  record.sample = sample;
  record.sample.distance = distance;
  limit_gradients(record.sample, surroundings(record));
}

Color IrradianceRecords::mean_irradiance() const {
  DVec3 sum(0);
  for (const IrradianceRecord& record : records_) sum += DVec3(record.sample.irradiance);
  return records_.empty() ? Color(0) : Color(sum / static_cast<double>(records_.size()));
}

bool IrradianceRecords::beyond_horizon(const IrradianceRecord& record, const Vec3& p) {
  const Frame frame = make_frame(record.n);
  const Vec3 d = p - record.p;
  const float x = glm::dot(d, frame.s), y = glm::dot(d, frame.t);
  // Interpolated linearly, which fits walls: their inverse distance goes with the cosine.
  const std::vector<float>& horizon = record.sample.horizon;
  const auto sectors = static_cast<float>(horizon.size());
  float at = std::atan2(y, x) * (sectors / (2 * kPi)) - 0.5f;
  if (at < 0) at += sectors;
  const std::size_t first = std::min(static_cast<std::size_t>(at), horizon.size() - 1), second = (first + 1) % horizon.size();
  return std::sqrt(x * x + y * y) * glm::mix(horizon[first], horizon[second], at - static_cast<float>(first)) > 1;
}

bool IrradianceRecords::covers(const Receiver& where) const {
  const float known = reach_below(where);
  float sum = 0;
  for_near(where.p, where.n, 1, [&](const IrradianceRecord& record) {
    const float e = error(record, where.p, where.n);
    const bool knows = record.exact <= known + spacing_.error * glm::distance(where.p, record.p);
    if (e < 1 && knows && !hidden(record, where.p)) sum += cover_by(record, where.p, e, kOverlap);
    return sum > kWanted;
  });
  return sum > kWanted;
}

/// A record is in all cells that it may reach of the level whose cells are just as wide as that.
void IrradianceRecords::insert(const Entry& entry, std::int32_t node, const Vec3& centre, float half) {
  constexpr float kSmallest = 0x1p-20f;
  const float reach = kFar * entry.reach;
  if (half < 2 * reach || half < kSmallest) {
    nodes_[node].entries.push_back(entry);
    return;
  }
  const float quarter = 0.5f * half;
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3 middle =
        centre + Vec3(octant & 1 ? quarter : -quarter, octant & 2 ? quarter : -quarter, octant & 4 ? quarter : -quarter);
    const Vec3 off = glm::max(glm::abs(entry.p - middle) - quarter, Vec3(0));
    if (glm::dot(off, off) > sqr(reach)) continue;
    if (nodes_[node].children[octant] < 0) {
      nodes_[node].children[octant] = static_cast<std::int32_t>(nodes_.size());
      nodes_.emplace_back();
    }
    insert(entry, nodes_[node].children[octant], middle, quarter);
  }
}

std::vector<Receiver> cover(PrepareContext& context, IrradianceRecords& records, const std::vector<Receiver>& wanted,
                            std::uint32_t key, SampleIrradiance sample) {
  constexpr std::size_t kSmallestBatch = 64;

  std::vector<Receiver> places;
  std::vector<std::uint32_t> left(wanted.size());
  std::iota(left.begin(), left.end(), 0u);
  std::sort(left.begin(), left.end(),
            [](std::uint32_t a, std::uint32_t b) { return hash32(a) < hash32(b); });  // a bijection: no ties
  std::vector<char> covered;
  while (true) {
    covered.assign(left.size(), 0);
    context.for_chunks(left.size(), 256, [&](std::size_t begin, std::size_t end, Tracer&) {
      for (std::size_t i = begin; i < end; ++i) covered[i] = records.covers(wanted[left[i]]);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < left.size(); ++i)
      if (!covered[i]) left[kept++] = left[i];
    left.resize(kept);
    if (left.empty()) return places;

    // A batch that is small beside what there is: its own records hardly overlap.
    const std::size_t batch = std::min(left.size(), std::max(kSmallestBatch, records.size() / 4));
    std::vector<IrradianceSample> samples(batch);
    const std::size_t first = records.size();
    context.parallel_for(batch, [&](Tracer& tracer, std::size_t i) {
      samples[i] = sample(tracer, wanted[left[i]], record_key(key, first + i));
    });
    for (std::size_t i = 0; i < batch; ++i) {
      records.add(wanted[left[i]], samples[i]);
      places.push_back(wanted[left[i]]);
    }
    left.erase(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(batch));
  }
}

BounceSeries::BounceSeries(IrradianceRecords& records) : records_(records) {
  for (const IrradianceRecord& record : records.records()) {
    last_.push_back(record.sample);
    last_sum_ += DVec3(record.sample.irradiance);
  }
}

void BounceSeries::add(PrepareContext& context, const std::vector<Receiver>& places, std::uint32_t key,
                       SampleIrradiance sample) {
  std::vector<IrradianceSample> samples(records_.size());
  context.parallel_for(samples.size(),
                       [&](Tracer& tracer, std::size_t i) { samples[i] = sample(tracer, places[i], record_key(key, i)); });
  const DVec3 before = last_sum_;
  last_sum_ = DVec3(0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    last_[i] = combined(samples[i], Color(-1), records_.records()[i].sample);
    last_sum_ += DVec3(last_[i].irradiance);
    records_.set_value(i, samples[i]);
  }
  constexpr double kLargest = 0.95;  // a mean albedo that is not exceeded
  for (int c = 0; c < 3; ++c) ratio_[c] = before[c] > 0 ? std::clamp(last_sum_[c] / before[c], 0.0, kLargest) : 0;
}

bool BounceSeries::converged() const {
  constexpr double kNegligible = 2e-3;
  DVec3 sum(0);
  for (const IrradianceRecord& record : records_.records()) sum += DVec3(record.sample.irradiance);
  return last_sum_.x + last_sum_.y + last_sum_.z <= kNegligible * (sum.x + sum.y + sum.z);
}

void BounceSeries::add_remaining() {
  const Color factor(ratio_ / (1.0 - ratio_));
  for (std::size_t i = 0; i < last_.size(); ++i)
    records_.set_value(i, combined(records_.records()[i].sample, factor, last_[i]));
}

std::vector<Receiver> seen_receivers(PrepareContext& context, NodeId node, FunctionRef<bool(int x, int y)> choose,
                                     FunctionRef<bool(const Receiver&)> keep) {
  constexpr std::uint32_t kMostSpecular = 16;
  const View& view = context.view();
  const auto follow = [&](Tracer& tracer, int x, int y, std::vector<Receiver>& found) {
    Ray ray = view.rays.ray(Vec2(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
    const SampleStream random(hash32(hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)),
                                     static_cast<std::uint32_t>(context.seed())),
                              0);
    float distance = 0;
    for (std::uint32_t depth = 0; depth < kMostSpecular; ++depth) {
      const Hit hit = tracer.intersect(ray, random.bits(depth, kCoverage + 1), node, RayKind::camera);
      if (!hit.found()) return;
      const Interaction at(context.scene(), ray, hit);
      distance += hit.t;
      if (any(at.bsdf().events() & Events::D)) {
        const Receiver receiver{
            hit, at.front, at.at.p, at.frame.n, view.rays.height_at(distance), distance_above(tracer, node, at)};
        if (keep(receiver)) found.push_back(receiver);
      }
      Request<Events::S> request(tracer, random, at, Color(1), depth + 1, RayKind::camera);
      const BsdfRay* sample = request.sample();
      if (!sample) return;
      ray = sample->ray;
    }
  };
  std::vector<std::vector<Receiver>> rows(static_cast<std::size_t>(view.height));
  context.parallel_for(rows.size(), [&](Tracer& tracer, std::size_t y) {
    for (int x = 0; x < view.width; ++x)
      if (choose(x, static_cast<int>(y))) follow(tracer, x, static_cast<int>(y), rows[y]);
  });
  std::vector<Receiver> all;
  for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
  return all;
}

std::vector<Receiver> measured_receivers(PrepareContext& context, NodeId node, std::size_t most) {
  const float size = scene_size(context.scene().data());
  const std::vector<MeasuredPlace> places = context.view().measured();
  const std::size_t step = 1 + places.size() / most;
  std::vector<Receiver> found((places.size() + step - 1) / step);
  context.for_chunks(found.size(), 256, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    for (std::size_t i = begin; i < end; ++i) {
      const MeasuredPlace& place = places[i * step];
      const Interaction at(context.scene(), place.hit, place.front, white_receiver());
      found[i] = {place.hit, place.front, at.at.p, at.frame.n, size, distance_above(tracer, node, at)};
    }
  });
  return found;
}

std::vector<Receiver> spread_receivers(PrepareContext& context, std::uint32_t count) {
  const Scene& scene = context.scene();
  const Patches patches(scene.data());
  std::vector<double> areas(patches.face_count());
  for (std::uint32_t face = 0; face < patches.face_count(); ++face)
    if (scatters_diffusely(scene, patches.part(face / 2), Patches::is_front(face)))
      areas[face] = static_cast<double>(area(patches.surface(face / 2)));
  const Distribution by_area(areas);
  const float size = scene_size(scene.data());
  std::vector<Receiver> found;
  for (std::uint32_t i = 0; i < count && !by_area.empty(); ++i) {
    const SampleStream random(hash32(static_cast<std::uint32_t>(context.seed()), count), i);
    const std::uint32_t face =
        by_area.sample((static_cast<float>(i) + random.get1(0, kRoulette)) / static_cast<float>(count)).index;
    const Hit hit = patches.hit(face / 2, patches.domain(face / 2).point(random.get2(0, kOwn)));
    found.push_back(receiver_on(scene, hit, Patches::is_front(face), size));
  }
  return found;
}

}  // namespace ln
