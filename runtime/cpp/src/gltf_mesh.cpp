#include "gltf_mesh.hpp"

#include <algorithm>
#include <cmath>

#include "ln/text.hpp"

namespace ln::gltf {
namespace {

// ---------------------------------------------------------------- formats of attributes

/// Component formats as a set: bit = 2 * type + normalised.
constexpr unsigned format_bit(ComponentType type, bool normalized) {
  return 1u << ((static_cast<unsigned>(type) - 5120) * 2 + (normalized ? 1 : 0));
}
constexpr unsigned kF32 = format_bit(ComponentType::f32, false);
constexpr unsigned kU8 = format_bit(ComponentType::u8, false), kU8N = format_bit(ComponentType::u8, true);
constexpr unsigned kU16 = format_bit(ComponentType::u16, false), kU16N = format_bit(ComponentType::u16, true);
constexpr unsigned kI8 = format_bit(ComponentType::i8, false), kI8N = format_bit(ComponentType::i8, true);
constexpr unsigned kI16 = format_bit(ComponentType::i16, false), kI16N = format_bit(ComponentType::i16, true);
constexpr unsigned kU32 = format_bit(ComponentType::u32, false);
constexpr unsigned kAnySmall = kU8 | kU8N | kU16 | kU16N | kI8 | kI8N | kI16 | kI16N;

std::string format_text(const Accessor& accessor) {
  std::string type;
  switch (accessor.component_type()) {
    case ComponentType::i8: type = "BYTE"; break;
    case ComponentType::u8: type = "UNSIGNED_BYTE"; break;
    case ComponentType::i16: type = "SHORT"; break;
    case ComponentType::u16: type = "UNSIGNED_SHORT"; break;
    case ComponentType::u32: type = "UNSIGNED_INT"; break;
    case ComponentType::f32: type = "FLOAT"; break;
  }
  return std::string(accessor.type()) + " of " + (accessor.normalized() ? "normalised " : "") + type;
}

// ---------------------------------------------------------------- topology

enum Mode { kTriangles = 4, kStrip = 5, kFan = 6 };

std::size_t triangle_count(std::int64_t mode, std::size_t corners) {
  if (mode == kTriangles) return corners / 3;
  return mode == kStrip || mode == kFan ? std::max<std::size_t>(corners, 2) - 2 : 0;
}

// ---------------------------------------------------------------- geometry

/// Beyond this, coordinates are taken for garbage [the file's unit].
constexpr double kLargestCoordinate = 1e30;

bool is_usable(const DVec3& p) {
  return std::abs(p.x) <= kLargestCoordinate && std::abs(p.y) <= kLargestCoordinate && std::abs(p.z) <= kLargestCoordinate;
}

/// What normals are transformed by: the inverse transpose times the absolute determinant, defined for singular matrices too.
glm::dmat3 normal_matrix(const glm::dmat3& m) {
  const double side = glm::determinant(m) < 0 ? -1 : 1;
  return {side * glm::cross(m[1], m[2]), side * glm::cross(m[2], m[0]), side * glm::cross(m[0], m[1])};
}

/// A unit vector, or zero if `v` has no direction.
Vec3 unit_or_zero(const DVec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0) || !std::isfinite(largest) || std::isnan(v.x + v.y + v.z)) return Vec3(0);
  const DVec3 scaled = v / largest;
  return Vec3(scaled / std::sqrt(glm::dot(scaled, scaled)));
}

float finite_or(double x, float fallback) {
  return std::abs(x) <= std::numeric_limits<float>::max() ? static_cast<float>(x) : fallback;
}

/// Appends the attribute of the last vertex. Arrays stay empty until a part has the attribute.
template <class T>
void append(std::vector<T>& values, const std::vector<DVec3>& vertices, bool present, const T& value, const T& absent) {
  if (!present && values.empty()) return;
  if (values.empty()) values.reserve(vertices.capacity());
  if (values.size() + 1 < vertices.size()) values.resize(vertices.size() - 1, absent);
  values.push_back(present ? value : absent);
}

}  // namespace

// ---------------------------------------------------------------- measuring

