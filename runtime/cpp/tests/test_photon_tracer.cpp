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
  b.quad({-0.5f, -0.5f, 0.5f}, {-0.5f, -0.5f, -0.5f}, {-0.5f, 0.5f, -0.5f}, {-0.5f, 0.5f, 0.5f}, b.material({0.8f, 0.1f, 0.1f}));
  b.quad({0.5f, -0.5f, -0.5f}, {0.5f, -0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, -0.5f}, b.material({0.1f, 0.8f, 0.1f}));
  if (closed) b.quad({0.5f, -0.5f, 0.5f}, {-0.5f, -0.5f, 0.5f}, {-0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, b.material({0.5f, 0.5f, 0.5f}));
  b.quad({-0.1f, 0.45f, -0.1f}, {0.1f, 0.45f, -0.1f}, {0.1f, 0.45f, 0.1f}, {-0.1f, 0.45f, 0.1f}, b.material({0, 0, 0}, {5, 4, 3}));
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
      if (closed) CHECK(l.escaped[c] == 0);
      else CHECK(l.escaped[c] > 0.05 * l.emitted[c]);
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
  b.quad({-1, -0.1f, 1}, {0, -0.1f, 1}, {0, -0.1f, -1}, {-1, -0.1f, -1}, b.mirror());           // left half of the floor: a mirror
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
