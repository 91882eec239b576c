#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "ln/letters.hpp"
#include "ln/material.hpp"
#include "ln/scene.hpp"

using namespace ln;

namespace {

/// A row of parts of one triangle, each with a material and a name of its own.
SceneData row_of(const std::vector<Material>& materials) {
  SceneData data;
  data.materials = materials;
  for (std::uint32_t i = 0; i < materials.size(); ++i) {
    const auto x = static_cast<float>(i) * 0.1f;
    for (const Vec3& p : {Vec3(x, 0, 0), Vec3(x + 0.05f, 0, 0), Vec3(x, 0.05f, 0)}) data.positions.push_back(p);
    data.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    data.triangle_part.push_back(i);
    Part part;
    part.first_triangle = i;
    part.triangle_count = 1;
    part.material = i;
    part.node = std::string(1, static_cast<char>('a' + i));
    data.parts.push_back(part);
  }
  return data;
}

Material lambertian() {
  Material m;
  m.metallic = 0;
  m.specular = 0;
  return m;
}

Material mirror() {
  Material m;
  m.roughness = 0;
  return m;
}

/// Two texels with these roughnesses (green) and metallicities (blue).
Events events_with_texels(Material m, const Vec2& roughness, const Vec2& metallic) {
  SceneData data;
  Image image;
  image.width = 2, image.height = 1, image.channels = 3;
  image.floats = {0, roughness.x, metallic.x, 0, roughness.y, metallic.y};
  data.images.push_back(image);
  m.metallic_roughness_texture.image = 0;
  return possible_events(data, m);
}

}  // namespace

TEST_CASE("letters by kind and tag") {
  Material lamp = lambertian();
  lamp.emission = Color(1);
  SceneData data = row_of({lambertian(), mirror(), lamp});
  data.lights.emplace_back().node = "b";
  data.lights.back().intensity = Color(1);
  data.lights.emplace_back().node = "a";  // dark
  const TagRule rules[] = {
      {0, "unused", TagRule::Kind::node, "x"}, {1, "b", TagRule::Kind::node, "b"}, {2, "c", TagRule::Kind::node, "[bc]"}};
  const Scene scene(std::move(data), rules, 1, nullptr);

  const int tags[] = {2, 1};  // combinations: bit 0 is tag 2, bit 1 is tag 1
  const LetterSet letters = letters_of(scene, tags);
  CHECK(letters.kinds[LetterSet::area_emitter] == 0b0010);   // c
  CHECK(letters.kinds[LetterSet::delta_emitter] == 0b1000);  // b
  CHECK(letters.kinds[LetterSet::diffuse] == 0b0011);        // a, c
  CHECK(letters.kinds[LetterSet::glossy] == 0);
  CHECK(letters.kinds[LetterSet::specular] == 0b1000);  // b
  CHECK(letters_of(scene, {}).kinds == std::array<std::uint64_t, 5>{1, 1, 1, 0, 1});
}

TEST_CASE("an environment is an area emitter without tags") {
  Image sky;
  sky.width = 2, sky.height = 1, sky.channels = 3;
  sky.floats.assign(6, 1.0f);
  const Scene scene(row_of({lambertian()}), {}, 1, &sky);
  CHECK(letters_of(scene, {}).kinds[LetterSet::area_emitter] == 1);
}

TEST_CASE("textures: what their ranges allow, and no less") {
  Material m;
  CHECK(events_with_texels(m, {0.2f, 0.5f}, {0, 1}) == Events::DG);
  CHECK(events_with_texels(m, {0, 0.5f}, {0, 1}) == Events::all);
  CHECK(events_with_texels(m, {0, 0}, {0, 0}) == (Events::D | Events::S));
  CHECK(any(events_with_texels(m, {0.01f, 0.01f}, {0, 0}) & Events::S));  // on the border, within rounding
  m.roughness = 0;
  CHECK(events_with_texels(m, {0.5f, 1}, {0, 1}) == (Events::D | Events::S));
  m = lambertian();
  CHECK(events_with_texels(m, {0, 1}, {0, 1}) == Events::D);
  m.metallic = 0.5f;
  CHECK(events_with_texels(m, {0, 1}, {0, 1}) == Events::all);
}

TEST_CASE("a textured surface scatters by no event but those that were found") {
  SceneData data = row_of({Material{}});
  Image image;
  image.width = 2, image.height = 1, image.channels = 3;
  image.floats = {0, 0.3f, 1, 0, 0.005f, 0.2f};
  data.images.push_back(image);
  data.uvs[0] = {{0, 0}, {1, 0}, {0, 1}};
  data.materials[0].metallic_roughness_texture.image = 0;
  const Events possible = possible_events(data, data.materials[0]);
  Events met = Events::none;
  for (int i = 0; i <= 64; ++i) {
    const VertexAttributes at(data, 0, static_cast<float>(i) / 64, 0);
    met = met | Bsdf(bsdf_parameters(data.materials[0], at, false), true).events();
  }
  CHECK(met == Events::all);
  CHECK((met & possible) == met);
}

TEST_CASE("the reason names what the nearest alternative lacks") {
  LetterSet scene;
  scene.kinds[LetterSet::area_emitter] = scene.kinds[LetterSet::diffuse] = 1;
  const LetterNeed needs[] = {{{{1, 1, 0, 0, 0}}, "emitter"},
                              {{{0, 0, 0, 0, 1}}, "specular surface"},
                              {{{0, 0, 0, 1, 0}}, "glossy surface"},
                              {{{0, 1, 0, 0, 0}}, "point light"}};
  const std::uint64_t far[] = {0b1111, 0b0101, 0b1100};
  CHECK(skip_reason({0, nullptr, needs, far}, scene) == "the scene has no glossy surface");
  const std::uint64_t two[] = {0b0110};
  CHECK(skip_reason({0, nullptr, needs, two}, scene) == "the scene has no specular surface and no glossy surface");
  const std::uint64_t possible[] = {0b1111, 0b0001};
  CHECK(!skip_reason({0, nullptr, needs, possible}, scene));
  CHECK(skip_reason({0, nullptr}, scene) == "no light path of the results leads through it");
}