MeshSize MeshWriter::measure(Json mesh) const {
  constexpr double kScratchPerVertex = 8, kScratchPerTriangle = 24;  // what the search for duplicates takes
  MeshSize size;
  for (const Json primitive : mesh["primitives"]) {
    const Json position = primitive["attributes"]["POSITION"], indices = primitive["indices"];
    if (!position) continue;
    const auto count_of = [&](Json accessor) { return model_.accessors[accessor.index()].count(); };
    const std::size_t vertices = count_of(position), corners = indices ? count_of(indices) : vertices;
    require_count(primitive["attributes"], vertices);
    for (const Json target : primitive["targets"]) require_count(target, vertices);
    const auto triangles = static_cast<double>(triangle_count(primitive["mode"].integer(kTriangles), corners));
    const auto used = triangles == 0 ? 0.0 : static_cast<double>(std::min(vertices, corners));
    double vertex_bytes = sizeof(DVec3) + sizeof(Vec3) + kScratchPerVertex;
    for (const Json attribute : primitive["attributes"]) {
      const std::string_view name = attribute.key();
      vertex_bytes += name == "NORMAL"                         ? sizeof(Vec3)
                      : name == "TANGENT" || name == "COLOR_0" ? sizeof(Vec4)
                      : name.starts_with("TEXCOORD_")          ? sizeof(Vec2)
                                                               : 0;
    }
    size.triangles += triangles;
    size.vertices += used;
    if (triangles == 0) continue;
    size.bytes +=
        sizeof(Part) + triangles * (sizeof(UVec3) + sizeof(std::uint32_t) + kScratchPerTriangle) + used * vertex_bytes;
  }
  return size;
}

void MeshWriter::reserve(const MeshSize& size) {
  scene_.triangles.reserve(static_cast<std::size_t>(size.triangles));
  scene_.triangle_part.reserve(static_cast<std::size_t>(size.triangles));
  world_.reserve(static_cast<std::size_t>(size.vertices));
}

// ---------------------------------------------------------------- reading a primitive

void MeshWriter::add(const Placement& placement) {
  for (const Json primitive : placement.mesh["primitives"]) add_primitive(primitive, placement);
}

void MeshWriter::check(Json mesh) {
  for (const Json primitive : mesh["primitives"]) {
    const Json position = primitive["attributes"]["POSITION"];
    if (!position || primitive["mode"].integer(kTriangles) < kTriangles) continue;
    read_corners(primitive, model_.accessors[position.index()].count());
    read_attributes(primitive, {{}, mesh, {}, nullptr}, UvSets{});
  }
}

Accessor MeshWriter::attribute(Json attributes, std::string_view name, std::string_view types, unsigned formats,
                               unsigned quantized_formats) {
  const Json reference = attributes[name];
  if (!reference) return {};
  Accessor accessor = model_.accessors[reference.index()];
  const unsigned format = format_bit(accessor.component_type(), accessor.normalized());
  const bool known = types.find(accessor.type()) != std::string_view::npos && (format & (formats | quantized_formats)) != 0;
  if (!known) reference.fail(format_text(accessor) + " is not a format for this");
  if ((format & formats) == 0 && !model_.quantized)
    model_.notes.add("integer vertex attributes are used without declaring KHR_mesh_quantization");
  return accessor;
}

/// All attributes of a primitive and its targets have as many elements as POSITION, also those that are not read.
void MeshWriter::require_count(Json attributes, std::size_t wanted) const {
  for (const Json member : attributes) {
    const auto count = model_.accessors[member.index()].count();
    if (count != wanted) member.fail("has " + std::to_string(count) + " elements, POSITION has " + std::to_string(wanted));
  }
}

