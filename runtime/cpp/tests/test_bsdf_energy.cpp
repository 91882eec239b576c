// Energy: what the BSDFs scatter, measured through their own sampling, against what they receive.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <cstdio>
#include <memory>
#include <string>

#include "ln/bsdf.hpp"
#include "ln/dielectric_table.hpp"
#include "ln/sampling.hpp"

using namespace ln;

namespace {

struct Albedo {
  Color mean{0};
  float error = 0;  // standard error of its most uncertain channel, as for independent samples
};

/// Mean weight of samples: the albedo. Also checks that every weight is a finite, non-negative number.
Albedo measure(const Bsdf& bsdf, const Vec3& wo, std::uint32_t samples, Events mask = Events::all) {
  glm::dvec3 sum{0}, squares{0};
  for (std::uint32_t k = 0; k < samples; k++) {
    const SampleStream random(1, k);
    BsdfSample s;
    if (!bsdf.sample(wo, random.get1(0), random.get2(1), mask, Carried::flux, s)) continue;
    if (!is_finite(s.weight) || min_component(s.weight) < 0) FAIL("bad weight ", s.weight.x, " ", s.weight.y, " ", s.weight.z);
    const glm::dvec3 w(s.weight);
    sum += w;
    squares += w * w;
  }
  const glm::dvec3 mean = sum / static_cast<double>(samples);
  const glm::dvec3 variance = glm::max(squares / static_cast<double>(samples) - mean * mean, glm::dvec3(0));
  return {Color(mean), static_cast<float>(std::sqrt(glm::max(variance.x, glm::max(variance.y, variance.z)) / samples))};
}

Vec3 at_angle(float degrees) {
  const double a = degrees * 3.14159265358979 / 180;
  return {static_cast<float>(std::sin(a)), 0, static_cast<float>(std::cos(a))};
}

struct Furnace {
  const char* name;
  BsdfParameters parameters;
};

std::vector<Furnace> white_materials() {
  BsdfParameters metal{.metallic = 1}, plastic{}, diamond{.ior = 2.4f}, thin{.transmission = 1},
      solid{.transmission = 1, .solid = true};
  BsdfParameters half{.metallic = 0.5f, .transmission = 0.5f, .solid = true};
  BsdfParameters bare{.specular = 0}, tinted_coat{.specular = 0.7f, .specular_color = {1, 0.5f, 0}};
  BsdfParameters coated_solid{.specular = 0.5f, .specular_color = {1, 0.5f, 0}, .transmission = 1, .solid = true};
  BsdfParameters dense_solid{.ior = 2.4f, .transmission = 1, .solid = true},
      airy_solid{.ior = 1.1f, .transmission = 1, .solid = true};
  return {{"metal", metal},
          {"plastic", plastic},
          {"diamond plastic", diamond},
          {"thin glass", thin},
          {"solid glass", solid},
          {"half metal half glass", half},
          {"Lambert", bare},
          {"tinted coat", tinted_coat},
          {"coated glass", coated_solid},
          {"dense glass", dense_solid},
          {"airy glass", airy_solid}};
}

const float kRoughness[] = {0,    1e-4f, 1e-3f, 0.01f, 0.0101f, 0.011f, 0.02f, 0.05f, 0.1f, 0.15f,
                            0.2f, 0.3f,  0.4f,  0.5f,  0.6f,    0.7f,   0.8f,  0.9f,  1};
const float kAngles[] = {0, 15, 30, 41.8f, 45, 60, 70, 80, 85, 88, 89, 89.5f, 89.9f};

/// Bounds on an albedo that is measured with an error: 4.5 standard errors are exceeded by chance once in 300,000 cases.
constexpr float kSigmas = 4.5f;

/// White furnace over materials, roughnesses, angles and sides: every albedo within 0.5 % of 1 and never above 1.001.
void furnace(std::uint32_t samples) {
  for (Furnace m : white_materials()) {
    float least = 2, most = 0;
    std::string least_at, most_at;
    for (const float roughness : kRoughness) {
      m.parameters.roughness = roughness;
      std::unique_ptr<DielectricTable> table;
      if (m.parameters.solid) table = std::make_unique<DielectricTable>(m.parameters.ior, roughness, roughness);
      for (const bool outside : {true, false}) {
        if (!outside && !m.parameters.solid) continue;
        const Bsdf bsdf(m.parameters, outside, table.get());
        for (const float angle : kAngles) {
          const Albedo albedo = measure(bsdf, at_angle(angle), samples);
          const std::string at =
              "roughness " + std::to_string(roughness) + " angle " + std::to_string(angle) + (outside ? "" : " inside");
          const float low = min_component(albedo.mean), high = max_component(albedo.mean);
          CHECK_MESSAGE(low + kSigmas * albedo.error >= 0.995f, m.name << " " << at);
          CHECK_MESSAGE(high - kSigmas * albedo.error <= 1.001f, m.name << " " << at);
          if (low < least) least = low, least_at = at;
          if (high > most) most = high, most_at = at;
        }
      }
    }
    MESSAGE(std::string(m.name) << ": least " << least << " at " << least_at << ", most " << most << " at " << most_at);
  }
}

/// A parameter in [0, 1] that is often at its ends, where most materials live.
float share(float u) { return u < 0.2f ? 0 : u > 0.8f ? 1 : (u - 0.2f) / 0.6f; }

/// Any material from valid factors scatters no more than it receives.
void energy_bound(std::uint32_t materials, std::uint32_t samples, std::uint32_t directions) {
  float most = 0;
  std::vector<std::unique_ptr<DielectricTable>> tables;
  for (const float ior : {1.01f, 1.2f, 1.5f, 2.4f}) tables.push_back(std::make_unique<DielectricTable>(ior));
  const float iors[] = {1.01f, 1.2f, 1.5f, 2.4f};
  for (std::uint32_t i = 0; i < materials; i++) {
    const SampleStream random(7, i);
    const auto u = [&](std::uint32_t d) { return random.get1(d); };
    BsdfParameters p;
    const bool white = u(20) < 0.5f;
    p.base_color = white ? Color(1) : Color(u(0), u(1), u(2));
    p.metallic = share(u(3));
    p.roughness = share(u(4)) * share(u(5));
    p.specular = share(u(6));
    p.specular_color = white ? Color(1) : 2.0f * Color(u(7), u(8), u(9));
    const auto which = static_cast<std::size_t>(u(10) * 4);
    p.ior = iors[which];
    p.transmission = share(u(11));
    p.solid = u(12) < 0.5f;
    for (std::uint32_t d = 0; d < directions; d++) {
      const float z = 1 - random.get1(30 + d) * 0.9999f;
      const Vec3 wo(std::sqrt(1 - z * z), 0, z);
      const Bsdf bsdf(p, random.get1(13) < 0.5f, tables[which].get());
      // Few samples tell little about their own error: look closer before believing an excess.
      float bound = 2;
      for (std::uint32_t n = samples; bound > 1.001f && n <= 1u << 18; n *= 16) {
        const Albedo albedo = measure(bsdf, wo, n);
        bound = max_component(albedo.mean) - kSigmas * albedo.error;
      }
      most = std::max(most, bound);
      CHECK_MESSAGE(bound <= 1.001f, "material " << i << " roughness " << p.roughness << " cosine " << z);
      // The model's own idea of its albedo must not create energy either.
      CHECK(max_component(bsdf.albedo(wo)) <= 1.001f);
    }
  }
  MESSAGE("largest lower bound of an albedo: " << most);
}

}  // namespace

