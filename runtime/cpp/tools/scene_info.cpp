// Loads a glTF file and prints what is in it as JSON, and the most memory that loading took. Exit status 1, with one line on
// stderr, if it cannot be loaded.

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "ln/gltf.hpp"
#include "ln/text.hpp"

namespace {

using ln::number_text;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : ln::printable(text, 1000)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

template <class V>
std::string vector_json(const V& v, int n = 3) {
  std::string out = "[";
  for (int i = 0; i < n; ++i) out += (i == 0 ? "" : ", ") + number_text(static_cast<double>(v[static_cast<std::size_t>(i)]));
  return out + "]";
}

/// A JSON array of what `item` makes of each element.
template <class List, class Item>
std::string list_json(const List& list, Item item) {
  std::string out = "[";
  for (std::size_t i = 0; i < list.size(); ++i) out += (i == 0 ? "\n  " : ",\n  ") + item(list[i]);
  return out + (list.empty() ? "]" : "\n ]");
}

std::string tags_json(const std::vector<std::string>& tags) {
  std::string out = "[";
  for (const std::string& tag : tags) out += (out == "[" ? "" : ", ") + quoted(tag);
  return out + "]";
}

std::string material_json(const ln::Material& m) {
  return "{\"name\": " + quoted(m.name) + ", \"tags\": " + tags_json(m.tags) +
         ", \"base_color\": " + vector_json(m.base_color) + ", \"alpha\": " + number_text(m.alpha) +
         ", \"metallic\": " + number_text(m.metallic) + ", \"roughness\": " + number_text(m.roughness) +
         ", \"emission\": " + vector_json(m.emission) + ", \"transmission\": " + number_text(m.transmission) +
         ", \"ior\": " + number_text(m.ior) + ", \"solid\": " + (m.solid ? "true" : "false") +
         ", \"unlit\": " + (m.unlit ? "true" : "false") + ", \"double_sided\": " + (m.double_sided ? "true" : "false") +
         ", \"alpha_mode\": " + std::to_string(static_cast<int>(m.alpha_mode)) +
         ", \"textured\": " + (m.has_texture() ? "true" : "false") + "}";
}

std::string camera_json(const ln::Camera& c) {
  return "{\"name\": " + quoted(c.name) + ", \"node\": " + quoted(c.node) +
         ", \"orthographic\": " + (c.orthographic ? "true" : "false") + ", \"position\": " + vector_json(c.position) +
         ", \"forward\": " + vector_json(c.forward) + ", \"up\": " + vector_json(c.up) + ", \"yfov\": " + number_text(c.yfov) +
         ", \"ymag\": " + number_text(c.ymag) + "}";
}

std::string light_json(const ln::PunctualLight& l) {
  constexpr const char* kKinds[] = {"point", "spot", "directional"};
  return "{\"name\": " + quoted(l.name) + ", \"node\": " + quoted(l.node) + ", \"tags\": " + tags_json(l.tags) +
         ", \"kind\": \"" + kKinds[static_cast<int>(l.kind)] + "\", \"position\": " + vector_json(l.position) +
         ", \"direction\": " + vector_json(l.direction) + ", \"intensity\": " + vector_json(l.intensity) + "}";
}

std::string image_json(const ln::Image& i) {
  return "{\"width\": " + std::to_string(i.width) + ", \"height\": " + std::to_string(i.height) +
         ", \"channels\": " + std::to_string(i.channels) + ", \"float\": " + (i.floats.empty() ? "false" : "true") +
         ", \"srgb\": " + (i.srgb ? "true" : "false") + "}";
}

std::string part_json(const ln::Part& p) {
  return "{\"mesh\": " + quoted(p.mesh) + ", \"node\": " + quoted(p.node) + ", \"tags\": " + tags_json(p.tags) +
         ", \"material\": " + std::to_string(p.material) + ", \"triangles\": " + std::to_string(p.triangle_count) + "}";
}

/// Sums over all triangles that different encodings of one mesh must agree on: area and, by the divergence theorem, volume.
std::string measures_json(const ln::SceneData& s) {
  double area = 0, volume = 0;
  for (const ln::UVec3& t : s.triangles) {
    const ln::DVec3 a(s.positions[t.x]), b(s.positions[t.y]), c(s.positions[t.z]);
    area += 0.5 * glm::length(glm::cross(b - a, c - a));
    volume += glm::dot(a, glm::cross(b, c)) / 6;
  }
  return "\"area\": " + number_text(area * s.unit * s.unit) + ", \"volume\": " + number_text(volume * s.unit * s.unit * s.unit);
}

/// The most memory that this process had at a time.
std::string peak_json() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return "\"peak_bytes\": " + number_text(1024 * std::strtod(line.c_str() + 6, nullptr));
  }
  return "\"peak_bytes\": null";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s SCENE\n", argv[0]);
    return 2;
  }
  try {
    const ln::SceneData s = ln::load_gltf(argv[1]);
    std::string out = "{" + peak_json() + ", \"triangles\": " + std::to_string(s.triangles.size()) +
                      ", \"vertices\": " + std::to_string(s.positions.size()) + ", \"origin\": " + vector_json(s.origin) +
                      ", \"unit\": " + number_text(s.unit) + ",\n " + measures_json(s) + ",\n";
    out += " \"parts\": " + list_json(s.parts, part_json) + ",\n \"materials\": " + list_json(s.materials, material_json) +
           ",\n \"images\": " + list_json(s.images, image_json);
    out += ",\n \"cameras\": " + list_json(s.cameras, camera_json) + ",\n \"lights\": " + list_json(s.lights, light_json) +
           ",\n \"notes\": " + list_json(s.notes, quoted) + "}\n";
    std::fputs(out.c_str(), stdout);
  } catch (const ln::Error& error) {
    std::printf("{%s}\n", peak_json().c_str());
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
