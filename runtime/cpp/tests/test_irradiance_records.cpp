#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "ln/irradiance_records.hpp"

#include <doctest/doctest.h>

#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

Receiver receiver(const Vec3& p, const Vec3& n = Vec3(0, 1, 0)) {
  Receiver where;
  where.p = p;
  where.n = n;
  where.footprint = 1;
  return where;
}

IrradianceSample seen(float distance, float E = 1) {
  IrradianceSample sample;
  sample.irradiance = Color(E);
  sample.distance = distance;
  return sample;
}

Vec3 somewhere(std::uint32_t i) {
  const SampleStream random(3, i);
  const Vec2 u = random.get2(0, 0);
  return Vec3(1.8f * u.x - 0.9f, 0.02f * random.get1(0, 1), 1.8f * u.y - 0.9f);
}

std::vector<Receiver> many(std::uint32_t n) {
  std::vector<Receiver> places;
  for (std::uint32_t i = 0; i < n; ++i) places.push_back(receiver(somewhere(i)));
  return places;
}

float interpolated(const IrradianceRecords& records, const Vec3& p, const Vec3& n = Vec3(0, 1, 0)) {
  InterpolatedIrradiance mean(p, n);
  records.visit(p, n, IrradianceRecords::kOverlap, mean);
  return mean.value().x;
}

/// A wall, z = 0, that stands on a floor, y = 0: the floor is in shadow up to z = `kShadow`, and bright from there; the sky is
/// grey.
struct FootOfWall {
  static constexpr float kShadow = 0.04f, kFloor = 1, kSky = 0.2f;
  static constexpr std::uint32_t kDirections = 512;

  /// From a height h, the floor beyond z has the form factor h / (2 sqrt(h^2 + z^2)).
  static double irradiance(double height) {
    const double bright = 0.5 * height / std::sqrt(height * height + kShadow * kShadow);
    return static_cast<double>(kPi) * (0.5 * kSky + bright * kFloor);
  }

  static IrradianceSample sample(const Vec3& p, const Vec3& n, std::uint32_t key, float step) {
    const HemisphereGrid grid = HemisphereGrid::of(kDirections);
    const Frame frame = make_frame(n);
    std::vector<HemisphereCell> cells;
    for (int ring = 0; ring < grid.polar; ++ring) {
      for (int sector = 0; sector < grid.azimuth; ++sector) {
        const SampleStream random(key, static_cast<std::uint32_t>(cells.size()));
        const Vec3 w = frame.to_world(grid.direction(ring, sector, random.get2(0, 0)));
        const float distance = w.y < 0 ? -p.y / w.y : kInfinity;
        const float floor = distance * w.z > kShadow ? kFloor : 0;
        cells.push_back({Color(w.y < 0 ? floor : kSky), distance, w.y < 0 ? Vec3(0, -1 / p.y, 0) : Vec3(0)});
      }
    }
    return integrate(grid, cells, frame, step);
  }
};

SceneData any_scene() {
  SceneBuilder b;
  b.box(Vec3(-1), Vec3(1), b.material(Color(0.5f), Color(1)), true, 1);
  return b.data;
}

}  // namespace

TEST_CASE("the octree finds the records that a search of all finds") {
  const RecordSpacing spacing{0.2f, 0.01f, 0.2f};
  IrradianceRecords records(spacing);
  for (std::uint32_t i = 0; i < 300; ++i) records.add(receiver(somewhere(i)), seen(0.05f + 0.01f * static_cast<float>(i % 40)));
  int found_some = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const Vec3 p = somewhere(1000 + i), n(0, 1, 0);
    float expected = 0, trust = 0, found = 0;
    for (const IrradianceRecord& record : records.records()) {
      const Vec3 d = p - record.p;
      if (d.y < -0.02f * glm::length(d)) continue;  // behind the record
      const float e = std::sqrt(glm::dot(d, d) + sqr(4 * d.y)) / record.reach;
      const float depth = std::min(1.0f, record.exact / glm::length(d));
      if (e < 1.4f) expected += std::pow(1 - e / 1.4f, 3.0f) * depth;
      if (e < 1.4f) trust += (1 - e / 1.4f) * depth;
    }
    const float cover = records.visit(p, n, 1.4f, [&](const IrradianceRecord&, float w) { found += w; });
    CHECK(found == doctest::Approx(expected).epsilon(1e-4));
    CHECK(cover == doctest::Approx(trust).epsilon(1e-4));
    found_some += found > 0;
  }
  CHECK(found_some > 100);
}