MeshWriter::Attributes MeshWriter::read_attributes(Json primitive, const Placement& placement, const UvSets& sets) {
  const Json json = primitive["attributes"];
  Attributes a;
  a.position = attribute(json, "POSITION", "VEC3", kF32, kAnySmall);
  a.normal = attribute(json, "NORMAL", "VEC3", kF32, kI8N | kI16N);
  a.tangent = attribute(json, "TANGENT", "VEC4", kF32, kI8N | kI16N);
  a.color = attribute(json, "COLOR_0", "VEC3 VEC4", kF32 | kU8N | kU16N, 0);
  for (const std::size_t set : {0, 1}) {
    a.uv[set] = attribute(json, "TEXCOORD_" + std::to_string(sets.texcoord[set]), "VEC2", kF32 | kU8N | kU16N, kAnySmall);
    if (!a.uv[set] && sets.used[set])
      model_.notes.count("textured mesh has no texture coordinates", "textured meshes have no texture coordinates", 1);
  }
  if (placement.joints != nullptr) {
    for (int set = 0;; ++set) {
      const std::string number = std::to_string(set);
      const Accessor joints = attribute(json, "JOINTS_" + number, "VEC4", kU8 | kU16, 0),
                     weights = attribute(json, "WEIGHTS_" + number, "VEC4", kF32 | kU8N | kU16N, 0);
      if (!joints && !weights) break;
      if (!joints || !weights) json.fail("JOINTS_" + number + " and WEIGHTS_" + number + " are not both there");
      a.joints.push_back(joints);
      a.weights.push_back(weights);
    }
  }

  // Morph targets with the default weights of the node or else the mesh.
  const Json weights = placement.node["weights"] ? placement.node["weights"] : placement.mesh["weights"];
  std::vector<double> weight_of;
  for (const Json weight : weights) weight_of.push_back(weight.number(0));
  std::size_t i = 0;
  for (const Json target : primitive["targets"]) {
    const double weight = i < weight_of.size() ? weight_of[i] : 0;
    ++i;
    if (weight == 0) continue;
    a.targets.push_back({weight, attribute(target, "POSITION", "VEC3", kF32, kAnySmall),
                         attribute(target, "NORMAL", "VEC3", kF32, kI8N | kI16N),
                         attribute(target, "TANGENT", "VEC3", kF32, kI8N | kI16N)});
  }
  return a;
}

/// Fills corners_ with the file's vertex numbers, three for each triangle; false if there is none.
bool MeshWriter::read_corners(Json primitive, std::size_t vertex_count) {
  const std::int64_t mode = primitive["mode"].integer(kTriangles);
  if (mode < kTriangles) {
    model_.notes.count("primitive of points or lines is ignored", "primitives of points or lines are ignored", 1);
    return false;
  }
  Accessor indices;
  if (const Json reference = primitive["indices"]) {
    indices = attribute(primitive, "indices", "SCALAR", kU8 | kU16 | kU32, 0);
  }
  const std::size_t count = indices ? indices.count() : vertex_count;
  const std::size_t triangles = triangle_count(mode, count);
  if (mode == kTriangles && count % 3 != 0)
    model_.notes.count("primitive ends with an incomplete triangle", "primitives end with an incomplete triangle", 1);
  if (vertex_count > UINT32_MAX || triangles * 3 > UINT32_MAX)
    primitive.fail("has more than 4,294,967,295 vertices or corners");

  const std::uint32_t restart = !indices                                         ? UINT32_MAX
                                : component_bytes(indices.component_type()) == 1 ? 0xff
                                : component_bytes(indices.component_type()) == 2 ? 0xffff
                                                                                 : UINT32_MAX;
  const auto vertex = [&](std::size_t i) {
    if (!indices) return static_cast<std::uint32_t>(i);
    const std::uint32_t index = indices.index(i);
    if (index == restart)
      indices.json().fail("element " + std::to_string(i) + " is " + std::to_string(index) +
                          ", which stands for primitive restart and is not allowed");
    if (index >= vertex_count)
      indices.json().fail("element " + std::to_string(i) + " is " + std::to_string(index) + ", but there are only " +
                          std::to_string(vertex_count) + " vertices");
    return index;
  };
  corners_.clear();
  corners_.reserve(triangles * 3);
  for (std::size_t t = 0; t < triangles; ++t) {
    // As section 3.7.2.1 of the specification lists them: strips alternate, fans turn around the first vertex.
    const std::size_t odd = t % 2;
    const std::array<std::size_t, 3> at = mode == kTriangles ? std::array{3 * t, 3 * t + 1, 3 * t + 2}
                                          : mode == kStrip   ? std::array{t, t + 1 + odd, t + 2 - odd}
                                                             : std::array{t + 1, t + 2, std::size_t{0}};
    for (const std::size_t i : at) corners_.push_back(vertex(i));
  }
  return triangles > 0;
}

/// Numbers the vertices that corners_ uses in order of first use, and renumbers corners_. Takes time by the number of corners,
/// not of vertices: many primitives may share one large vertex buffer.
void MeshWriter::number_vertices(std::size_t vertex_count) {
  vertices_.clear();
  if (vertex_count > 16 * corners_.size() + 4096) {
    vertices_ = corners_;
    std::sort(vertices_.begin(), vertices_.end());
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    for (std::uint32_t& corner : corners_)
      corner = static_cast<std::uint32_t>(std::lower_bound(vertices_.begin(), vertices_.end(), corner) - vertices_.begin());
    return;
  }
  if (stamps_.size() < vertex_count) {
    stamps_.resize(vertex_count, 0);
    numbers_.resize(vertex_count);
  }
  ++stamp_;
  for (std::uint32_t& corner : corners_) {
    if (stamps_[corner] != stamp_) {
      stamps_[corner] = stamp_;
      numbers_[corner] = static_cast<std::uint32_t>(vertices_.size());
      vertices_.push_back(corner);
    }
    corner = numbers_[corner];
  }
}

