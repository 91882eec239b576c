// What a glTF file means, checked on small files that are written here.

#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "gltf_file.hpp"

namespace {

using namespace ln;
using namespace ln::test;

// ---------------------------------------------------------------- shapes

/// A box from (0, 0, 0) to (2, 1, 0.5), its faces outwards.
const std::vector<float> kBoxPositions{0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1, 0, 0, 0, 0.5f, 2, 0, 0.5f, 2, 1, 0.5f, 0, 1, 0.5f};
const std::vector<std::uint16_t> kBoxIndices{0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                             2, 3, 7, 2, 7, 6, 1, 2, 6, 1, 6, 5, 0, 4, 7, 0, 7, 3};

const std::string kOneMesh =
    R"("scene":0,"scenes":[{"nodes":[0]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)";

GltfFile box() {
  GltfFile file;
  file.floats("VEC3", kBoxPositions);
  file.indices(kBoxIndices);
  return file;
}

SceneData load_box(const std::string& node) { return box().load(kOneMesh + "\"nodes\":[" + node + "]"); }

DVec3 world(const SceneData& scene, std::uint32_t vertex) { return scene.origin + scene.unit * DVec3(scene.positions[vertex]); }

double volume(const SceneData& scene) {
  double sum = 0;
  for (const UVec3& t : scene.triangles)
    sum += glm::dot(world(scene, t.x), glm::cross(world(scene, t.y), world(scene, t.z))) / 6;
  return sum;
}

double area(const SceneData& scene) {
  double sum = 0;
  for (const UVec3& t : scene.triangles)
    sum += 0.5 * glm::length(glm::cross(world(scene, t.y) - world(scene, t.x), world(scene, t.z) - world(scene, t.x)));
  return sum;
}

/// Triangles as world positions, each beginning with its least corner (so winding counts), sorted.
std::vector<std::array<std::array<double, 3>, 3>> triangles(const SceneData& scene) {
  std::vector<std::array<std::array<double, 3>, 3>> all;
  for (const UVec3& t : scene.triangles) {
    std::array<std::array<double, 3>, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const DVec3 p = world(scene, t[k]);
      for (std::size_t c = 0; c < 3; ++c) corners[k][c] = std::round(p[c] * 1e5) / 1e5 + 0.0;
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.push_back(corners);
  }
  std::sort(all.begin(), all.end());
  return all;
}

bool has_note(const SceneData& scene, const std::string& part) {
  return std::any_of(scene.notes.begin(), scene.notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

template <class V>
void check_near(const V& value, const V& wanted, double slack = 1e-5) {
  for (std::size_t c = 0; c < static_cast<std::size_t>(V::length()); ++c)
    CHECK(static_cast<double>(value[c]) == doctest::Approx(static_cast<double>(wanted[c])).epsilon(slack).scale(1));
}

}  // namespace

// ---------------------------------------------------------------- coordinates

TEST_CASE("coordinates are centred and divided by a power of two") {
  const SceneData scene = load_box(R"({"mesh":0,"translation":[10,20,30]})");
  check_near(scene.origin, DVec3(11, 20.5, 30.25));
  CHECK(scene.unit == 2);  // the half diagonal is 1.1456
  CHECK(scene.triangles.size() == 12);
  CHECK(scene.positions.size() == 8);
  CHECK(volume(scene) == doctest::Approx(1));
  double farthest = 0;
  for (const Vec3& p : scene.positions) farthest = std::max(farthest, static_cast<double>(glm::length(p)));
  CHECK((farthest > 0.5 && farthest <= 1));
}

TEST_CASE("power-of-two scales and exact shifts give the same bits") {
  const std::string rest =
      R"("scene":0,"scenes":[{"nodes":[1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
    "cameras":[{"type":"orthographic","orthographic":{"xmag":1,"ymag":2,"znear":0,"zfar":9}}],"extensionsUsed":["KHR_lights_punctual"],
    "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3}]}},
    "nodes":[{"mesh":0,"rotation":[0.5,0.5,0.5,0.5]},{"children":[0,2,3])";
  const std::string tail =
      R"(},{"camera":0,"translation":[3,1,5]},{"translation":[1,2,3],"extensions":{"KHR_lights_punctual":{"light":0}}}])";
  const GltfFile file = box();
  const SceneData plain = file.load(rest + tail);
  for (const std::string transform :
       {R"("scale":[1048576,1048576,1048576])", R"("scale":[9.5367431640625e-07,9.5367431640625e-07,9.5367431640625e-07])",
        R"("translation":[8388608,-4194304,12345.5])"}) {
    const SceneData moved = file.load(rest + "," + transform + tail);
    CHECK(moved.positions == plain.positions);
    CHECK(moved.triangles == plain.triangles);
    CHECK(moved.cameras.at(0).position == plain.cameras.at(0).position);
    CHECK(moved.lights.at(0).position == plain.lights.at(0).position);
    if (transform[1] == 's') continue;
    CHECK(moved.cameras[0].ymag == plain.cameras[0].ymag);
    CHECK(moved.lights[0].intensity == plain.lights[0].intensity);
  }
}

TEST_CASE("a scene without triangles has origin 0 and unit 1") {
  const SceneData scene = GltfFile().load(
      R"("nodes":[{"camera":0,"translation":[1,2,3]}],"cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":1}}])");
  CHECK(scene.unit == 1);
  CHECK(scene.origin == DVec3(0));
  CHECK(scene.materials.size() == 1);
  CHECK(scene.cameras.at(0).position == Vec3(1, 2, 3));
}

// ---------------------------------------------------------------- transforms

TEST_CASE("matrices and translation, rotation, scale mean the same") {
  const SceneData trs =
      load_box(R"({"mesh":0,"translation":[1,2,3],"rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[2,3,4]})");
  const SceneData matrix = load_box(R"({"mesh":0,"matrix":[0,2,0,0,-3,0,0,0,0,0,4,0,1,2,3,1]})");
  CHECK(triangles(trs) == triangles(matrix));
  CHECK(volume(trs) == doctest::Approx(24));
}

TEST_CASE("children stand in their parents' frame") {
  const SceneData scene = box().load(
      kOneMesh +
      R"("nodes":[{"children":[1],"scale":[2,2,2],"translation":[0,0,100]},{"children":[2],"translation":[10,0,0]},{"mesh":0}])");
  check_near(scene.origin, DVec3(22, 1, 100.5));
  CHECK(volume(scene) == doctest::Approx(8));
}

TEST_CASE("mirroring transforms keep the front in front and normals outwards") {
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  file.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
  file.floats("VEC4", {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1});
  const std::string rest =
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TANGENT":2}}]}],"nodes":[{"mesh":0,"scale":)";
  for (const auto& [scale, handedness] : {std::pair{"[1,1,1]", 1.0f},
                                          {"[-1,1,1]", -1.0f},
                                          {"[2,-3,1]", -1.0f},
                                          {"[1,1,-1]", -1.0f},
                                          {"[-1,-1,1]", 1.0f},
                                          {"[-1,-1,-5]", -1.0f}}) {
    const SceneData scene = file.load(rest + std::string(scale) + "}]");
    const UVec3 t = scene.triangles.at(0);
    const Vec3 front = glm::cross(scene.positions[t.y] - scene.positions[t.x], scene.positions[t.z] - scene.positions[t.x]);
    CHECK(glm::dot(front, scene.normals[t.x]) > 0);
    CHECK(glm::length(scene.normals[t.x]) == doctest::Approx(1));
    CHECK(scene.tangents[t.x].w == handedness);
  }
  CHECK(volume(load_box(R"({"mesh":0,"scale":[-1,1,1]})")) == doctest::Approx(1));
  CHECK(volume(load_box(R"({"mesh":0,"scale":[-1,-2,-1]})")) == doctest::Approx(2));
}

TEST_CASE("normals follow non-uniform scales by the inverse transpose") {
  GltfFile file;
  const float h = std::sqrt(0.5f);
  file.floats("VEC3", {1, 0, 0, 0, 1, 0, 0, 1, 1});  // in the plane x + y = 1
  file.floats("VEC3", {h, h, 0, h, h, 0, 0, 0, 0});  // the last one has no direction
  const SceneData scene =
      file.load(R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}],"nodes":[{"mesh":0,"scale":[3,1,1]}])");
  check_near(scene.normals[scene.triangles[0].x], Vec3(1, 3, 0) / std::sqrt(10.0f));
  CHECK(std::count(scene.normals.begin(), scene.normals.end(), Vec3(0)) == 1);
}

