// From the node hierarchy to SceneData: meshes, cameras and lights of one scene.

#include <algorithm>
#include <cmath>
#include <map>
#include <new>

#include "gltf_mesh.hpp"
#include "gltf_model.hpp"
#include "gltf_nodes.hpp"
#include "gltf_normalise.hpp"
#include "ln/gltf.hpp"
#include "ln/text.hpp"

namespace ln::gltf {
namespace {

/// An object at a node, kept until the box of the scene is known.
struct Placed {
  std::uint32_t node;
  Affine world;
};

class SceneReader {
 public:
  SceneReader(const std::string& path, const LoadLimits& limits)
      : model_(path, limits.max_bytes), forest_(model_), roots_(forest_.scene_roots()), meshes_(model_, scene_) {}

  SceneData read();

 private:
  void measure();
  void place_joints();
  const std::vector<Affine>& joints_of(std::size_t skin);
  void visit(std::uint32_t index, const Affine& world);
  void add_mesh(Json node, const Affine& world);
  std::vector<Affine> instances(Json node, const Affine& world) const;
  void add_camera(const Placed& placed);
  void add_light(const Placed& placed);
  Vec3 scaled_intensity(Json light, double factor) const;

  Model model_;
  NodeForest forest_;
  std::vector<std::uint32_t> roots_;
  SceneData scene_;
  MeshWriter meshes_;
  std::map<std::uint32_t, Affine> joint_worlds_;       // of nodes that are joints of some skin
  std::map<std::size_t, std::vector<Affine>> joints_;  // by skin
  std::vector<bool> used_meshes_;
  std::vector<Placed> cameras_, lights_;
  Normalisation normalised_;
};

// ---------------------------------------------------------------- meshes

/// Adds up what all meshes will need before the first one is read.
void SceneReader::measure() {
  std::vector<MeshSize> sizes;
  for (const Json mesh : model_.meshes) sizes.push_back(meshes_.measure(mesh));
  used_meshes_.resize(model_.meshes.size(), false);
  MeshSize total;
  forest_.walk(roots_, [&](std::uint32_t index, const Affine&) {
    const Json node = model_.nodes[index], mesh = node["mesh"];
    if (!mesh) return;
    used_meshes_[mesh.index()] = true;
    const MeshSize& size = sizes[mesh.index()];
    if (size.triangles == 0) return;
    double copies = 1;
    for (const Json attribute : node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"])
      copies = static_cast<double>(model_.accessors[attribute.index()].count());
    total.triangles += copies * size.triangles;
    total.vertices += copies * size.vertices;
    const double parts = copies * static_cast<double>(model_.meshes[mesh.index()]["primitives"].size());
    total.bytes += copies * (size.bytes + sizeof(Affine)) +
                   parts * (name_and_tags_bytes(node) + name_and_tags_bytes(model_.meshes[mesh.index()]));
  });
  model_.memory.claim(total.bytes,
                      model_.document->file() + ": the scene, with " + number_text(total.triangles) + " triangles,");
  meshes_.reserve(total);
}

/// Finds where the joints of all skins are at rest.
void SceneReader::place_joints() {
  if (model_.skins.size() == 0) return;
  std::vector<bool> is_joint(model_.nodes.size(), false);
  for (const Json skin : model_.skins) {
    for (const Json joint : skin["joints"]) is_joint[joint.index()] = true;
  }
  forest_.walk(forest_.roots(), [&](std::uint32_t index, const Affine& world) {
    if (is_joint[index]) joint_worlds_[index] = world;
  });
}

/// What moves a vertex from the mesh to the world if it hangs on joint i alone: the joint's place times the inverse bind
/// matrix.
const std::vector<Affine>& SceneReader::joints_of(std::size_t skin_index) {
  const auto [found, is_new] = joints_.try_emplace(skin_index);
  if (!is_new) return found->second;
  const Json skin = model_.skins[skin_index], inverse = skin["inverseBindMatrices"];
  Accessor matrices;
  if (inverse) {
    matrices = model_.accessors[inverse.index()];
    if (matrices.type() != "MAT4" || matrices.component_type() != ComponentType::f32)
      inverse.fail("must be an accessor of MAT4 of FLOAT");
    if (matrices.count() < skin["joints"].size())
      inverse.fail("has " + std::to_string(matrices.count()) + " matrices for " + std::to_string(skin["joints"].size()) +
                   " joints");
  }
  for (const Json joint : skin["joints"]) {
    const Affine& world = joint_worlds_.at(static_cast<std::uint32_t>(joint.index()));
    found->second.push_back(inverse ? world * make_affine(matrices.get<16>(found->second.size())) : world);
  }
  return found->second;
}

std::vector<Affine> SceneReader::instances(Json node, const Affine& world) const {
  const Json attributes = node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  if (attributes.size() == 0) return {world};
  const auto read = [&](std::string_view name, std::string_view type) {
    const Json reference = attributes[name];
    if (!reference) return Accessor();
    Accessor accessor = model_.accessors[reference.index()];
    if (accessor.type() != type)
      reference.fail("is an accessor of " + std::string(accessor.type()) + " where " + std::string(type) + " is wanted");
    return accessor;
  };
  const Accessor translation = read("TRANSLATION", "VEC3"), rotation = read("ROTATION", "VEC4"), scale = read("SCALE", "VEC3");
  std::size_t count = 0;
  for (const Json reference : attributes) {
    const std::size_t n = model_.accessors[reference.index()].count();
    if (count != 0 && n != count)
      reference.fail("has " + std::to_string(n) + " elements, another attribute has " + std::to_string(count));
    count = n;
  }
  std::vector<Affine> transforms;
  transforms.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<double, 4> q = rotation ? rotation.get<4>(i) : std::array<double, 4>{0, 0, 0, 1};
    if (q == std::array<double, 4>{}) q[3] = 1;
    transforms.push_back(world * make_trs(translation ? translation.vec3(i) : DVec3(0), q, scale ? scale.vec3(i) : DVec3(1)));
  }
  return transforms;
}

void SceneReader::add_mesh(Json node, const Affine& world) {
  const Json skin = node["skin"];
  const std::vector<Affine>* joints = skin ? &joints_of(skin.index()) : nullptr;
  meshes_.add({node, model_.meshes[node["mesh"].index()], instances(node, world), joints});
}

void SceneReader::visit(std::uint32_t index, const Affine& world) {
  const Json node = model_.nodes[index];
  if (node["mesh"]) add_mesh(node, world);
  if (node["camera"]) cameras_.push_back({index, world});
  if (node["extensions"]["KHR_lights_punctual"]) lights_.push_back({index, world});
}

// ---------------------------------------------------------------- cameras and lights

/// The direction of `v`, or zero.
DVec3 direction(const DVec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0) || !std::isfinite(largest)) return DVec3(0);
  const DVec3 scaled = v / largest;
  return scaled / std::sqrt(glm::dot(scaled, scaled));
}