TEST_CASE(
    "reach: the allowed error times the distance, within bounds; less where irradiance changes fast or a neighbour is near a "
    "wall") {
  const RecordSpacing spacing{0.2f, 0.02f, 0.3f};
  const auto reach = [&](const IrradianceSample& sample) {
    IrradianceRecords records(spacing);
    records.add(receiver(Vec3(0)), sample);
    return records.records()[0].reach;
  };
  CHECK(reach(seen(1)) == doctest::Approx(0.2));
  CHECK(reach(seen(1e-3f)) == doctest::Approx(0.02));
  CHECK(reach(seen(kInfinity)) == doctest::Approx(0.3));
  IrradianceSample steep = seen(1);
  for (int c = 0; c < 3; ++c) steep.translation[c] = Vec3(2, 0, 0);
  CHECK(reach(steep) == doctest::Approx(0.1));

  IrradianceRecords records(spacing);
  records.add(receiver(Vec3(0)), seen(1));
  records.add(receiver(Vec3(0.1f, 0, 0)), seen(0.2f));
  CHECK(records.records()[0].reach == doctest::Approx(0.2f * 0.3f));
  records.add(receiver(Vec3(0.05f, 0, 0)), seen(1));
  CHECK(records.records()[2].reach == doctest::Approx(0.2f * 0.25f));
}

TEST_CASE("records of another side or another level are not used") {
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  records.add(receiver(Vec3(0)), seen(1));
  CHECK(records.covers(receiver(Vec3(0.15f, 0, 0))));
  CHECK_FALSE(records.covers(receiver(Vec3(0), Vec3(0, -1, 0))));
  CHECK_FALSE(records.covers(receiver(Vec3(0, 0.1f, 0))));
  CHECK(records.covers(receiver(Vec3(0.1f, 0.01f, 0))));
  CHECK_FALSE(records.covers(receiver(Vec3(0.1f, -0.01f, 0))));  // behind it
}

TEST_CASE("records above a lamp that faces as they do are not used on the lamp") {
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  Receiver where = receiver(Vec3(0));
  where.above = 4e-3f;
  records.add(where, seen(1));
  where.p = Vec3(1e-3f, 0, 0);
  CHECK(records.covers(where));
  where.p.y = 4e-3f;
  where.above = 1;
  CHECK_FALSE(records.covers(where));
}

TEST_CASE("records are not used through a wall that they saw, whatever its angle; nor missed before it") {
  constexpr int kSectors = 24;
  constexpr float kWall = 0.1f;  // distance
  const Frame frame = make_frame(Vec3(0, 1, 0));
  for (const float turn : {0.0f, 0.4f, 2.5f}) {
    IrradianceSample sample = seen(1);
    for (int i = 0; i < kSectors; ++i)
      sample.horizon.push_back(std::max(std::cos((static_cast<float>(i) + 0.5f) * 2 * kPi / kSectors - turn), 0.0f) / kWall);
    IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
    records.add(receiver(Vec3(0)), sample);
    const Vec3 across = frame.s * std::cos(turn) + frame.t * std::sin(turn);
    const Vec3 along = frame.t * std::cos(turn) - frame.s * std::sin(turn);
    for (int i = -10; i <= 10; ++i) {
      const Vec3 at_wall = kWall * across + 0.015f * static_cast<float>(i) * along;
      const bool near = glm::length(at_wall) < 0.19f;  // within its reach
      CHECK(records.covers(receiver(0.95f * at_wall)) == near);
      CHECK_FALSE(records.covers(receiver(1.05f * at_wall)));
      CHECK(records.covers(receiver(-at_wall)) == near);
    }
  }
}

TEST_CASE("records from outside of a gap that they did not see are no cover in it, and give way to one that is made there") {
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  records.add(receiver(Vec3(0)), seen(1));
  Receiver open = receiver(Vec3(0.1f, 0, 0)), inside = open;
  open.above = 1;
  inside.above = 0.05f;
  CHECK(records.covers(open));
  CHECK_FALSE(records.covers(inside));
  records.add(inside, seen(1));
  CHECK(records.covers(inside));
  CHECK(records.records()[0].reach < 0.2f * 0.21f);
}

TEST_CASE("a dark record in a gap, used farther away than it should be, gives way to its neighbours") {
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  records.add(receiver(Vec3(0)), seen(1e-3f, 0));
  records.add(receiver(Vec3(0.03f, 0, 0)), seen(1, 1));
  const auto irradiance = [&](const Vec3& p) {
    float sum = 0, weight = 0;
    records.visit(p, Vec3(0, 1, 0), IrradianceRecords::kOverlap, [&](const IrradianceRecord& record, float w) {
      sum += w * record.sample.irradiance.x;
      weight += w;
    });
    return sum / weight;
  };
  CHECK(irradiance(Vec3(0)) < 0.2f);
  CHECK(irradiance(Vec3(0.012f, 0, 0)) > 0.9f);
}

TEST_CASE("a dark record in a gap, alone and far out of its depth, is no cover") {
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  records.add(receiver(Vec3(0)), seen(1e-3f, 0));
  const auto cover = [&](const Vec3& p) {
    return records.visit(p, Vec3(0, 1, 0), IrradianceRecords::kOverlap, [](const IrradianceRecord&, float) {});
  };
  CHECK(cover(Vec3(0)) > IrradianceRecords::kEnough);
  CHECK(cover(Vec3(0.015f, 0, 0)) > 0);
  CHECK(cover(Vec3(0.015f, 0, 0)) < IrradianceRecords::kEnough);
  CHECK_FALSE(records.covers(receiver(Vec3(0.015f, 0, 0))));
}

