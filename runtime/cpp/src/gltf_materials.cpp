#include "gltf_materials.hpp"

#include <algorithm>
#include <cmath>

#include "ln/image_reader.hpp"
#include "ln/text.hpp"

namespace ln::gltf {
namespace {

/// What "ior": 0 stands for: a dielectric that reflects everything.
constexpr float kInfiniteIor = 1e4f;

float number(Json json, double fallback) { return static_cast<float>(json.number(fallback)); }

/// A factor within [0, 1]; the file may miss that by a rounding error.
float fraction(Json json, double fallback) { return std::clamp(number(json, fallback), 0.0f, 1.0f); }

Color color(Json json, const Color& fallback, float most = 1) {
  Color result = fallback;
  std::size_t i = 0;
  for (const Json component : json) {
    if (i < 3) result[i++] = std::clamp(number(component, 0), 0.0f, most);
  }
  return result;
}

Json element(Json array, std::size_t wanted) {
  std::size_t i = 0;
  for (const Json value : array) {
    if (i++ == wanted) return value;
  }
  return {};
}

/// KHR_texture_transform as rows of a 2x3 matrix: translation * rotation * scale. Positive angles turn u towards -v, as the
/// extension's text and all its implementations have it; the GLSL in the text turns the other way (KhronosGroup/glTF#1563).
void set_transform(Json transform, TextureRef& texture) {
  const auto pair = [&](const char* member, double fallback) {
    return std::array{element(transform[member], 0).number(fallback), element(transform[member], 1).number(fallback)};
  };
  const auto offset = pair("offset", 0), scale = pair("scale", 1);
  const double angle = transform["rotation"].number(0), c = std::cos(angle), s = std::sin(angle);
  texture.row0 = Vec3(c * scale[0], s * scale[1], offset[0]);
  texture.row1 = Vec3(-s * scale[0], c * scale[1], offset[1]);
}

Wrap wrap(Json json) {
  switch (json.integer(10497)) {
    case 33071: return Wrap::clamp;
    case 33648: return Wrap::mirror;
    default: return Wrap::repeat;
  }
}

/// The place of a texture's coordinates among the two sets of its material.
std::uint8_t uv_set(Json texcoord, Json info, UvSets& sets) {
  const auto wanted = static_cast<std::uint32_t>(std::min<std::int64_t>(texcoord.integer(0), UINT32_MAX));
  for (const bool replace : {false, true}) {
    for (const std::uint8_t place : {1, 0}) {
      if (replace && !sets.used[place]) sets.texcoord[place] = wanted;
      if (sets.texcoord[place] != wanted) continue;
      sets.used[place] = true;
      return place;
    }
  }
  info.fail("the material uses more than two sets of texture coordinates");
}

}  // namespace

std::string read_name(Json json) {
  constexpr std::size_t kLongest = 1000;
  return std::string(json["name"].text().substr(0, kLongest));
}

void read_tags(Json json, std::vector<std::string>& tags) {
  constexpr std::size_t kMost = 64, kLongest = 256;
  const Json found = json["extras"]["tags"];
  if (!found) return;
  const auto add = [&](Json tag) {
    if (tag.kind() == JsonKind::string && tag.text().size() <= kLongest) tags.emplace_back(tag.text());
  };
  add(found);
  std::size_t read = 0;
  for (const Json tag : found) {
    if (read++ == kMost) break;
    add(tag);
  }
}

double name_and_tags_bytes(Json json) {
  std::vector<std::string> tags;
  read_tags(json, tags);
  auto bytes = static_cast<double>(read_name(json).size());
  for (const std::string& tag : tags) bytes += static_cast<double>(sizeof(std::string) + tag.size());
  return bytes;
}

std::uint32_t MaterialReader::use(Json index) {
  const std::int64_t key = index.integer(-1);
  const auto [found, is_new] = used_.emplace(key, static_cast<std::uint32_t>(scene_.materials.size()));
  if (is_new) {
    model_.memory.claim(sizeof(Material) + 1000, "a material");
    UvSets sets{0, 1};
    scene_.materials.push_back(key < 0 ? Material{} : read(model_.materials[static_cast<std::size_t>(key)], sets));
    uv_sets_.push_back(sets);
  }
  return found->second;
}

Material MaterialReader::read(Json json, UvSets& sets) {
  Material m;
  m.name = read_name(json);
  read_tags(json, m.tags);

  const Json metallic_roughness = json["pbrMetallicRoughness"], extensions = json["extensions"];
  m.base_color = color(metallic_roughness["baseColorFactor"], Color(1));
  m.alpha = fraction(element(metallic_roughness["baseColorFactor"], 3), 1);
  m.metallic = fraction(metallic_roughness["metallicFactor"], 1);
  m.roughness = fraction(metallic_roughness["roughnessFactor"], 1);
  m.base_color_texture = texture(metallic_roughness["baseColorTexture"], true, sets);
  m.metallic_roughness_texture = texture(metallic_roughness["metallicRoughnessTexture"], false, sets);
  m.normal_texture = texture(json["normalTexture"], false, sets);
  m.normal_scale = number(json["normalTexture"]["scale"], 1);

  const float strength = number(extensions["KHR_materials_emissive_strength"]["emissiveStrength"], 1);
  m.emission = color(json["emissiveFactor"], Color(0)) * strength;
  m.emissive_texture = texture(json["emissiveTexture"], true, sets);

  const std::string_view alpha_mode = json["alphaMode"].text("OPAQUE");
  m.alpha_mode = alpha_mode == "MASK" ? AlphaMode::mask : alpha_mode == "BLEND" ? AlphaMode::blend : AlphaMode::opaque;
  m.alpha_cutoff = number(json["alphaCutoff"], 0.5);
  m.double_sided = json["doubleSided"].boolean(false);

  if (const Json ior = extensions["KHR_materials_ior"]["ior"]) {
    m.ior = number(ior, 1.5);
    if (m.ior != 0 && m.ior < 1) ior.fail(number_text(ior.number(0)) + " is neither 0 nor 1 or more");
    if (m.ior == 0) m.ior = kInfiniteIor;
  }
  const Json transmission = extensions["KHR_materials_transmission"];
  m.transmission = fraction(transmission["transmissionFactor"], 0);
  m.transmission_texture = texture(transmission["transmissionTexture"], false, sets);

  const Json volume = extensions["KHR_materials_volume"];
  m.solid = volume["thicknessFactor"].number(0) > 0;
  m.attenuation_distance = number(volume["attenuationDistance"], kInfinity);
  m.attenuation_color = color(volume["attenuationColor"], Color(1));

  const Json specular = extensions["KHR_materials_specular"];
  m.specular = fraction(specular["specularFactor"], 1);
  m.specular_texture = texture(specular["specularTexture"], false, sets);
  m.specular_color = color(specular["specularColorFactor"], Color(1), std::numeric_limits<float>::max());
  m.specular_color_texture = texture(specular["specularColorTexture"], true, sets);

  read_specular_glossiness(extensions["KHR_materials_pbrSpecularGlossiness"], m, sets);

  if (extensions["KHR_materials_unlit"]) {
    m.unlit = true;
    m.emission = m.base_color;
    m.emissive_texture = m.base_color_texture;
  }
  return m;
}

/// The archived specular-glossiness model as a dielectric with F0 = specularFactor: 0.04 (index of refraction 1.5) times a
/// specular colour of 25 times that.
void MaterialReader::read_specular_glossiness(Json json, Material& m, UvSets& sets) {
  if (!json) return;
  constexpr float kF0 = 0.04f;
  m.ior = 1.5f;
  m.metallic = 0;
  m.metallic_roughness_texture = {};
  m.base_color = color(json["diffuseFactor"], Color(1));
  m.alpha = fraction(element(json["diffuseFactor"], 3), 1);
  m.base_color_texture = texture(json["diffuseTexture"], true, sets);
  m.roughness = 1 - fraction(json["glossinessFactor"], 1);
  m.specular = 1;
  m.specular_color = color(json["specularFactor"], Color(1)) / kF0;
  m.specular_color_texture = texture(json["specularGlossinessTexture"], true, sets);
  if (m.specular_color_texture) model_.notes.add("the glossiness in the alpha channel of specularGlossinessTexture is ignored");
}

TextureRef MaterialReader::texture(Json info, bool srgb, UvSets& sets) {
  TextureRef result;
  if (!info) return result;
  const Json json = model_.textures[info["index"].index()];
  if (!json["source"]) {
    model_.notes.count("texture has no PNG or JPEG image and is ignored", "textures have no PNG or JPEG image and are ignored",
                       1);
    return result;
  }
  const Json transform = info["extensions"]["KHR_texture_transform"];
  set_transform(transform, result);
  if (const Json index = json["sampler"]) {
    const Json sampler = model_.samplers[index.index()];
    result.wrap_s = wrap(sampler["wrapS"]);
    result.wrap_t = wrap(sampler["wrapT"]);
    result.nearest = sampler["magFilter"].integer(9729) == 9728;
  }

  const Json overriding = transform["texCoord"];
  result.uv_set = uv_set(overriding ? overriding : info["texCoord"], info, sets);
  result.image = image(json["source"].index(), srgb);
  return result;
}

int MaterialReader::image(std::size_t index, bool srgb) {
  const auto [found, is_new] = images_.emplace(std::pair{index, srgb}, -1);
  if (is_new) found->second = read_image(index, srgb);
  return found->second;
}

int MaterialReader::read_image(std::size_t index, bool srgb) {
  const Json json = model_.images[index], uri = json["uri"], view = json["bufferView"];
  if (!uri && !view) json.fail("has neither uri nor bufferView");
  const bool is_file = uri && !is_data_uri(uri.text());
  try {
    if (uri && !is_file) return decode(decode_data_uri(uri.text(), model_.memory).span(), srgb);
    std::span<const std::uint8_t> bytes;
    if (is_file) {
      bytes = model_.folder.read_uri(uri.text(), model_.memory).span();
    } else {
      const ByteView data = model_.view(view.index());
      bytes = data.part(0, data.size());
    }
    // Files and buffers stay in memory: several images may be the same bytes.
    const auto [known, is_new] = decoded_.emplace(std::tuple{bytes.data(), bytes.size(), srgb}, -1);
    if (is_new) known->second = decode(bytes, srgb);
    return known->second;
  } catch (const Error& error) {
    json.fail((is_file ? quoted(uri.text(), 120) + ": " : "") + error.what());
  }
}

int MaterialReader::decode(std::span<const std::uint8_t> bytes, bool srgb) {
  scene_.images.push_back(decode_image(bytes, srgb, [&](double size) { model_.memory.claim(size, "the decoded image"); }));
  return static_cast<int>(scene_.images.size()) - 1;
}

}  // namespace ln::gltf