TEST_CASE("singular transforms drop what has no area, with a note") {
  const SceneData nothing = load_box(R"({"mesh":0,"scale":[0,0,0]})");
  CHECK(nothing.triangles.empty());
  CHECK(has_note(nothing, "12 triangles without area were dropped"));
  const SceneData flat = load_box(R"({"mesh":0,"scale":[1,1,0]})");  // top and bottom fall together
  CHECK(flat.triangles.size() == 2);
  CHECK(has_note(flat, "2 triangles with the same corners"));
  CHECK(area(flat) == doctest::Approx(2));
}

TEST_CASE("quaternions of any length are normalised, matrices that are not affine refused") {
  const SceneData scene = load_box(R"({"mesh":0,"rotation":[0,0,0.5,0.5]})");
  CHECK(volume(scene) == doctest::Approx(1));
  CHECK(has_note(scene, "1 rotation is not a unit quaternion"));
  const auto error = [](const std::string& node) { return load_error(box().text(kOneMesh + "\"nodes\":[" + node + "]")); };
  CHECK(error(R"({"mesh":0,"rotation":[0,0,0,0]})") == "scene.gltf: nodes[0].rotation: the quaternion is zero");
  CHECK(error(R"({"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,1,0,0,0,1]})") ==
        "scene.gltf: nodes[0].matrix: the last row is not 0 0 0 1");
}