// ---------------------------------------------------------------- writing a primitive

void MeshWriter::add_primitive(Json primitive, const Placement& placement) {
  const Json position = primitive["attributes"]["POSITION"];
  if (!position)
    return model_.notes.count("primitive without positions is ignored", "primitives without positions are ignored", 1);
  if (!read_corners(primitive, model_.accessors[position.index()].count())) return;

  Part part;
  part.material = materials_.use(primitive["material"]);
  const Attributes attributes = read_attributes(primitive, placement, materials_.uv_sets(part.material));
  if (!attributes.position.has_data() && primitive["extensions"]["KHR_draco_mesh_compression"])
    primitive.fail("the extension KHR_draco_mesh_compression is not supported, and there is no uncompressed data beside it");
  number_vertices(attributes.position.count());

  part.has_normals = static_cast<bool>(attributes.normal);
  part.has_tangents = attributes.tangent && attributes.normal;
  part.has_colors = static_cast<bool>(attributes.color);
  part.mesh = read_name(placement.mesh);
  part.node = read_name(placement.node);
  read_tags(placement.node, part.tags);
  read_tags(placement.mesh, part.tags);

  const bool is_strip = primitive["mode"].integer(kTriangles) == kStrip;
  for (const Affine& world : placement.worlds) {
    if (world_.size() + vertices_.size() > UINT32_MAX || scene_.triangles.size() + corners_.size() / 3 > UINT32_MAX) {
      primitive.fail("the scene has more than 4,294,967,295 vertices or triangles");
    }
    append_part(part, attributes, world, placement.joints, is_strip);
  }
}

void MeshWriter::append_part(Part part, const Attributes& attributes, const Affine& world, const std::vector<Affine>* joints,
                             bool is_strip) {
  const auto first_vertex = static_cast<std::uint32_t>(world_.size());
  part.first_triangle = static_cast<std::uint32_t>(scene_.triangles.size());
  std::vector<bool> mirrored(vertices_.size(), false);
  const auto append = [&](std::size_t i, const Affine& transform, const glm::dmat3& normal_transform, bool is_mirrored) {
    mirrored[i] = is_mirrored;
    append_vertex(attributes, part, transform, normal_transform, vertices_[i]);
  };
  if (joints == nullptr || attributes.joints.empty()) {
    const bool is_mirrored = glm::determinant(world.linear) < 0;
    const glm::dmat3 normal_transform = normal_matrix(world.linear);
    for (std::size_t i = 0; i < vertices_.size(); ++i) append(i, world, normal_transform, is_mirrored);
  } else {
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      const Affine transform = skin_transform(attributes, *joints, world, vertices_[i]);
      append(i, transform, normal_matrix(transform.linear), glm::determinant(transform.linear) < 0);
    }
  }
  append_triangles(mirrored, first_vertex, is_strip);
  part.triangle_count = static_cast<std::uint32_t>(scene_.triangles.size()) - part.first_triangle;
  if (part.triangle_count == 0) return;
  scene_.triangle_part.resize(scene_.triangles.size(), static_cast<std::uint32_t>(scene_.parts.size()));
  scene_.parts.push_back(std::move(part));
}

/// The joints' mean transform, weighted as the vertex says; the node's own if it says nothing.
Affine MeshWriter::skin_transform(const Attributes& attributes, const std::vector<Affine>& joints, const Affine& world,
                                  std::size_t vertex) const {
  Affine sum{glm::dmat3(0.0), DVec3(0.0)};
  double total = 0;
  for (std::size_t set = 0; set < attributes.joints.size(); ++set) {
    const auto indices = attributes.joints[set].get<4>(vertex), weights = attributes.weights[set].get<4>(vertex);
    for (std::size_t k = 0; k < 4; ++k) {
      if (weights[k] == 0) continue;
      const auto joint = static_cast<std::size_t>(indices[k]);
      if (joint >= joints.size()) {
        attributes.joints[set].json().fail("element " + std::to_string(vertex) + " names joint " + std::to_string(joint) +
                                           ", but the skin has only " + std::to_string(joints.size()));
      }
      sum.linear += joints[joint].linear * weights[k];
      sum.translation += joints[joint].translation * weights[k];
      total += weights[k];
    }
  }
  return total == 0 ? world : Affine{sum.linear / total, sum.translation / total};
}