void SceneReader::add_camera(const Placed& placed) {
  const Json node = model_.nodes[placed.node], json = model_.cameras[node["camera"].index()];
  Camera camera;
  camera.name = read_name(json);
  camera.node = read_name(node);
  camera.position = normalised_(placed.world.translation);

  // It looks along -z with y up; scale and shear of the node do not concern it.
  const DVec3 forward = direction(-placed.world.linear[2]), y = placed.world.linear[1];
  const DVec3 up = direction(direction(y) - forward * glm::dot(forward, direction(y)));
  const DVec3 right = direction(glm::cross(forward, up));
  if (!within_reach(camera.position) || right == DVec3(0)) {
    return model_.notes.count("camera is ignored: its transform is singular, or leads too far away",
                              "cameras are ignored: their transforms are singular, or lead too far away", 1);
  }
  camera.forward = Vec3(forward);
  camera.up = Vec3(up);
  camera.right = Vec3(right);

  camera.orthographic = json["type"].text() == "orthographic";
  const Json lens = json[json["type"].text()];
  if (!lens) json.fail(json["type"].text(), "is missing");
  if (camera.orthographic) {
    camera.ymag = static_cast<float>(lens["ymag"].number(1) / scene_.unit);
    camera.aspect = static_cast<float>(lens["xmag"].number(1) / lens["ymag"].number(1));
    if (!(camera.ymag > 0 && within_reach(Vec3(camera.ymag * std::max(camera.aspect, 1.0f)))))
      lens.fail("ymag", number_text(lens["ymag"].number(1)) + " is out of proportion to the scene");
  } else {
    camera.yfov = static_cast<float>(lens["yfov"].number(0.8));
    camera.aspect = static_cast<float>(lens["aspectRatio"].number(0));
  }
  scene_.cameras.push_back(std::move(camera));
}