TEST_CASE("white furnace") { furnace(2048); }
TEST_CASE("white furnace, many samples" * doctest::skip()) { furnace(1 << 17); }
TEST_CASE("energy bound of random materials") { energy_bound(10000, 64, 3); }
TEST_CASE("energy bound of random materials, many samples" * doctest::skip()) { energy_bound(10000, 2048, 10); }

TEST_CASE("special cases are exact") {
  const Color red(0.8f, 0.2f, 0.1f);
  const Vec3 wo = at_angle(35), wi = glm::normalize(Vec3(-0.3f, 0.5f, 0.4f));

  SUBCASE("no metal, no specular: Lambert, whatever the roughness") {
    for (const float roughness : {0.0f, 0.3f, 1.0f}) {
      const Bsdf bsdf({.base_color = red, .roughness = roughness, .specular = 0}, true);
      CHECK(bsdf.events() == Events::D);
      CHECK(bsdf.f_cos(wo, wi) == red * kInvPi * wi.z);
      CHECK(bsdf.diffuse_reflectance(wo).x == doctest::Approx(0.8));
    }
  }
  SUBCASE("smooth metal: a mirror with Schlick's Fresnel") {
    const Bsdf bsdf({.base_color = red, .metallic = 1, .roughness = 0}, true);
    CHECK(bsdf.events() == Events::S);
    BsdfSample s;
    REQUIRE(bsdf.sample(wo, 0.5f, {0.5f, 0.5f}, Events::all, Carried::radiance, s));
    CHECK(s.pdf_w == 0);
    CHECK(s.event == Events::S);
    CHECK(glm::length(s.wi - Vec3(-wo.x, -wo.y, wo.z)) < 1e-6f);
    const float weight = std::pow(1 - wo.z, 5.0f);
    for (int c = 0; c < 3; c++) CHECK(s.weight[c] == doctest::Approx(red[c] + (1 - red[c]) * weight));
    CHECK(bsdf.f_cos(wo, s.wi) == Color(0));
    CHECK(bsdf.pdf_w(wo, s.wi) == 0);
  }
  SUBCASE("smooth glass: Snell, Fresnel, and the square of the index for radiance") {
    for (const bool outside : {true, false}) {
      const float eta = outside ? 1.5f : 1 / 1.5f;
      const Bsdf bsdf({.base_color = red, .roughness = 0, .transmission = 1, .solid = true}, outside);
      CHECK(bsdf.events() == Events::S);
      const float sine_t = wo.x / eta, cosine_t = std::sqrt(1 - sine_t * sine_t);
      const float rs = (wo.z - eta * cosine_t) / (wo.z + eta * cosine_t),
                  rp = (eta * wo.z - cosine_t) / (eta * wo.z + cosine_t);
      const float reflectance = (rs * rs + rp * rp) / 2;
      glm::dvec3 up{0}, down{0};
      constexpr int kSamples = 1 << 14;
      for (std::uint32_t k = 0; k < kSamples; k++) {
        BsdfSample s;
        REQUIRE(bsdf.sample(wo, SampleStream(3, k).get1(0), {0.5f, 0.5f}, Events::S, Carried::radiance, s));
        (s.wi.z > 0 ? up : down) += glm::dvec3(s.weight) / double(kSamples);
        if (s.wi.z < 0) CHECK(glm::length(s.wi - Vec3(-sine_t, 0, -cosine_t)) < 1e-6f);
      }
      CHECK(up.x == doctest::Approx(reflectance).epsilon(1e-3));
      CHECK(down.y == doctest::Approx(red.y * (1 - reflectance) / (eta * eta)).epsilon(1e-3));
    }
  }
  SUBCASE("a path into a solid is worth what it was outside") {
    const BsdfParameters white{.roughness = 0, .transmission = 1, .solid = true};
    const Bsdf entering(white, true), leaving(white, false);
    BsdfSample s;
    REQUIRE(entering.sample(wo, 0.999f, {0.5f, 0.5f}, Events::all, Carried::radiance, s));
    REQUIRE(s.wi.z < 0);
    CHECK(entering.concentration() == 1);
    CHECK(s.weight.x * leaving.concentration() == doctest::Approx(1).epsilon(1e-5));
    CHECK(Bsdf({.roughness = 0, .transmission = 1}, false).concentration() == 1);  // a thin wall
  }
  SUBCASE("total internal reflection") {
    const Bsdf bsdf({.base_color = red, .roughness = 0, .transmission = 1, .solid = true}, false);
    for (const float angle : {42.0f, 60.0f, 89.0f}) {
      BsdfSample s;
      REQUIRE(bsdf.sample(at_angle(angle), 0.999f, {0.5f, 0.5f}, Events::all, Carried::radiance, s));
      CHECK(s.wi.z > 0);
      CHECK(s.weight == Color(1));
    }
  }
  SUBCASE("thin wall: straight through, with the reflections between its faces") {
    const Bsdf bsdf({.roughness = 0, .transmission = 1}, true);
    BsdfSample s;
    REQUIRE(bsdf.sample({0, 0, 1}, 0.99f, {0.5f, 0.5f}, Events::all, Carried::radiance, s));
    CHECK(s.wi == Vec3(0, 0, -1));
    const float r = 0.04f;
    const Color both = bsdf.albedo({0, 0, 1});
    CHECK(both.x == doctest::Approx(1));
    const Bsdf black({.base_color = Color(0), .roughness = 0, .transmission = 1}, true);
    CHECK(black.albedo({0, 0, 1}).x == doctest::Approx(2 * r / (1 + r)));
  }
  SUBCASE("smooth plastic: S above D") {
    const Bsdf bsdf({.base_color = red, .roughness = 0}, true);
    CHECK(bsdf.events() == (Events::S | Events::D));
    CHECK(bsdf.albedo(wo, Events::S).x == doctest::Approx(0.04 + 0.96 * std::pow(1 - wo.z, 5.0f)).epsilon(1e-5));
  }
  SUBCASE("classification: alpha = roughness^2 against 1e-4") {
    CHECK(Bsdf({.metallic = 1, .roughness = 0.00999f}, true).events() == Events::S);
    CHECK(Bsdf({.metallic = 1, .roughness = 0.01001f}, true).events() == Events::G);
    CHECK(Bsdf({.roughness = 0.5f}, true).events() == Events::DG);
    CHECK(Bsdf({.base_color = Color(0), .specular = 0}, true).events() == Events::none);
  }
  SUBCASE("an infinite index reflects everything") {
    const Bsdf bsdf({.ior = 0, .transmission = 1, .solid = true}, true);
    CHECK(bsdf.albedo(wo).x == doctest::Approx(1).epsilon(1e-3));
  }
  SUBCASE("bad numbers are clamped") {
    const float nan = std::nanf("");
    const Bsdf bsdf(
        {.base_color = Color(nan, 2, -1), .metallic = nan, .roughness = 7, .specular = nan, .ior = nan, .transmission = nan},
        true);
    CHECK(bsdf.events() == Events::D);
    CHECK(bsdf.albedo(wo) == Color(0, 1, 0));
  }
}

