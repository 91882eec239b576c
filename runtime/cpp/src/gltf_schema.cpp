#include "gltf_schema.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "ln/text.hpp"

namespace ln::gltf {
namespace {

// ---------------------------------------------------------------- the language of the table

enum class Target {
  accessors,
  buffer_views,
  buffers,
  cameras,
  images,
  lights,
  materials,
  meshes,
  nodes,
  samplers,
  scenes,
  skins,
  textures,
  count
};
constexpr std::array<std::string_view, static_cast<std::size_t>(Target::count)> kTargetNames{
    "accessors", "bufferViews", "buffers",  "cameras", "images", "lights",  "materials",
    "meshes",    "nodes",       "samplers", "scenes",  "skins",  "textures"};

enum class Form {
  boolean,
  integer,
  number,
  numbers,
  text,
  texts,
  choice,
  code,
  index,
  indices,
  index_map,
  index_maps,
  object,
  objects
};

constexpr double kMost = std::numeric_limits<float>::max();
constexpr double kAny = std::numeric_limits<double>::max();
constexpr double kExact = 9007199254740991;  // largest integer that every JSON reader agrees on
constexpr double kPi = 3.14159265358979323846;

struct Range {
  double low = -kMost, high = kMost;
  bool open_low = false, open_high = false;
};
constexpr Range kFraction{0, 1};
constexpr Range kNotNegative{0, kMost};
constexpr Range kPositive{0, kMost, true};
constexpr Range kFinite{-kAny, kAny};

struct Rule {
  std::string_view member;
  Form form;
  Range range{};
  std::size_t length = 0;         // numbers: how many; 0: any
  std::string_view choices{};     // choice, code: separated by blanks
  Target target{};                // index, indices, index_map, index_maps
  std::span<const Rule> rules{};  // object, objects
  bool required = false;
};

constexpr Rule boolean(std::string_view member) { return {member, Form::boolean}; }
constexpr Rule integer(std::string_view member, double low, double high = kExact) {
  return {member, Form::integer, {low, high}};
}
constexpr Rule number(std::string_view member, Range range = {}) { return {member, Form::number, range}; }
constexpr Rule numbers(std::string_view member, std::size_t length, Range range = {}) {
  return {member, Form::numbers, range, length};
}
constexpr Rule text(std::string_view member) { return {member, Form::text}; }
constexpr Rule texts(std::string_view member) { return {member, Form::texts}; }
constexpr Rule choice(std::string_view member, std::string_view choices) { return {member, Form::choice, {}, 0, choices}; }
constexpr Rule code(std::string_view member, std::string_view choices) { return {member, Form::code, {}, 0, choices}; }
constexpr Rule index(std::string_view member, Target target) { return {member, Form::index, {}, 0, {}, target}; }
constexpr Rule indices(std::string_view member, Target target) { return {member, Form::indices, {}, 0, {}, target}; }
constexpr Rule index_map(std::string_view member, Target target) { return {member, Form::index_map, {}, 0, {}, target}; }
constexpr Rule index_maps(std::string_view member, Target target) { return {member, Form::index_maps, {}, 0, {}, target}; }
constexpr Rule object(std::string_view member, std::span<const Rule> rules) {
  return {member, Form::object, {}, 0, {}, {}, rules};
}
constexpr Rule objects(std::string_view member, std::span<const Rule> rules) {
  return {member, Form::objects, {}, 0, {}, {}, rules};
}
constexpr Rule required(Rule rule) {
  rule.required = true;
  return rule;
}

// ---------------------------------------------------------------- the table

constexpr Rule kAsset[] = {required(text("version")), text("minVersion")};

constexpr Rule kSparseIndices[] = {required(index("bufferView", Target::buffer_views)), integer("byteOffset", 0),
                                   required(code("componentType", "5121 5123 5125"))};
constexpr Rule kSparseValues[] = {required(index("bufferView", Target::buffer_views)), integer("byteOffset", 0)};
constexpr Rule kSparse[] = {required(integer("count", 1)), required(object("indices", kSparseIndices)),
                            required(object("values", kSparseValues))};
constexpr Rule kAccessor[] = {index("bufferView", Target::buffer_views),
                              integer("byteOffset", 0),
                              required(code("componentType", "5120 5121 5122 5123 5125 5126")),
                              boolean("normalized"),
                              required(integer("count", 1)),
                              required(choice("type", "SCALAR VEC2 VEC3 VEC4 MAT2 MAT3 MAT4")),
                              object("sparse", kSparse)};

constexpr Rule kBufferMeshopt[] = {boolean("fallback")};
constexpr Rule kBufferExtensions[] = {object("EXT_meshopt_compression", kBufferMeshopt)};
constexpr Rule kBuffer[] = {text("uri"), required(integer("byteLength", 1)), object("extensions", kBufferExtensions)};
constexpr Rule kBufferView[] = {required(index("buffer", Target::buffers)), integer("byteOffset", 0),
                                required(integer("byteLength", 1)), integer("byteStride", 4, 252)};

constexpr Rule kPerspective[] = {number("aspectRatio", kPositive), required(number("yfov", {0, kPi, true, true})),
                                 number("zfar", kPositive), required(number("znear", kPositive))};
constexpr Rule kOrthographic[] = {required(number("xmag", kPositive)), required(number("ymag", kPositive)),
                                  required(number("zfar", kPositive)), required(number("znear", kNotNegative))};
constexpr Rule kCamera[] = {text("name"), required(choice("type", "perspective orthographic")),
                            object("perspective", kPerspective), object("orthographic", kOrthographic)};

constexpr Rule kImage[] = {text("uri"), text("mimeType"), index("bufferView", Target::buffer_views), text("name")};
constexpr Rule kSampler[] = {code("magFilter", "9728 9729"), code("minFilter", "9728 9729 9984 9985 9986 9987"),
                             code("wrapS", "33071 33648 10497"), code("wrapT", "33071 33648 10497")};
constexpr Rule kTexture[] = {index("sampler", Target::samplers), index("source", Target::images)};

constexpr Rule kTextureTransform[] = {numbers("offset", 2), number("rotation"), numbers("scale", 2), integer("texCoord", 0)};
constexpr Rule kTextureInfoExtensions[] = {object("KHR_texture_transform", kTextureTransform)};
constexpr Rule kTextureInfo[] = {required(index("index", Target::textures)), integer("texCoord", 0), number("scale"),
                                 number("strength", kFraction), object("extensions", kTextureInfoExtensions)};

constexpr Rule kMetallicRoughness[] = {numbers("baseColorFactor", 4, kFraction), object("baseColorTexture", kTextureInfo),
                                       number("metallicFactor", kFraction), number("roughnessFactor", kFraction),
                                       object("metallicRoughnessTexture", kTextureInfo)};
constexpr Rule kEmissiveStrength[] = {number("emissiveStrength", kNotNegative)};
constexpr Rule kIor[] = {number("ior", kNotNegative)};  // and 0 or at least 1
constexpr Rule kTransmission[] = {number("transmissionFactor", kFraction), object("transmissionTexture", kTextureInfo)};
constexpr Rule kVolume[] = {number("thicknessFactor", kNotNegative), object("thicknessTexture", kTextureInfo),
                            number("attenuationDistance", kPositive), numbers("attenuationColor", 3, kFraction)};
constexpr Rule kSpecular[] = {number("specularFactor", kFraction), object("specularTexture", kTextureInfo),
                              numbers("specularColorFactor", 3, kNotNegative), object("specularColorTexture", kTextureInfo)};
constexpr Rule kSpecularGlossiness[] = {numbers("diffuseFactor", 4, kFraction), object("diffuseTexture", kTextureInfo),
                                        numbers("specularFactor", 3, kFraction), number("glossinessFactor", kFraction),
                                        object("specularGlossinessTexture", kTextureInfo)};
constexpr Rule kMaterialExtensions[] = {object("KHR_materials_emissive_strength", kEmissiveStrength),
                                        object("KHR_materials_ior", kIor),
                                        object("KHR_materials_transmission", kTransmission),
                                        object("KHR_materials_volume", kVolume),
                                        object("KHR_materials_specular", kSpecular),
                                        object("KHR_materials_unlit", {}),
                                        object("KHR_materials_pbrSpecularGlossiness", kSpecularGlossiness)};
constexpr Rule kMaterial[] = {text("name"),
                              object("pbrMetallicRoughness", kMetallicRoughness),
                              object("normalTexture", kTextureInfo),
                              object("occlusionTexture", kTextureInfo),
                              object("emissiveTexture", kTextureInfo),
                              numbers("emissiveFactor", 3, kFraction),
                              choice("alphaMode", "OPAQUE MASK BLEND"),
                              number("alphaCutoff", kNotNegative),
                              boolean("doubleSided"),
                              object("extensions", kMaterialExtensions)};

constexpr Rule kPrimitive[] = {required(index_map("attributes", Target::accessors)), index("indices", Target::accessors),
                               index("material", Target::materials), integer("mode", 0, 6),
                               index_maps("targets", Target::accessors)};
constexpr Rule kMesh[] = {text("name"), required(objects("primitives", kPrimitive)), numbers("weights", 0)};

constexpr Rule kNodeLight[] = {required(index("light", Target::lights))};
constexpr Rule kInstancing[] = {index_map("attributes", Target::accessors)};
constexpr Rule kNodeExtensions[] = {object("KHR_lights_punctual", kNodeLight), object("EXT_mesh_gpu_instancing", kInstancing)};
constexpr Rule kNode[] = {text("name"),
                          index("camera", Target::cameras),
                          indices("children", Target::nodes),
                          index("skin", Target::skins),
                          numbers("matrix", 16, kFinite),
                          index("mesh", Target::meshes),
                          numbers("rotation", 4, {-1, 1}),
                          numbers("scale", 3, kFinite),
                          numbers("translation", 3, kFinite),
                          numbers("weights", 0),
                          object("extensions", kNodeExtensions)};
constexpr Rule kScene[] = {text("name"), indices("nodes", Target::nodes)};
constexpr Rule kSkin[] = {text("name"), index("inverseBindMatrices", Target::accessors), index("skeleton", Target::nodes),
                          required(indices("joints", Target::nodes))};

constexpr Rule kSpot[] = {number("innerConeAngle", {0, kPi / 2, false, true}),
                          number("outerConeAngle", {0, kPi / 2 + 1e-5, true})};
constexpr Rule kLight[] = {text("name"),
                           numbers("color", 3, kFraction),
                           number("intensity", kNotNegative),
                           required(choice("type", "directional point spot")),
                           number("range", kPositive),
                           object("spot", kSpot)};
constexpr Rule kLights[] = {required(objects("lights", kLight))};
constexpr Rule kRootExtensions[] = {object("KHR_lights_punctual", kLights)};

constexpr Rule kRoot[] = {required(object("asset", kAsset)),
                          texts("extensionsUsed"),
                          texts("extensionsRequired"),
                          objects("accessors", kAccessor),
                          objects("animations", {}),
                          objects("buffers", kBuffer),
                          objects("bufferViews", kBufferView),
                          objects("cameras", kCamera),
                          objects("images", kImage),
                          objects("materials", kMaterial),
                          objects("meshes", kMesh),
                          objects("nodes", kNode),
                          objects("samplers", kSampler),
                          index("scene", Target::scenes),
                          objects("scenes", kScene),
                          objects("skins", kSkin),
                          objects("textures", kTexture),
                          object("extensions", kRootExtensions)};

// ---------------------------------------------------------------- the checks

std::string range_text(const Range& range) {
  if (range.high >= kMost && range.low == 0) return range.open_low ? "not above 0" : "not 0 or more";
  return std::string("not within ") + (range.open_low ? "(" : "[") + number_text(range.low) + ", " + number_text(range.high) +
         (range.open_high ? ")" : "]");
}

class Checker {
 public:
  explicit Checker(Json root) {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      const bool is_light = i == static_cast<std::size_t>(Target::lights);
      counts_[i] = (is_light ? root["extensions"]["KHR_lights_punctual"][kTargetNames[i]] : root[kTargetNames[i]]).size();
    }
  }