TEST_CASE("chains of nodes may be deep, cycles and shared children are errors") {
  std::string nodes;
  constexpr int kDepth = 50000;
  for (int i = 0; i + 1 < kDepth; ++i) nodes += "{\"children\":[" + std::to_string(i + 1) + "],\"translation\":[1,0,0]},";
  const SceneData deep = box().load(kOneMesh + "\"nodes\":[" + nodes + "{\"mesh\":0}]");
  CHECK(deep.origin.x == kDepth);
  const auto error = [](const std::string& nodes) {
    return load_error("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[" + nodes + "]}");
  };
  CHECK(error(R"({"children":[1]},{"children":[0]})") ==
        "scene.gltf: nodes[0]: the node is its own descendant, or below one that is");
  CHECK(error(R"({"children":[1,1]},{})") ==
        "scene.gltf: nodes[0].children[1]: nodes[1] is a child of nodes[0] already; nodes must form trees");
  CHECK(error(R"({"children":[2]},{"children":[2]},{})") ==
        "scene.gltf: nodes[1].children[0]: nodes[2] is a child of nodes[0] already; nodes must form trees");
}

TEST_CASE("the default scene, else the first, else all roots") {
  const std::string nodes =
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0},{"mesh":0,"translation":[5,0,0]},{"children":[1]}])";
  const GltfFile file = box();
  CHECK(file.load(nodes).triangles.size() == 24);
  CHECK(file.load(R"("scenes":[{"nodes":[2]},{"nodes":[0]}],)" + nodes).origin.x == 6);
  CHECK(file.load(R"("scene":1,"scenes":[{"nodes":[2]},{"nodes":[0]}],)" + nodes).origin.x == 1);
  CHECK(file.load(R"("scenes":[{}],)" + nodes).triangles.empty());
  CHECK(load_error(file.text(R"("scenes":[{"nodes":[0,0]}],)" + nodes)) ==
        "scene.gltf: scenes[0].nodes[1]: nodes[0] is listed twice");
  CHECK(load_error(file.text(R"("scenes":[{"nodes":[1]}],)" + nodes)).find("is the child of another node") !=
        std::string::npos);
}

// ---------------------------------------------------------------- primitives and formats

TEST_CASE("lists, strips and fans, with and without indices, give the same triangles") {
  const std::vector<float> fan{0, 0, 0, 4, 0, 0, 3, 2, 0, 1, 3, 0, -2, 3, 0};
  const auto load = [](const std::vector<float>& positions, const std::vector<std::uint8_t>& bytes,
                       const std::vector<std::uint32_t>& words, int mode) {
    GltfFile file;
    file.floats("VEC3", positions);
    std::string indices;
    if (!bytes.empty()) file.accessor(5121, "SCALAR", bytes.size(), bytes);
    if (!words.empty()) file.accessor(5125, "SCALAR", words.size(), words);
    if (!bytes.empty() || !words.empty()) indices = ",\"indices\":1";
    return triangles(file.load("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":" +
                               std::to_string(mode) + indices + "}]}],\"nodes\":[{\"mesh\":0}]"));
  };
  const auto list = load(fan, {0, 1, 2, 0, 2, 3, 0, 3, 4}, {}, 4);
  CHECK(list.size() == 3);
  CHECK(load(fan, {}, {0, 1, 2, 0, 2, 3, 0, 3, 4}, 4) == list);
  CHECK(load(fan, {}, {}, 6) == list);
  CHECK(load(fan, {0, 1, 2, 3, 4}, {}, 6) == list);
  CHECK(load({0, 0, 0, 4, 0, 0, 3, 2, 0, 0, 0, 0, 3, 2, 0, 1, 3, 0, 0, 0, 0, 1, 3, 0, -2, 3, 0}, {}, {}, 4) == list);

  const std::vector<float> strip{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0};
  const auto strip_list = load(strip, {0, 1, 2, 1, 3, 2, 2, 3, 4}, {}, 4);
  CHECK(load(strip, {}, {}, 5) == strip_list);
  CHECK(load(strip, {0, 1, 2, 3, 4}, {}, 5) == strip_list);
}

TEST_CASE("points and lines are ignored with a note") {
  GltfFile file;
  file.floats("VEC3", kBoxPositions);
  std::string primitives;
  for (int mode = 0; mode < 4; ++mode)
    primitives += std::string(mode == 0 ? "" : ",") + "{\"attributes\":{\"POSITION\":0},\"mode\":" + std::to_string(mode) + "}";
  const SceneData scene = file.load("\"meshes\":[{\"primitives\":[" + primitives + "]}],\"nodes\":[{\"mesh\":0}]");
  CHECK(scene.triangles.empty());
  CHECK(has_note(scene, "4 primitives of points or lines are ignored"));
}

TEST_CASE("integer positions, plain and normalised") {
  const auto reference = triangles(load_box(R"({"mesh":0})"));
  // The box in steps of 1/2, and as fractions of 2.
  std::vector<std::int8_t> steps;
  std::vector<std::uint16_t> fractions;
  for (std::size_t i = 0; i < kBoxPositions.size(); ++i) {
    steps.push_back(static_cast<std::int8_t>(kBoxPositions[i] * 2));
    if (i % 3 == 2) steps.push_back(0);  // up to a multiple of four bytes
    fractions.push_back(static_cast<std::uint16_t>(std::lround(kBoxPositions[i] / 2 * 65535)));
    if (i % 3 == 2) fractions.push_back(0);
  }
  const auto load = [&](bool normalized) {
    GltfFile file;
    if (normalized) {
      file.accessor(5123, "VEC3", 8, fractions, "\"normalized\":true");
    } else {
      file.accessor(5120, "VEC3", 8, steps);
    }
    file.indices(kBoxIndices);
    std::string json =
        file.text(R"("extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],)" + kOneMesh +
                  "\"nodes\":[{\"mesh\":0,\"scale\":" + (normalized ? "[2,2,2]" : "[0.5,0.5,0.5]") + "}]");
    json.replace(json.find("\"byteOffset\":0,"), 15, normalized ? "\"byteStride\":8," : "\"byteStride\":4,");
    const TemporaryFolder folder;
    return load_gltf(folder.write("scene.gltf", json));
  };
  CHECK(triangles(load(false)) == reference);
  CHECK(area(load(true)) == doctest::Approx(area(load_box(R"({"mesh":0})"))).epsilon(1e-4));
  CHECK(load(true).notes.empty());
}