Vec3 SceneReader::scaled_intensity(Json light, double factor) const {
  Vec3 intensity;
  const double strength = light["intensity"].number(1);
  std::array<double, 3> color{1, 1, 1};
  std::size_t i = 0;
  for (const Json component : light["color"]) color[i++] = std::clamp(component.number(1), 0.0, 1.0);
  for (int k = 0; k < 3; ++k)
    intensity[static_cast<std::size_t>(k)] = static_cast<float>(color[static_cast<std::size_t>(k)] * strength * factor);
  if (!(std::isfinite(intensity.x) && std::isfinite(intensity.y) && std::isfinite(intensity.z)))
    light.fail("intensity", number_text(strength) + " is out of proportion to the scene's size of " + number_text(scene_.unit));
  return intensity;
}

void SceneReader::add_light(const Placed& placed) {
  constexpr double kQuarterPi = 0.78539816339744830962;
  const Json node = model_.nodes[placed.node], json = model_.lights[node["extensions"]["KHR_lights_punctual"]["light"].index()];
  const std::string_view type = json["type"].text();
  PunctualLight light;
  light.kind = type == "point" ? PunctualKind::point : type == "spot" ? PunctualKind::spot : PunctualKind::directional;
  light.name = read_name(json);
  light.node = read_name(node);
  read_tags(node, light.tags);
  read_tags(json, light.tags);
  light.position = normalised_(placed.world.translation);
  const DVec3 shines = direction(-placed.world.linear[2]);
  const bool needs_direction = light.kind != PunctualKind::point, needs_position = light.kind != PunctualKind::directional;
  if ((needs_direction && shines == DVec3(0)) || (needs_position && !within_reach(light.position))) {
    return model_.notes.count("light is ignored: its transform is singular, or leads too far away",
                              "lights are ignored: their transforms are singular, or lead too far away", 1);
  }
  if (!needs_position) light.position = Vec3(0);
  if (needs_direction) light.direction = Vec3(shines);
  light.intensity = scaled_intensity(json, needs_position ? 1 / scene_.unit / scene_.unit : 1);
  if (light.kind == PunctualKind::spot) {
    const Json spot = json["spot"];
    const double inner = spot["innerConeAngle"].number(0),
                 outer = std::min(spot["outerConeAngle"].number(kQuarterPi), 2 * kQuarterPi);
    if (!(inner < outer))
      spot.fail("innerConeAngle", number_text(inner) + " is not less than outerConeAngle, " + number_text(outer));
    light.cos_inner = static_cast<float>(std::cos(inner));
    light.cos_outer = std::max(static_cast<float>(std::cos(outer)), 0.0f);
  }
  if (json["range"]) model_.notes.add("the range of lights is ignored: light falls off with the square of the distance");
  scene_.lights.push_back(std::move(light));
}

// ---------------------------------------------------------------- all

SceneData SceneReader::read() {
  measure();
  place_joints();
  forest_.walk(roots_, [&](std::uint32_t index, const Affine& world) { visit(index, world); });
  normalised_ = normalise_geometry(scene_, std::move(meshes_.world()), model_.notes);
  for (std::size_t i = 0; i < used_meshes_.size(); ++i) {
    if (!used_meshes_[i]) meshes_.check(model_.meshes[i]);
  }
  if (scene_.materials.empty()) meshes_.materials().use({});
  for (Material& material : scene_.materials) {
    const double distance = static_cast<double>(material.attenuation_distance) / scene_.unit;
    material.attenuation_distance = static_cast<float>(
        std::clamp(distance, static_cast<double>(std::numeric_limits<float>::min()), std::numeric_limits<double>::infinity()));
  }
  const auto by_node = [](const Placed& a, const Placed& b) { return a.node < b.node; };
  std::sort(cameras_.begin(), cameras_.end(), by_node);
  std::sort(lights_.begin(), lights_.end(), by_node);
  for (const Placed& placed : cameras_) add_camera(placed);
  for (const Placed& placed : lights_) add_light(placed);
  scene_.notes = model_.notes.take();
  return std::move(scene_);
}

}  // namespace
}  // namespace ln::gltf

namespace ln {

SceneData load_gltf(const std::string& path, const LoadLimits& limits) {
  try {
    return gltf::SceneReader(path, limits).read();
  } catch (const std::bad_alloc&) {
    throw Error(printable(path) + ": there is not enough memory to load it");
  } catch (const std::length_error&) {
    throw Error(printable(path) + ": there is not enough memory to load it");
  }
}

}  // namespace ln