  void check_object(Json value, std::span<const Rule> rules) const {
    want(value, JsonKind::object);
    for (const Rule& rule : rules) {
      if (rule.required && !value[rule.member]) value.fail(rule.member, "is missing");
    }
    for (const Json member : value) {
      const std::string_view name = member.key();
      for (const Rule& rule : rules) {
        if (rule.member == name) check(member, rule);
      }
    }
  }

 private:
  static void want(Json value, JsonKind kind) {
    if (value.kind() != kind)
      value.fail(std::string(kind_text(value.kind())) + " where " + std::string(kind_text(kind)) + " is wanted");
  }

  void check(Json value, const Rule& rule) const {
    switch (rule.form) {
      case Form::boolean: return want(value, JsonKind::boolean);
      case Form::integer: return check_integer(value, rule.range);
      case Form::number: return check_number(value, rule.range);
      case Form::numbers:
        want(value, JsonKind::array);
        if (rule.length != 0 && value.size() != rule.length)
          value.fail(std::to_string(value.size()) + " numbers where " + std::to_string(rule.length) + " are wanted");
        for (const Json element : value) check_number(element, rule.range);
        return;
      case Form::text: return want(value, JsonKind::string);
      case Form::texts:
        want(value, JsonKind::array);
        for (const Json element : value) want(element, JsonKind::string);
        return;
      case Form::choice:
        want(value, JsonKind::string);
        if (!listed(rule.choices, value.text()))
          value.fail(quoted(value.text(), 60) + " is none of " + std::string(rule.choices));
        return;
      case Form::code:
        check_integer(value, {0, kExact});
        if (!listed(rule.choices, std::to_string(value.integer(0))))
          value.fail(number_text(value.number(0)) + " is none of " + std::string(rule.choices));
        return;
      case Form::index: return check_index(value, rule.target);
      case Form::indices:
        want(value, JsonKind::array);
        for (const Json element : value) check_index(element, rule.target);
        return;
      case Form::index_map: return check_index_map(value, rule.target);
      case Form::index_maps:
        want(value, JsonKind::array);
        for (const Json element : value) check_index_map(element, rule.target);
        return;
      case Form::object: return check_object(value, rule.rules);
      case Form::objects:
        want(value, JsonKind::array);
        for (const Json element : value) check_object(element, rule.rules);
        return;
    }
  }