TEST_CASE("sparse accessors replace elements, with and without a base") {
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int indices = file.buffer_view(std::vector<std::uint8_t>{1, 2}),
            values = file.buffer_view(std::vector<float>{5, 0, 0, 0, 7, 0});
  const std::string sparse = "\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":" + std::to_string(indices) +
                             ",\"componentType\":5121},\"values\":{\"bufferView\":" + std::to_string(values) + "}}";
  const int with_base =
      file.accessor_text("{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"," + sparse + "}");
  const int without = file.accessor_text("{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"," + sparse + "}");
  for (const int accessor : {with_base, without}) {
    const SceneData scene = file.load("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":" + std::to_string(accessor) +
                                      "}}]}],\"nodes\":[{\"mesh\":0}]");
    CHECK(area(scene) == doctest::Approx(17.5));
  }
  const std::string unordered = "\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":" +
                                std::to_string(file.buffer_view(std::vector<std::uint8_t>{2, 2})) +
                                ",\"componentType\":5121},\"values\":{\"bufferView\":" + std::to_string(values) + "}}";
  file.accessor_text("{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"," + unordered + "}");
  CHECK(load_error(file.text("\"nodes\":[]")) ==
        "scene.gltf: accessors[3].sparse.indices: element 1 is not above the one before it");
}

TEST_CASE("vertex colours and texture coordinates in all their formats") {
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int rgb = file.accessor(5121, "VEC3", 3, std::vector<std::uint8_t>{255, 0, 51, 255, 0, 51, 255, 0, 51, 0, 0, 0},
                                "\"normalized\":true");
  const int rgba = file.accessor(
      5123, "VEC4", 3, std::vector<std::uint16_t>{65535, 0, 13107, 32768, 65535, 0, 13107, 32768, 65535, 0, 13107, 32768},
      "\"normalized\":true");
  const int floats = file.floats("VEC4", {2, -1, 0.2f, 0.5f, 2, -1, 0.2f, 0.5f, 2, -1, 0.2f, 0.5f});
  const int uv =
      file.accessor(5121, "VEC2", 3, std::vector<std::uint8_t>{0, 255, 51, 102, 255, 0, 0, 0}, "\"normalized\":true");
  const auto load = [&](int color) {
    return file.load(
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"COLOR_0\":" + std::to_string(color) +
        ",\"TEXCOORD_0\":" + std::to_string(uv) +
        "}},{\"attributes\":{\"POSITION\":0},\"material\":0}]}],\"materials\":[{\"alphaMode\":\"MASK\"}],\"nodes\":["
        "{\"mesh\":0}]");
  };
  for (const int color : {rgb, rgba, floats}) {
    const SceneData scene = load(color);
    REQUIRE(scene.colors.size() == 6);
    check_near(scene.colors[0], Vec4(1, 0, 0.2f, color == rgb ? 1.0f : 0.5f), 1e-4);
    CHECK(scene.colors[3] == Vec4(1));
    check_near(scene.uvs[0].at(1), Vec2(0.2f, 0.4f));
    CHECK(scene.uvs[0].at(4) == Vec2(0));
    CHECK(scene.uvs[1].empty());
    CHECK((scene.parts[0].has_colors && !scene.parts[1].has_colors));
  }
}

TEST_CASE("primitives take only the vertices they use from a shared buffer") {
  GltfFile file;
  std::vector<float> positions;
  for (int i = 0; i < 30000; ++i)
    positions.insert(positions.end(), {static_cast<float>(i), static_cast<float>(i % 7), static_cast<float>(i % 11)});
  file.floats("VEC3", positions);
  file.indices({29000, 29001, 29002});
  const SceneData scene = file.load(kOneMesh + "\"nodes\":[{\"mesh\":0}]");
  CHECK(scene.positions.size() == 3);
  CHECK(scene.origin.x == 29001);
}

