#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/error.hpp"
#include "photon_scenes.hpp"

using namespace ln;
using namespace ln::test;

namespace {

/// A room with coloured walls, a mirror on one side, glossy floor and a lamp.
SceneData room(bool closed = true) {
  SceneBuilder b;
  b.quad({-0.5f, -0.5f, 0.5f}, {0.5f, -0.5f, 0.5f}, {0.5f, -0.5f, -0.5f}, {-0.5f, -0.5f, -0.5f}, b.glossy({0.6f, 0.5f, 0.4f}));
  b.quad({-0.5f, 0.5f, -0.5f}, {0.5f, 0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}, {-0.5f, 0.5f, 0.5f}, b.material({0.7f, 0.7f, 0.7f}));
  b.quad({-0.5f, -0.5f, -0.5f}, {0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, -0.5f}, {-0.5f, 0.5f, -0.5f}, b.mirror({0.9f, 0.9f, 0.9f}));
  b.quad({-0.5f, -0.5f, 0.5f}, {-0.5f, -0.5f, -0.5f}, {-0.5f, 0.5f, -0.5f}, {-0.5f, 0.5f, 0.5f},
         b.material({0.8f, 0.1f, 0.1f}));
  b.quad({0.5f, -0.5f, -0.5f}, {0.5f, -0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, -0.5f}, b.material({0.1f, 0.8f, 0.1f}));
  if (closed)
    b.quad({0.5f, -0.5f, 0.5f}, {-0.5f, -0.5f, 0.5f}, {-0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, b.material({0.5f, 0.5f, 0.5f}));
  b.quad({-0.1f, 0.45f, -0.1f}, {0.1f, 0.45f, -0.1f}, {0.1f, 0.45f, 0.1f}, {-0.1f, 0.45f, 0.1f},
         b.material({0, 0, 0}, {5, 4, 3}));
  return b.data;
}

template <class Via>
Photons trace(Stage& stage, std::uint64_t count) {
  return trace_photons(stage.context, 1, stage.scene.emitters(), path_automaton<Via>(), count);
}

double relative(double a, double b) { return std::abs(a - b) / std::max(std::abs(a), std::abs(b)); }

}  // namespace

TEST_CASE("directions and colours survive packing") {
  SampleStream random(7, 0);
  float worst = 0, worst_color = 0;
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    const Vec2 u = random.get2(0, i, 100'000);
    const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
    const Vec3 v(r * std::cos(2 * kPi * u.y), r * std::sin(2 * kPi * u.y), z);
    worst = std::max(worst, glm::length(unpack_unit(pack_unit(v)) - v));
    const Color c = Color(u.x, u.y, random.get1(1, i, 100'000)) * std::exp2(static_cast<float>(i % 200) - 120);
    worst_color = std::max(worst_color, max_component(glm::abs(PackedColor(c).unpack() - c)) / max_component(c));
  }
  CHECK(worst < 1e-4f);
  CHECK(worst_color <= 0x1p-18f);
  CHECK(PackedColor(Color(0)).unpack() == Color(0));
  CHECK(PackedColor(Color(1)).unpack() == Color(1));
  CHECK(PackedColor(Color(0x1.ffffffp0f)).unpack() == Color(2));  // rounds up to the next exponent
  CHECK(is_finite(PackedColor(Color(3e38f)).unpack()));
}

TEST_CASE("the ledger closes, and roulette is fair") {
  for (const bool closed : {true, false}) {
    Stage stage(room(closed));
    const Photons photons = trace<AnyPath>(stage, 200'000);
    const PhotonLedger& l = photons.ledger;
    CHECK(l.particles == 200'000);
    for (int c = 0; c < 3; ++c) {
      CAPTURE(c);
      CHECK(relative(l.emitted[c] + l.roulette_gain[c], l.absorbed[c] + l.escaped[c] + l.roulette_loss[c]) < 1e-12);
      CHECK(relative(l.emitted[c], stage.scene.emitters().total_power()[c]) < 1e-3);
      CHECK(std::abs(l.roulette_gain[c] - l.roulette_loss[c]) < 4 * std::sqrt(l.roulette_squares[c]));
      CHECK(l.roulette_gain[c] > 0);
      if (closed)
        CHECK(l.escaped[c] == 0);
      else
        CHECK(l.escaped[c] > 0.05 * l.emitted[c]);
    }
  }
}

TEST_CASE("in a closed diffuse box, the first hits carry all the light, and all hits its geometric series") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material({0.5f, 0.3f, 0.8f}, {1, 2, 3}));
  Stage stage(b.data);
  const DVec3 power = DVec3(1, 2, 3) * (6.0 * static_cast<double>(kPi));
  const Photons first = trace<EmptyPath>(stage, 50'000);
  CHECK(first.hits.size() == 50'000);
  const Photons all = trace<AnyPath>(stage, 200'000);
  const DVec3 series = power / (DVec3(1) - DVec3(0.5, 0.3, 0.8));
  for (int c = 0; c < 3; ++c) {
    CHECK(relative(total_flux(first)[c], power[c]) < 1e-5);
    CHECK(relative(total_flux(all)[c], series[c]) < 0.01);
  }
}

TEST_CASE("via = S+ keeps only what came by mirrors") {
  SceneBuilder b;
  b.quad({-1, -0.1f, 1}, {0, -0.1f, 1}, {0, -0.1f, -1}, {-1, -0.1f, -1}, b.mirror());  // left half of the floor: a mirror
  b.quad({0, -0.1f, 1}, {1, -0.1f, 1}, {1, -0.1f, -1}, {0, -0.1f, -1}, b.material(Color(0.5f)));  // right half: diffuse
  b.quad({-1, 0.5f, -1}, {1, 0.5f, -1}, {1, 0.5f, 1}, {-1, 0.5f, 1}, b.material(Color(0.5f)));
  b.quad({-0.2f, 0.4f, -0.2f}, {0.2f, 0.4f, -0.2f}, {0.2f, 0.4f, 0.2f}, {-0.2f, 0.4f, 0.2f}, b.material(Color(0), Color(1)));
  Stage stage(b.data);
  const Photons photons = trace<SpecularPath>(stage, 20'000);
  REQUIRE(!photons.hits.empty());
  for (const Photon& p : photons.hits) {
    CHECK(p.position.y > 0.3f);  // the ceiling, or the back of the lamp: nothing else can be hit from the mirror
    CHECK(unpack_unit(p.wi).y < 0);
  }
  const PhotonLedger& l = photons.ledger;
  CHECK(relative(l.emitted.x + l.roulette_gain.x, l.absorbed.x + l.escaped.x + l.roulette_loss.x) < 1e-12);
}

TEST_CASE("events that overlap are told apart exactly") {
  Stage stage(room());
  const Photons diffuse = trace<OneDiffuse>(stage, 400'000), glossy = trace<OneGlossy>(stage, 400'000);
  const Photons both = trace<OneSmooth>(stage, 400'000);
  for (int c = 0; c < 3; ++c) {
    CHECK(total_flux(glossy)[c] > 0);
    CHECK(relative(total_flux(diffuse)[c] + total_flux(glossy)[c], total_flux(both)[c]) < 0.005);
  }
}

TEST_CASE("same bits for any number of threads; other bits for another seed") {
  std::vector<Photons> runs;
  for (const int threads : {1, 2, 5}) {
    Stage stage(room(), threads);
    runs.push_back(trace<AnyPath>(stage, 30'001));
  }
  for (std::size_t i = 1; i < runs.size(); ++i) {
    REQUIRE(runs[i].hits.size() == runs[0].hits.size());
    CHECK(std::memcmp(runs[i].hits.data(), runs[0].hits.data(), runs[0].hits.size() * sizeof(Photon)) == 0);
    CHECK(runs[i].ledger.absorbed == runs[0].ledger.absorbed);
    CHECK(runs[i].ledger.roulette_squares == runs[0].ledger.roulette_squares);
  }
  Stage other(room(), 2, 2);
  CHECK(trace<AnyPath>(other, 30'001).hits.size() != runs[0].hits.size());
}

TEST_CASE("closed mirrors end by roulette") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.mirror());
  b.quad({-0.1f, 0.4f, -0.1f}, {0.1f, 0.4f, -0.1f}, {0.1f, 0.4f, 0.1f}, {-0.1f, 0.4f, 0.1f}, b.mirror());
  b.data.materials.back().emission = Color(1);
  Stage stage(b.data);
  const PhotonLedger l = trace<AnyPath>(stage, 1000).ledger;
  CHECK(relative(l.emitted.x + l.roulette_gain.x, l.absorbed.x + l.escaped.x + l.roulette_loss.x) < 1e-12);
}

TEST_CASE("more photons than memory holds are refused") {
  Stage stage(room());
  CHECK_THROWS_AS(trace<AnyPath>(stage, std::uint64_t{1} << 42), Error);
}

namespace {

struct AllButFirst {  // S*: what aiming must not be used for, as the empty path is one of it
  static constexpr int next[][3] = {{-1, -1, 0}};
  static constexpr bool accepting[] = {true};
};

/// Total flux (first channel) of the photons of each of `runs` seeds: mean and standard error.
struct Statistic {
  double mean = 0, error = 0;
};
template <class Measure>
Statistic over_seeds(const SceneData& data, const Image* environment, Measure&& measure) {
  constexpr int kRuns = 24;
  double sum = 0, sum2 = 0;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    Workers workers(2);
    const Scene scene(data, {}, 2, environment);
    PrepareContext context(scene, workers, seed, 4);
    const double x = measure(context, scene);
    sum += x;
    sum2 += x * x;
  }
  const double mean = sum / kRuns;
  return {mean, std::sqrt(std::max(sum2 / kRuns - mean * mean, 0.0) / (kRuns - 1))};
}

}  // namespace

TEST_CASE("aiming changes the number of photons behind mirrors, not their flux") {
  const auto base = [] {
    SceneBuilder b;
    b.quad({-0.7f, -0.5f, 0.7f}, {0.7f, -0.5f, 0.7f}, {0.7f, -0.5f, -0.7f}, {-0.7f, -0.5f, -0.7f}, b.material(Color(0.5f)));
    b.sphere({0.3f, -0.3f, 0.2f}, 0.15f, b.mirror(), false, 12);
    b.quad({-0.6f, -0.4f, -0.3f}, {-0.3f, -0.4f, -0.3f}, {-0.3f, -0.1f, -0.4f}, {-0.6f, -0.1f, -0.4f},
           b.mirror({0.9f, 0.5f, 0.4f}));
    return b;
  };
  Image sky;
  sky.width = 4, sky.height = 2, sky.channels = 3;
  sky.floats = {1, 1, 1, 2, 2, 2, 0.5f, 0.5f, 0.5f, 1, 1, 1, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0};
  for (const int kind : {0, 1, 2, 3, 4}) {
    CAPTURE(kind);
    SceneBuilder b = base();
    if (kind == 0) {
      b.quad({-0.1f, 0.5f, -0.1f}, {0.1f, 0.5f, -0.1f}, {0.1f, 0.5f, 0.1f}, {-0.1f, 0.5f, 0.1f},
             b.material({0, 0, 0}, {5, 4, 3}));
      b.data.materials.back().double_sided = true;
    }
    if (kind == 3) b.directional({0.3f, -1, 0.1f}, Color(2));
    if (kind == 1 || kind == 2) {
      PunctualLight light;
      light.kind = kind == 1 ? PunctualKind::point : PunctualKind::spot;
      light.position = {0, 0.4f, 0};
      light.direction = glm::normalize(Vec3(0.4f, -1, 0.2f));
      light.intensity = Color(3);
      light.cos_inner = 0.95f;
      light.cos_outer = 0.7f;
      b.data.lights.push_back(light);
    }
    double aimed_hits = 0, blind_hits = 0;
    const auto trace_with = [](PrepareContext& context, const Scene& scene, const PathAutomaton& via) {
      return trace_photons(context, 1, scene.emitters(), via, 4000);
    };
    const Image* environment = kind == 4 ? &sky : nullptr;
    const Statistic aimed = over_seeds(b.data, environment, [&](PrepareContext& context, const Scene& scene) {
      const Photons photons = trace_with(context, scene, path_automaton<SpecularPath>());
      aimed_hits += static_cast<double>(photons.hits.size());
      const PhotonLedger& l = photons.ledger;
      CHECK(relative(l.emitted.x + l.roulette_gain.x, l.absorbed.x + l.escaped.x + l.roulette_loss.x) < 1e-12);
      return total_flux(photons).x;
    });
    const Statistic blind = over_seeds(b.data, environment, [&](PrepareContext& context, const Scene& scene) {
      const Photons all = trace_with(context, scene, path_automaton<AllButFirst>()),
                    first = trace_with(context, scene, path_automaton<EmptyPath>());
      blind_hits += static_cast<double>(all.hits.size()) - static_cast<double>(first.hits.size());
      return total_flux(all).x - total_flux(first).x;
    });
    CHECK(aimed.mean > 0);
    CHECK(std::abs(aimed.mean - blind.mean) < 4 * std::hypot(aimed.error, blind.error));
    CHECK(blind.error < 0.05 * blind.mean);
    CHECK(aimed.error < 0.7 * blind.error);
    CHECK(aimed_hits > 1.5 * blind_hits);
  }
}

TEST_CASE("without anything specular, particles for S+ are not traced at all") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f), Color(1)));
  Stage stage(b.data);
  CHECK(trace<SpecularPath>(stage, 1000).hits.empty());
  CHECK(stage.context.rays(1, RayKind::photon) == 0);
}

TEST_CASE("secondary sources send out what they say, wherever they are bright") {
  SceneBuilder b;
  b.box(Vec3(-0.5f), Vec3(0.5f), b.material(Color(0.5f)), true, 1);
  Stage stage(b.data);
  const auto power = [&](const PathAutomaton& via, auto&& radiance) {
    const auto source = [&](Tracer&, const SampleStream&, const Interaction& at) {
      return at.front ? radiance(at.at.p) : Color(0);
    };
    const Photons photons = trace_secondary_photons(stage.context, 2, source, via, 100'000);
    const PhotonLedger& l = photons.ledger;
    CHECK(relative(l.emitted.x + l.roulette_gain.x, l.absorbed.x + l.escaped.x + l.roulette_loss.x) < 1e-12);
    CHECK(l.escaped.x == 0);
    CHECK(relative(l.emitted.x, total_flux(photons).x * (via.accepting[0] && via.next[0] < 0 ? 1 : 0.5)) < 0.01);
    return l.emitted.x;
  };
  const auto even = [](const Vec3&) { return Color(1, 2, 3); };
  const auto uneven = [](const Vec3& p) { return Color(p.x > 0.4f && p.y < -0.49f ? 100.0f : std::max(p.y, 0.0f)); };
  const auto pi = static_cast<double>(kPi);
  CHECK(power(path_automaton<EmptyPath>(), even) == doctest::Approx(6 * pi).epsilon(0.005));
  CHECK(power(path_automaton<AnyPath>(), even) == doctest::Approx(6 * pi).epsilon(0.005));
  // 100 on a strip of 0.1 x 1 of the floor and on 0.1 x 0.01 of two walls and 1 x 0.01 of a third; y on the ceiling and the
  // upper half of four walls.
  const double strip = 100 * (0.1 + 2 * 0.001 + 0.01), rest = 0.5 + 4 * 0.125;
  CHECK(power(path_automaton<EmptyPath>(), uneven) == doctest::Approx(pi * (strip + rest)).epsilon(0.01));
}

TEST_CASE("secondary sources that coincide count once") {
  SceneBuilder b;
  const std::uint32_t m = b.material(Color(0.5f));
  b.box(Vec3(-0.5f), Vec3(0.5f), m, true, 1);
  b.box(Vec3(-0.5f), Vec3(0.5f), m, true, 3);
  Stage stage(b.data);
  const auto source = [](Tracer&, const SampleStream&, const Interaction& at) { return Color(at.front ? 1.0f : 0.0f); };
  const Photons photons = trace_secondary_photons(stage.context, 2, source, path_automaton<EmptyPath>(), 100'000);
  CHECK(photons.ledger.emitted.x == doctest::Approx(6 * static_cast<double>(kPi)).epsilon(0.02));
}

TEST_CASE("secondary sources: a mirror's share of the light is not scattered diffusely; any number of threads, same photons") {
  std::vector<std::vector<Photon>> hits;
  for (const int threads : {1, 2, 5}) {
    Stage stage(room(), threads);
    const auto source = [](Tracer& tracer, const SampleStream& random, const Interaction& at) {
      CHECK(any(at.bsdf().events() & Events::D));
      static_cast<void>(tracer);
      return Color(random.get1(1, kOwn));
    };
    hits.push_back(trace_secondary_photons(stage.context, 2, source, path_automaton<AnyPath>(), 5'000).hits);
  }
  REQUIRE(hits[0].size() > 1000);
  for (int i : {1, 2}) {
    REQUIRE(hits[0].size() == hits[i].size());
    CHECK(std::memcmp(hits[0].data(), hits[i].data(), hits[0].size() * sizeof(Photon)) == 0);
  }
}