  static void check_number(Json value, const Range& range) {
    want(value, JsonKind::number);
    const double x = value.number(0);
    const double slack = range.high <= 1 ? 1e-5 : 0;
    const bool below = range.open_low ? x <= range.low : x < range.low - slack;
    const bool above = range.open_high ? x >= range.high : x > range.high + slack;
    if (below || above) value.fail(number_text(x) + " is " + range_text(range));
  }

  static void check_integer(Json value, const Range& range) {
    want(value, JsonKind::number);
    const double x = value.number(0);
    if (x != std::trunc(x)) value.fail(number_text(x) + " is not an integer");
    check_number(value, range);
  }

  void check_index(Json value, Target target) const {
    want(value, JsonKind::number);
    const double x = value.number(0);
    if (x != std::trunc(x)) value.fail(number_text(x) + " is not an integer");
    const auto which = static_cast<std::size_t>(target);
    const std::size_t count = counts_[which];
    if (!(x >= 0 && x < static_cast<double>(count)))
      value.fail("there is no " + std::string(kTargetNames[which]) + "[" + number_text(x) + "]");
  }

  void check_index_map(Json value, Target target) const {
    want(value, JsonKind::object);
    for (const Json member : value) check_index(member, target);
  }

  static bool listed(std::string_view choices, std::string_view word) {
    while (!choices.empty()) {
      const std::size_t blank = std::min(choices.find(' '), choices.size());
      if (choices.substr(0, blank) == word) return true;
      choices.remove_prefix(std::min(blank + 1, choices.size()));
    }
    return false;
  }

  std::array<std::size_t, static_cast<std::size_t>(Target::count)> counts_{};
};

}  // namespace

void check_schema(Json root) { Checker(root).check_object(root, kRoot); }

}  // namespace ln::gltf