TEST_CASE("meshes that break the rules, used or not") {
  const auto error = [](const std::string& primitive) {
    GltfFile file;
    file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    file.indices({0, 1, 3});
    file.floats("VEC4", {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0});
    file.floats("VEC3", {0, 0, 0});
    file.accessor(5121, "SCALAR", 3, std::vector<std::uint8_t>{0, 1, 255});
    return load_error(file.text("\"meshes\":[{\"primitives\":[{" + primitive + "}]}]"));
  };
  CHECK(error(R"("attributes":{"POSITION":0})") == "");
  CHECK(error(R"("attributes":{"POSITION":0},"indices":1)") ==
        "scene.gltf: accessors[1]: element 2 is 3, but there are only 3 vertices");
  CHECK(error(R"("attributes":{"POSITION":2})") ==
        "scene.gltf: meshes[0].primitives[0].attributes.POSITION: VEC4 of FLOAT is not a format for this");
  CHECK(error(R"("attributes":{"POSITION":0,"NORMAL":3})") ==
        "scene.gltf: meshes[0].primitives[0].attributes.NORMAL: has 1 elements, POSITION has 3");
  CHECK(error(R"("attributes":{"POSITION":0},"indices":0)") ==
        "scene.gltf: meshes[0].primitives[0].indices: VEC3 of FLOAT is not a format for this");
  CHECK(error(R"("attributes":{"POSITION":0},"indices":4)").find("primitive restart") != std::string::npos);
}

// ---------------------------------------------------------------- skins and morph targets

TEST_CASE("a skin at rest follows its joints and not its node") {
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  file.accessor(5121, "VEC4", 3, std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0});
  file.floats("VEC4", {1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0});
  // The second joint is bound at x = 10 and rests at x = 13.
  file.floats("MAT4", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -10, 0, 0, 1});
  const SceneData scene = file.load(
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}]}],"skins":[{"joints":[1,2],"inverseBindMatrices":3}],
    "nodes":[{"mesh":0,"skin":0,"translation":[500,0,0]},{},{"translation":[13,0,0]}])");
  const auto found = triangles(scene);
  REQUIRE(found.size() == 1);
  CHECK(found[0] == std::array<std::array<double, 3>, 3>{{{0, 0, 0}, {4, 0, 0}, {1.5, 1, 0}}});
  const std::string wrong = file.text(
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}]}],"skins":[{"joints":[1]}],"nodes":[{"mesh":0,"skin":0},{}])");
  CHECK(load_error(wrong) == "scene.gltf: accessors[1]: element 1 names joint 1, but the skin has only 1");
}

TEST_CASE("morph targets with their default weights; a node's weights win") {
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 0, 0});
  const std::string mesh = R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":1}]}])";
  CHECK(area(file.load(mesh + R"(}],"nodes":[{"mesh":0}])")) == doctest::Approx(0.5));
  CHECK(area(file.load(mesh + R"(,"weights":[1]}],"nodes":[{"mesh":0}])")) == doctest::Approx(1));
  CHECK(area(file.load(mesh + R"(,"weights":[1]}],"nodes":[{"mesh":0,"weights":[3]}])")) == doctest::Approx(2));
}

TEST_CASE("EXT_mesh_gpu_instancing is the same as several nodes") {
  GltfFile file = box();
  file.floats("VEC3", {0, 0, 0, 5, 0, 0, 0, 7, 0});
  file.floats("VEC3", {1, 1, 1, 2, 1, 1, 1, 1, 3});
  const SceneData instances = file.load(
      R"("extensionsUsed":["EXT_mesh_gpu_instancing"],)" + kOneMesh +
      R"("nodes":[{"mesh":0,"scale":[-2,2,2],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2,"SCALE":3}}}}])");
  const SceneData nodes = file.load(
      kOneMesh +
      R"("nodes":[{"children":[1,2,3],"scale":[-2,2,2]},{"mesh":0},{"mesh":0,"translation":[5,0,0],"scale":[2,1,1]},{"mesh":0,"translation":[0,7,0],"scale":[1,1,3]}])");
  CHECK(triangles(instances) == triangles(nodes));
  CHECK(volume(instances) == doctest::Approx(48));
}

// ---------------------------------------------------------------- degenerate, broken and duplicate triangles

TEST_CASE("triangles without area and with broken positions are dropped with one note each") {
  GltfFile file;
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, nan, 0, 0, 0, inf, 0, 3e38f, 0, 0, 2, 0, 0, 1e-40f, 0, 0});
  file.indices({0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 2, 5, 0, 1, 6, 0, 1, 1, 0, 1, 7});
  const SceneData scene = file.load(kOneMesh + "\"nodes\":[{\"mesh\":0}]");
  CHECK(scene.triangles.size() == 1);
  CHECK(scene.positions.size() == 3);
  CHECK(scene.triangle_part.size() == 1);
  CHECK(has_note(scene, "3 triangles with positions that are not finite numbers"));
  CHECK(has_note(scene, "3 triangles without area"));
}

TEST_CASE("of duplicate triangles one stays, the one that emits if there is one") {
  GltfFile file;
  file.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  file.indices({0, 1, 2, 2, 1, 0, 1, 2, 0});
  const auto load = [&](const std::string& first, const std::string& second) {
    return file.load(
        "\"materials\":[{" + first + "},{" + second +
        R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0},{"attributes":{"POSITION":0},"indices":1,"material":1}]}],"nodes":[{"mesh":0},{"mesh":0}])");
  };
  const SceneData plain = load("\"name\":\"a\"", "\"name\":\"b\"");
  CHECK(plain.triangles.size() == 1);
  CHECK(plain.parts.size() == 1);
  CHECK(plain.materials[plain.parts[0].material].name == "a");
  CHECK(has_note(plain, "11 triangles with the same corners as another one were dropped"));
  const SceneData emitting = load("\"name\":\"a\"", "\"name\":\"b\",\"emissiveFactor\":[1,1,1]");
  CHECK(emitting.triangles.size() == 1);
  CHECK(emitting.materials[emitting.parts.at(0).material].name == "b");
  CHECK(emitting.triangle_part.at(0) == 0);
  const SceneData masked = load("\"name\":\"a\",\"alphaMode\":\"MASK\"", "\"name\":\"b\"");
  CHECK(masked.triangles.size() == 2);
}