TEST_CASE("records where irradiance is curved, as towards corners, hardly brighten it") {
  // E = 1 - x^2 / 2, with exact gradients: each record's tangent lies above it.
  const auto E = [](float x) { return 1 - 0.5f * x * x; };
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  for (int i = -6; i <= 6; ++i) {
    const float x = 0.15f * static_cast<float>(i);
    IrradianceSample sample = seen(1, E(x));
    for (int c = 0; c < 3; ++c) sample.translation[c] = Vec3(-x, 0, 0);
    records.add(receiver(Vec3(x, 0, 0)), sample);
  }
  double bias = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 p(-0.5f + 0.01f * static_cast<float>(i), 0, 0);
    bias += static_cast<double>(interpolated(records, p) - E(p.x)) / 100;
  }
  CHECK(std::abs(bias) < 2e-4);
}

TEST_CASE("at the foot of a wall, in a narrow shadow, light grows upwards evenly: no dark record is used far above its place") {
  const RecordSpacing spacing{0.2f, 0.1f, 0.3f};
  const Vec3 n(0, 0, 1);
  std::vector<Receiver> wanted;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 100; ++x)
      wanted.push_back(receiver(Vec3(0.01f * (static_cast<float>(x) + 0.5f), 0.01f * (static_cast<float>(y) + 0.5f), 0), n));
  Stage stage(any_scene());
  constexpr std::uint32_t kSeeds = 20;
  double sum = 0, squares = 0;  // of the seeds' mean square errors
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    IrradianceRecords records(spacing);
    cover(stage.context, records, wanted, seed, [&](Tracer&, const Receiver& where, std::uint32_t key) {
      return FootOfWall::sample(where.p, where.n, key, IrradianceRecords::kOverlap * spacing.least_reach(where));
    });
    double error = 0;
    std::size_t count = 0;
    for (const Receiver& where : wanted) {
      if (where.p.y > spacing.closest) continue;
      error += sqr(static_cast<double>(interpolated(records, where.p, n)) / FootOfWall::irradiance(where.p.y) - 1);
      ++count;
    }
    sum += error / static_cast<double>(count);
    squares += sqr(error / static_cast<double>(count));
  }
  // It is 0.23 with tangents alone, limited by the reach, and as little cover as reading wants.
  const double mean = sum / kSeeds, standard_error = std::sqrt((squares / kSeeds - sqr(mean)) / (kSeeds - 1));
  CHECK(mean + 3 * standard_error < 0.19);
}

TEST_CASE("a gradient is limited by the surroundings, not by how far the record is used") {
  IrradianceRecords records(RecordSpacing{0.2f, 0.02f, 0.3f});
  IrradianceSample steep = seen(0.05f);  // allows a reach of 0.01
  for (int c = 0; c < 3; ++c) steep.translation[c] = Vec3(18, 30, 0) * (c == 0 ? 1.0f : 0.5f);
  records.add(receiver(Vec3(0)), steep);
  const IrradianceRecord& record = records.records()[0];
  CHECK(record.reach == doctest::Approx(0.02f));
  CHECK(glm::length(record.sample.translation[0]) == doctest::Approx(1 / (record.exact / 0.2f)));
  CHECK(glm::length(record.sample.translation[1]) == doctest::Approx(0.5f * std::hypot(18.0f, 30.0f)));
}

TEST_CASE("covering: all places are covered, sparsely, the same for any number of threads") {
  const std::vector<Receiver> wanted = many(3000);
  std::vector<float> first;
  for (const int threads : {1, 2, 5}) {
    Stage stage(any_scene(), threads);
    IrradianceRecords records(RecordSpacing{});
    const std::vector<Receiver> places =
        cover(stage.context, records, wanted, 7, [&](Tracer&, const Receiver& where, std::uint32_t key) {
          return seen(0.3f + 0.2f * where.p.x, 1 + 0.1f * to_unit_float(key));
        });
    REQUIRE(places.size() == records.size());
    CHECK(records.size() < wanted.size() / 2);
    for (const Receiver& where : wanted) CHECK(records.covers(where));
    std::vector<float> values;
    for (std::size_t i = 0; i < places.size(); ++i) {
      CHECK(records.records()[i].p == places[i].p);
      values.push_back(records.records()[i].sample.irradiance.x);
      values.push_back(records.records()[i].reach);
    }
    if (first.empty()) first = values;
    CHECK(values == first);
  }
}

TEST_CASE("bounces: E = 1 + E / 2 from a few rounds and the rest of the series") {
  Stage stage(any_scene());
  IrradianceRecords records(RecordSpacing{});
  const auto bounce = [&](Tracer&, const Receiver&, std::uint32_t) { return seen(1, 1 + 0.5f * records.mean_irradiance().x); };
  const std::vector<Receiver> places =
      cover(stage.context, records, many(50), 7, [&](Tracer&, const Receiver&, std::uint32_t) { return seen(1, 1); });
  BounceSeries series(records);
  for (int round = 0; round < 2; ++round) series.add(stage.context, places, 7, bounce);
  CHECK(records.mean_irradiance().x == doctest::Approx(1.75));
  CHECK_FALSE(series.converged());
  series.add_remaining();
  CHECK(records.mean_irradiance().x == doctest::Approx(2));
}
