#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/sampling.hpp"
#include "ln/scene.hpp"

using namespace ln;

namespace {

/// Random triangles of many sizes, thin and fat, some exactly in coordinate planes, each a part of its own.
SceneData triangle_soup(int count) {
  SceneData data;
  data.materials.emplace_back();
  for (int i = 0; i < count; ++i) {
    const SampleStream random(hash32(static_cast<std::uint32_t>(i), 99), 0);
    const float size = std::exp2(-12 * random.get1(0));
    const float thinness = std::exp2(-10 * random.get1(1));
    Vec3 corner(random.get2(2) * 2.0f - 1.0f, random.get1(3) * 2 - 1);
    Vec3 e1(random.get2(4) - 0.5f, random.get1(5) - 0.5f), e2(random.get2(6) - 0.5f, random.get1(7) - 0.5f);
    if (i % 4 == 0) corner[i / 4 % 3] = e1[i / 4 % 3] = e2[i / 4 % 3] = 0;
    const auto first = static_cast<std::uint32_t>(data.positions.size());
    for (const Vec3& p : {corner, corner + size * e1, corner + size * thinness * e2}) data.positions.push_back(p);
    data.triangles.emplace_back(first, first + 1, first + 2);
    data.triangle_part.push_back(static_cast<std::uint32_t>(i));
    Part part;
    part.first_triangle = static_cast<std::uint32_t>(i);
    part.triangle_count = 1;
    data.parts.push_back(part);
  }
  return data;
}

}  // namespace

TEST_CASE("a ray that leaves a triangle does not meet it again, grazing rays included") {
  const int count = 1500, rays = 200;
  const Scene scene(triangle_soup(count), {}, 1, nullptr);
  int again = 0;
  for (std::uint32_t t = 0; t < static_cast<std::uint32_t>(count); ++t) {
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(rays); ++k) {
      const SampleStream random(t, k);
      const Vec2 u = random.get2(0);
      Hit hit{1, t, u.x * (1 - u.y), u.y};
      SurfacePosition at;
      scene.locate(hit, at);
      // Cosines from 1 down to 1e-6.
      const float cosine = std::pow(10.0f, -6 * random.get1(1)), sine = std::sqrt(1 - cosine * cosine),
                  phi = 2 * kPi * random.get1(2);
      const Vec3 local(sine * std::cos(phi), sine * std::sin(phi), k % 2 ? cosine : -cosine);
      const Vec3 w = make_frame(at.ng).to_world(local);
      again += scene.accel().intersect(spawn_ray(at, w), 0).triangle == t;
    }
  }
  CHECK(again == 0);
}

TEST_CASE("what a hit says: sides, frames and wo") {
  const Scene scene(triangle_soup(300), {}, 1, nullptr);
  int found = 0;
  for (std::uint32_t k = 0; k < 20'000; ++k) {
    const SampleStream random(3, k);
    const Ray ray{Vec3(random.get2(0) * 4.0f - 2.0f, 3), glm::normalize(Vec3(random.get2(1) - 0.5f, -1)), kInfinity};
    const Hit hit = scene.accel().intersect(ray, 0);
    if (!hit.found()) continue;
    ++found;
    const Interaction at(scene, ray, hit);
    CHECK(at.wo_local.z > 0);
    CHECK(at.front == (glm::dot(at.wo, at.at.ng) >= 0));
    CHECK(glm::distance(at.at.p, ray.origin + hit.t * ray.direction) < 1e-4f);
    CHECK(glm::length(at.frame.n) == doctest::Approx(1));
    CHECK(at.side_agrees(at.wo, at.wo_local.z));
    CHECK(!at.side_agrees(-at.wo, at.wo_local.z));
    CHECK(any(at.bsdf().events()));
  }
  CHECK(found > 100);
}

TEST_CASE("a shadow ray ends before its light and starts behind its surface") {
  // Two parallel walls a hundred-thousandth of the scene apart: what lies between them is seen, what lies behind is not.
  SceneData data;
  data.materials.emplace_back();
  for (const float z : {0.0f, 1e-5f, 0.7f}) {
    const auto first = static_cast<std::uint32_t>(data.positions.size());
    for (const Vec2 p : {Vec2(-1, -1), Vec2(1, -1), Vec2(0, 1)}) data.positions.emplace_back(p, z);
    data.triangles.emplace_back(first, first + 1, first + 2);
    data.triangle_part.push_back(static_cast<std::uint32_t>(data.parts.size()));
    Part part;
    part.first_triangle = static_cast<std::uint32_t>(data.parts.size());
    part.triangle_count = 1;
    data.parts.push_back(part);
  }
  const Scene scene(std::move(data), {}, 1, nullptr);
  int leaks = 0, blocked = 0;
  for (std::uint32_t k = 0; k < 10'000; ++k) {
    const SampleStream random(5, k);
    const Vec2 u = random.get2(0) * 0.5f, v = random.get2(1) * 0.5f;
    SurfacePosition low, middle, high;
    scene.locate({1, 0, u.x, u.y}, low);
    scene.locate({1, 1, v.x, v.y}, middle);
    scene.locate({1, 2, v.x, v.y}, high);
    leaks += !scene.accel().occluded(spawn_ray_to(low, high), 0);
    blocked += scene.accel().occluded(spawn_ray_to(middle, high), 0);
  }
  CHECK(leaks == 0);
  CHECK(blocked == 0);
}