// ---------------------------------------------------------------- cameras and lights

TEST_CASE("cameras in node order, without the scale of their nodes") {
  const SceneData scene = box().load(R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
    "cameras":[{"name":"P","type":"perspective","perspective":{"yfov":0.7,"znear":1,"aspectRatio":1.5}},{"name":"O","type":"orthographic","orthographic":{"xmag":6,"ymag":4,"znear":0,"zfar":9}}],
    "nodes":[{"mesh":0},{"name":"a","camera":0,"translation":[1,0.5,10.25],"scale":[3,5,7]},{"name":"b","camera":1,"rotation":[0,0.7071067811865476,0,0.7071067811865476]},{"camera":0,"scale":[0,0,0]},{"children":[2,1]},{"camera":0,"translation":[0,0,1e20]}],"scenes":[{"nodes":[4,3,0,5]}])");
  REQUIRE(scene.cameras.size() == 2);
  const Camera &p = scene.cameras[0], &o = scene.cameras[1];
  CHECK((p.name == "P" && p.node == "a" && !p.orthographic));
  check_near(p.position, Vec3(0, 0, 5));
  check_near(p.forward, Vec3(0, 0, -1));
  check_near(p.right, Vec3(1, 0, 0));
  check_near(p.up, Vec3(0, 1, 0));
  CHECK(p.yfov == doctest::Approx(0.7));
  CHECK(p.aspect == doctest::Approx(1.5));
  CHECK((o.orthographic && o.node == "b"));
  check_near(o.forward, Vec3(-1, 0, 0));
  check_near(o.right, Vec3(0, 0, -1));
  CHECK(o.ymag == doctest::Approx(2));
  CHECK(o.aspect == doctest::Approx(1.5));
  CHECK(has_note(scene, "2 cameras are ignored"));
}

TEST_CASE("punctual lights") {
  const SceneData scene = box().load(
      R"("extensionsUsed":["KHR_lights_punctual"],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
    "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","name":"p","color":[1,0.5,0.25],"intensity":8,"range":3},{"type":"spot","intensity":2,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.5}},
    {"type":"directional","color":[0,1,0],"intensity":3},{"type":"spot","spot":{}}]}},
    "nodes":[{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[1,0.5,4.25],"extras":{"tags":["sun","key"]}},
    {"extensions":{"KHR_lights_punctual":{"light":1}},"rotation":[0.7071067811865476,0,0,0.7071067811865476],"scale":[2,3,4]},{"extensions":{"KHR_lights_punctual":{"light":2}},"translation":[1e30,0,0]},{"extensions":{"KHR_lights_punctual":{"light":3}}}])");
  REQUIRE(scene.lights.size() == 4);
  CHECK(scene.unit == 2);
  CHECK((scene.lights[0].kind == PunctualKind::point && scene.lights[0].name == "p"));
  CHECK(scene.lights[0].tags == std::vector<std::string>{"sun", "key"});
  check_near(scene.lights[0].position, Vec3(0, 0, 2));
  check_near(scene.lights[0].intensity, Vec3(2, 1, 0.5f));
  CHECK(scene.lights[1].kind == PunctualKind::spot);
  check_near(scene.lights[1].direction, Vec3(0, 1, 0));
  CHECK(scene.lights[1].cos_inner == doctest::Approx(std::cos(0.1)));
  CHECK(scene.lights[1].cos_outer == doctest::Approx(std::cos(0.5)));
  CHECK(scene.lights[1].intensity.x == doctest::Approx(0.5));
  CHECK(scene.lights[2].kind == PunctualKind::directional);
  check_near(scene.lights[2].intensity, Vec3(0, 3, 0));
  CHECK(scene.lights[3].cos_inner == 1);
  CHECK(scene.lights[3].cos_outer == doctest::Approx(std::sqrt(0.5)));
  CHECK(has_note(scene, "range"));
}

TEST_CASE("lights out of proportion to the scene are refused, not infinite") {
  const std::string text = box().text(
      kOneMesh +
      R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":1e20}]}},"nodes":[{"mesh":0,"scale":[1e-12,1e-12,1e-12],"extensions":{"KHR_lights_punctual":{"light":0}}}])");
  CHECK(load_error(text).find("lights[0].intensity: 1e+20 is out of proportion to the scene") != std::string::npos);
}

// ---------------------------------------------------------------- materials

namespace {

Material load_material(const std::string& material, const std::string& rest = {}) {
  const SceneData scene = box().load(
      "\"materials\":[{" + material +
      R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],"nodes":[{"mesh":0}])" + rest);
  return scene.materials.at(scene.parts.at(0).material);
}

}  // namespace