void MeshWriter::append_vertex(const Attributes& attributes, const Part& part, const Affine& transform,
                               const glm::dmat3& normal_transform, std::size_t vertex) {
  DVec3 position = attributes.position.vec3(vertex), normal(0.0);
  std::array<double, 4> tangent{};
  if (part.has_normals) normal = attributes.normal.vec3(vertex);
  if (part.has_tangents) tangent = attributes.tangent.get<4>(vertex);
  for (const Target& target : attributes.targets) {
    if (target.position) position += target.weight * target.position.vec3(vertex);
    if (target.normal) normal += target.weight * target.normal.vec3(vertex);
    if (!target.tangent) continue;
    const DVec3 delta = target.weight * target.tangent.vec3(vertex);
    for (int k = 0; k < 3; ++k) tangent[static_cast<std::size_t>(k)] += delta[static_cast<std::size_t>(k)];
  }
  world_.push_back(transform.point(position));

  append(scene_.normals, world_, part.has_normals, part.has_normals ? unit_or_zero(normal_transform * normal) : Vec3(0),
         Vec3(0));
  Vec4 world_tangent(0);
  if (part.has_tangents) {
    // Under a mirroring transform the bitangent turns against normal x tangent.
    const double side = glm::dot(glm::cross(transform.linear[0], transform.linear[1]), transform.linear[2]) < 0 ? -1 : 1;
    const Vec3 direction = unit_or_zero(transform.linear * DVec3(tangent[0], tangent[1], tangent[2]));
    world_tangent = Vec4(direction, (tangent[3] < 0 ? -1 : 1) * side);
  }
  append(scene_.tangents, world_, part.has_tangents, world_tangent, Vec4(0));

  for (const std::size_t set : {0, 1}) {
    const Accessor& uv = attributes.uv[set];
    const auto at = uv ? uv.get<2>(vertex) : std::array<double, 2>{};
    append(scene_.uvs[set], world_, static_cast<bool>(uv), Vec2(finite_or(at[0], 0), finite_or(at[1], 0)), Vec2(0));
  }
  std::array<double, 4> color{1, 1, 1, 1};
  if (part.has_colors) {
    color = attributes.color.get<4>(vertex);
    if (attributes.color.components() == 3) color[3] = 1;
  }
  const auto clamped = [&](std::size_t k) { return std::clamp(finite_or(color[k], 1), 0.0f, 1.0f); };
  append(scene_.colors, world_, part.has_colors, Vec4(clamped(0), clamped(1), clamped(2), clamped(3)), Vec4(1));
}

void MeshWriter::append_triangles(const std::vector<bool>& mirrored, std::uint32_t first_vertex, bool is_strip) {
  double broken = 0, degenerate = 0;  // strips are sewn together with triangles without area: those need no note
  for (std::size_t i = 0; i < corners_.size(); i += 3) {
    UVec3 triangle(corners_[i], corners_[i + 1], corners_[i + 2]);
    const bool flip = mirrored[triangle.x];
    triangle += first_vertex;
    const DVec3 &a = world_[triangle.x], &b = world_[triangle.y], &c = world_[triangle.z];
    if (!is_usable(a) || !is_usable(b) || !is_usable(c)) {
      ++broken;
      continue;
    }
    const DVec3 u = b - a, v = c - a, n = glm::cross(u, v);
    constexpr double kLeastSine = 1e-14;
    if (!(glm::dot(n, n) > kLeastSine * kLeastSine * glm::dot(u, u) * glm::dot(v, v))) {
      degenerate += is_strip ? 0 : 1;
      continue;
    }
    if (flip) std::swap(triangle.y, triangle.z);
    scene_.triangles.push_back(triangle);
  }
  if (broken > 0)
    model_.notes.count("triangle with a position that is not a finite number or beyond 1e30 was dropped",
                       "triangles with positions that are not finite numbers or beyond 1e30 were dropped", broken);
  if (degenerate > 0)
    model_.notes.count("triangle without area was dropped", "triangles without area were dropped", degenerate);
}

}  // namespace ln::gltf