TEST_CASE("continuous where roughness meets ideal specular") {
  // The lobe's integral and its mean direction just above and just below the threshold.
  for (const BsdfParameters& base : {BsdfParameters{.base_color = {0.9f, 0.5f, 0.1f}, .metallic = 1}, BsdfParameters{},
                                     BsdfParameters{.base_color = {0.9f, 0.5f, 0.1f}, .transmission = 1},
                                     BsdfParameters{.base_color = {0.9f, 0.5f, 0.1f}, .transmission = 1, .solid = true}}) {
    for (const bool outside : {true, false}) {
      for (const float angle : {0.0f, 30.0f, 60.0f, 80.0f}) {
        BsdfParameters p = base;
        p.roughness = 0.0099f;
        const Bsdf below(p, outside);
        p.roughness = 0.0101f;
        const Bsdf above(p, outside);
        const Vec3 wo = at_angle(angle);
        for (const Events mask : {Events::all, Events::S | Events::G, Events::D}) {
          const Color a = measure(below, wo, 1 << 13, mask).mean, b = measure(above, wo, 1 << 13, mask).mean;
          for (int c = 0; c < 3; c++) CHECK(std::abs(a[c] - b[c]) < 0.005f);
        }
        for (const float u_lobe : {0.001f, 0.999f}) {
          BsdfSample s, t;
          REQUIRE(below.sample(wo, u_lobe, {0.5f, 0.5f}, Events::S, Carried::radiance, s));
          REQUIRE(above.sample(wo, u_lobe, {0.5f, 0.5f}, Events::G, Carried::radiance, t));
          if ((s.wi.z > 0) == (t.wi.z > 0)) CHECK(glm::length(s.wi - t.wi) < 2e-3f);
        }
      }
    }
  }
}

TEST_CASE("a table for a range of roughnesses agrees with those for single ones") {
  float worst = 0;
  for (const float ior : {1.1f, 1.5f, 2.4f}) {
    const DielectricTable range(ior);
    for (const float roughness : {0.0101f, 0.0234f, 0.05f, 0.15f, 0.26f, 0.4f, 0.63f, 0.85f, 1.0f}) {
      const DielectricTable single(ior, roughness, roughness);
      for (const bool outside : {true, false}) {
        for (const float angle : kAngles) {
          const float mu = at_angle(angle).z;
          worst = std::max(worst, std::abs(range.deficit(outside, roughness, mu).y - single.deficit(outside, roughness, mu).y));
        }
      }
    }
  }
  MESSAGE("worst difference of an albedo: " << worst);
  CHECK(worst < 1.2e-3f);
}