TEST_CASE("materials: defaults and factors") {
  const Material m = load_material("");
  CHECK(m.base_color == Color(1));
  CHECK((m.metallic == 1 && m.roughness == 1 && m.ior == 1.5f && m.specular == 1 && m.transmission == 0 && !m.solid &&
         !m.unlit && !m.double_sided));
  CHECK(!m.emits());
  CHECK(m.attenuation_distance == kInfinity);

  const Material f = load_material(
      R"("name":"f","extras":{"tags":"one"},"doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.25,"emissiveFactor":[1,0.5,0],
    "pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,0.4],"metallicFactor":0.5,"roughnessFactor":0.6},"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":10},"KHR_materials_ior":{"ior":1.33},
    "KHR_materials_transmission":{"transmissionFactor":0.7},"KHR_materials_volume":{"thicknessFactor":0.1,"attenuationDistance":4,"attenuationColor":[0.9,0.8,0.7]},"KHR_materials_specular":{"specularFactor":0.8,"specularColorFactor":[2,1,0]}})");
  CHECK((f.name == "f" && f.tags == std::vector<std::string>{"one"}));
  check_near(f.base_color, Color(0.1f, 0.2f, 0.3f));
  CHECK(f.alpha == doctest::Approx(0.4));
  CHECK((f.alpha_mode == AlphaMode::mask && f.alpha_cutoff == 0.25f && f.double_sided));
  CHECK(
      (f.metallic == 0.5f && f.roughness == 0.6f && f.ior == 1.33f && f.transmission == 0.7f && f.solid && f.specular == 0.8f));
  check_near(f.emission, Color(10, 5, 0));
  CHECK(f.attenuation_distance == 2);  // the unit is 2
  check_near(f.attenuation_color, Color(0.9f, 0.8f, 0.7f));
  check_near(f.specular_color, Color(2, 1, 0));

  CHECK(!load_material(R"("extensions":{"KHR_materials_volume":{}})").solid);
  CHECK(load_material(R"("extensions":{"KHR_materials_ior":{"ior":0}})").ior == 1e4f);
  const Material unlit = load_material(
      R"("pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,1]},"emissiveFactor":[1,1,1],"extensions":{"KHR_materials_unlit":{}})");
  CHECK((unlit.unlit && unlit.emission == unlit.base_color));
}

TEST_CASE("specular-glossiness as a dielectric of the same reflectance") {
  const Material m = load_material(
      R"("extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.4,0.3,1],"specularFactor":[0.08,0.04,0],"glossinessFactor":0.75}})");
  CHECK((m.metallic == 0 && m.roughness == 0.25f));
  check_near(m.base_color, Color(0.5f, 0.4f, 0.3f));
  check_near(0.04f * m.specular_color, Color(0.08f, 0.04f, 0));
}

TEST_CASE("only what is used is loaded") {
  const SceneData scene = box().load(
      R"("materials":[{"name":"a"},{"name":"b","normalTexture":{"index":0}},{"name":"c"}],"textures":[{"source":0}],"images":[{"uri":"missing.png"}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":2}]}],"nodes":[{"mesh":0}])");
  REQUIRE(scene.materials.size() == 1);
  CHECK(scene.materials[0].name == "c");
  CHECK(scene.images.empty());
}

TEST_CASE("names and tags of meshes and nodes") {
  const SceneData scene = box().load(
      R"("meshes":[{"name":"M","extras":{"tags":["x",3,"y"]},"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"name":"N","mesh":0,"extras":{"tags":"z"}},{"mesh":0,"scale":[2,2,2],"extras":[1]}])");
  REQUIRE(scene.parts.size() == 2);
  CHECK((scene.parts[0].mesh == "M" && scene.parts[0].node == "N"));
  CHECK(scene.parts[0].tags == std::vector<std::string>{"z", "x", "y"});
  CHECK(scene.parts[1].tags == std::vector<std::string>{"x", "y"});
  CHECK(scene.parts[1].first_triangle == 12);
}

// ---------------------------------------------------------------- extensions

TEST_CASE("extensions: required ones must be supported, others are noted once") {
  const auto text = [](const std::string& rest) { return box().text(rest + kOneMesh + "\"nodes\":[{\"mesh\":0}]"); };
  CHECK(load_error(text(R"("extensionsUsed":["X_y"],"extensionsRequired":["X_y"],)")) ==
        "scene.gltf: extensionsRequired[0]: the extension X_y is required, but not supported");
  const TemporaryFolder folder;
  const SceneData scene =
      load_gltf(folder.write("a.gltf", text(R"("extensionsUsed":["X_y","X\u001b[2J","KHR_materials_ior"],)")));
  REQUIRE(scene.notes.size() == 2);
  CHECK(scene.notes[0] == "the extension X_y is not supported and ignored");
  CHECK(scene.notes[1] == "the extension X\\x1b[2J is not supported and ignored");
  CHECK(
      load_error(
          R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4}],"bufferViews":[{"buffer":0,"byteLength":4,"extensions":{"EXT_meshopt_compression":{}}}]})")
          .find("EXT_meshopt_compression") != std::string::npos);
}

TEST_CASE("versions") {
  CHECK(load_error(R"({"asset":{"version":"2.1"}})") == "");
  CHECK(load_error(R"({"asset":{"version":"1.0"}})") == "scene.gltf: asset.version: glTF 1.0 is not supported, only 2.0 is");
  CHECK(load_error(R"({"asset":{"version":"2.1","minVersion":"2.1"}})") ==
        "scene.gltf: asset.minVersion: the file needs a reader of glTF 2.1; this one reads 2.0");
  CHECK(load_error(R"({"asset":{"version":"2"}})") == "scene.gltf: asset.version: \"2\" is not a version like \"2.0\"");
  CHECK(load_error("{}") == "scene.gltf: asset.version is missing: is this a glTF file?");
}

// ---------------------------------------------------------------- files

TEST_CASE("only regular files in the model's folder are opened") {
  const TemporaryFolder folder;
  folder.write("secret.bin", std::string(36, 's'));
  folder.write("model/data.bin", std::string(36, '\0'));
  folder.write("model/deep/with blank.bin", std::string(36, '\0'));
  namespace fs = std::filesystem;
  const fs::path model = folder.path() / "model";
  fs::create_symlink("../secret.bin", model / "out.bin");
  fs::create_symlink("data.bin", model / "in.bin");
  fs::create_symlink("/dev/zero", model / "zero.bin");
  fs::create_directory_symlink("..", model / "up");
  REQUIRE(mkfifo((model / "fifo").c_str(), 0600) == 0);
  const auto error = [&](const std::string& uri) {
    const std::string text = R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":")" + uri + "\"}]}";
    try {
      load_gltf(folder.write("model/scene.gltf", text));
    } catch (const Error& error) {
      const std::string message = error.what();
      return message.substr(message.find("buffers[0]"));
    }
    return std::string();
  };
  for (const char* uri :
       {"data.bin", "./data.bin", "deep/../data.bin", "deep/with%20blank.bin", "deep/with blank.bin", "in.bin", "%64ata.bin"})
    CHECK(error(uri) == "");
  for (const char* uri : {"../secret.bin", "%2e%2e/secret.bin", "deep/../../secret.bin", "out.bin", "up/secret.bin", "zero.bin",
                          "up/model/data.bin"})
    CHECK(error(uri).find("leads out of the model's folder") != std::string::npos);
  CHECK(error("/etc/passwd").find("absolute path") != std::string::npos);
  CHECK(error("%2fetc/passwd").find("absolute path") != std::string::npos);
  for (const char* uri : {"file:data.bin", "http://localhost/x", "HTTPS://x/y", "c:data.bin"})
    CHECK(error(uri).find("only files beside the model are read") != std::string::npos);
  CHECK(error("fifo").find("is not a regular file") != std::string::npos);
  CHECK(error("deep").find("is a folder") != std::string::npos);
  CHECK(error("none.bin").find("no such file") != std::string::npos);
  CHECK(error("data.bin%00.png").find("zero byte") != std::string::npos);
  CHECK(error("") == "buffers[0].uri: \"\": the name of the file is empty");
}

TEST_CASE("files that are no models") {
  const TemporaryFolder folder;
  const auto error = [](const std::string& path) {
    try {
      load_gltf(path);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(error("/nowhere/x.gltf") != "");
  CHECK(error(folder.path().string()).find("is a folder, not a file") != std::string::npos);
  CHECK(error(folder.write("empty.gltf", "")).find("the file is empty") != std::string::npos);
  CHECK(error(folder.write("text.gltf", "hello")).find("not valid JSON") != std::string::npos);
  CHECK(error("/dev/zero").find("is not a regular file") != std::string::npos);
  CHECK(error(folder.write("esc\x1b[2J.gltf", "")).find('\x1b') == std::string::npos);
}

TEST_CASE("GLB files: whole ones load, each truncation is refused") {
  const std::string positions(36, '\0');
  std::string json =
      R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":36}],"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})";
  while (json.size() % 4 != 0) json += ' ';
  const auto word = [](std::size_t value) {
    return std::string{static_cast<char>(value), static_cast<char>(value >> 8), static_cast<char>(value >> 16),
                       static_cast<char>(value >> 24)};
  };
  const std::string body = word(json.size()) + "JSON" + json + word(36) + std::string("BIN\0", 4) + positions;
  const std::string glb = "glTF" + word(2) + word(12 + body.size()) + body;
  const TemporaryFolder folder;
  CHECK_NOTHROW(load_gltf(folder.write("a.glb", glb)));
  for (std::size_t size = 0; size < glb.size(); ++size)
    CHECK_THROWS_AS(load_gltf(folder.write("a.glb", glb.substr(0, size))), Error);
  CHECK(load_gltf(folder.write("a.glb", glb + "more")).notes.size() == 1);
}

TEST_CASE("what would need too much memory is refused before it is allocated") {
  // Three vertices that take no bytes at all in the file, 2^40 times.
  const std::string text =
      R"({"asset":{"version":"2.0"},"accessors":[{"componentType":5126,"count":1099511627776,"type":"VEC3"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]})";
  CHECK(load_error(text).find("more than the limit of") != std::string::npos);
  const std::string small = box().text(kOneMesh + "\"nodes\":[{\"mesh\":0}]");
  CHECK(load_error(small) == "");
  CHECK(load_error(small, {1000}).find("more than the limit of 1000 bytes") != std::string::npos);
  CHECK(load_error(small, {small.size() + 400}).find("the scene, with 12 triangles, needs") != std::string::npos);
}
