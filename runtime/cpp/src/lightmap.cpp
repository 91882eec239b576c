#include "ln/lightmap.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "glb_writer.hpp"
#include "ln/error.hpp"
#include "ln/exr_film.hpp"
#include "ln/options.hpp"
#include "ln/progress.hpp"
#include "png.hpp"
#include "srgb.hpp"

namespace ln {

namespace {

/// How far backs are moved off their fronts [normalised units].
constexpr float kLift = 2e-5f;

}  // namespace

std::string atlas_file(const std::string& file) { return file.substr(0, file.rfind('.')) + ".exr"; }

void Lightmap::lay_out(const SceneData& data, int side) {
  patches_ = Patches(data);
  double total = 0;  // area
  for (std::uint32_t patch = 0; patch < patches_.size(); ++patch) {
    const int sides = data.materials[data.parts[patches_.part(patch)].material].double_sided ? 2 : 1;
    for (int i = 0; i < sides; ++i) charts_.push_back({Patches::face(patch, i == 0)});
    total += sides * static_cast<double>(area(patches_.surface(patch)));
  }
  for (side_ = side; side_ <= kLargestLightmap; side_ *= 2) {
    // Texels grow until the charts fit; the smallest chart has four.
    double texel = std::sqrt(total) / side_;
    bool smallest = false;
    while (!smallest) {
      smallest = true;
      for (Chart& chart : charts_) {
        const SurfaceCell cell = patches_.surface(chart.face / 2);
        const auto size = [&](const Vec3& edge) {
          return 1 + std::clamp(static_cast<int>(std::ceil(static_cast<double>(glm::length(edge)) / texel)), 1, side_ - 1);
        };
        chart.width = size(cell.a);
        chart.height = size(cell.b);
        smallest = smallest && chart.width == 2 && chart.height == 2;
      }
      if (pack()) {
        if (side_ > side)
          note(std::string(info_.file) + ": " + std::to_string(charts_.size()) + " patches need an atlas of " +
               std::to_string(side_) + " texels a side");
        return;
      }
      texel *= 1.05;
    }
  }
  throw Error(std::string(info_.file) + ": the scene has " + std::to_string(charts_.size()) +
              " patches, more than an atlas of " + std::to_string(kLargestLightmap) +
              " texels a side has room for; tap a QuadTree instead");
}

/// Puts charts side by side on shelves, the highest first. False if they do not fit.
bool Lightmap::pack() {
  std::vector<std::uint32_t> order(charts_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return charts_[a].height > charts_[b].height; });
  int x = 0, y = 0, shelf = 0;
  for (const std::uint32_t i : order) {
    Chart& chart = charts_[i];
    if (x + chart.width > side_) {
      y += shelf;
      x = shelf = 0;
    }
    shelf = std::max(shelf, chart.height);
    if (y + shelf > side_) return false;
    chart.x = x;
    chart.y = y;
    x += chart.width;
  }
  texels_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_), kNone);
  for (std::uint32_t i = 0; i < charts_.size(); ++i) {
    const Chart& chart = charts_[i];
    const bool quad = patches_.quad(chart.face / 2);
    for (int t = 0; t < chart.height; ++t) {
      for (int s = 0; s < chart.width; ++s) {
        // Of a triangle, what bilinear look-ups inside of it touch.
        const float beyond = static_cast<float>(s - 1) / static_cast<float>(chart.width - 1) +
                             static_cast<float>(t - 1) / static_cast<float>(chart.height - 1);
        if (quad || beyond < 1)
          texels_[static_cast<std::size_t>(chart.y + t) * static_cast<std::size_t>(side_) +
                  static_cast<std::size_t>(chart.x + s)] = i;
      }
    }
  }
  return true;
}

void Lightmap::write(const Film& film, const char* network, const SceneData& data) const {
  // Choose the exposure: by the mean over all texels, which are of about one size.
  double sum = 0;
  std::size_t used = 0;
  std::vector<float> irradiance;
  irradiance.reserve(3 * texels_.size());
  for (int y = 0; y < side_; ++y) {
    for (int x = 0; x < side_; ++x) {
      const Color value = film.mean(x, y);
      irradiance.insert(irradiance.end(), {value.x, value.y, value.z});
      if (chart_at(x, y) == kNone) continue;
      sum += static_cast<double>(luminance(value));
      ++used;
    }
  }
  const float exposure = gltf::exposure_of(used > 0 ? sum / static_cast<double>(used) : 0);
  std::vector<unsigned char> bytes(irradiance.size());
  std::transform(irradiance.begin(), irradiance.end(), bytes.begin(), [&](float value) { return srgb_byte(value * exposure); });

  const std::string atlas = atlas_file(info_.file);
  gltf::GlbWriter writer(
      {{"network", network},
       {"wire", info_.wire},
       {"lightPaths", info_.light_paths},
       {"exposure", exposure},
       {"colours", "irradiance * exposure, cut off at 1; " + atlas.substr(atlas.rfind('/') + 1) + " holds it uncut"},
       {"unit", "W/m^2"}});
  const int material = writer.add_unlit_material("irradiance");
  constexpr int kLinear = 9729, kClamp = 33071;
  writer.json["images"] = {{{"bufferView", writer.add_bytes(png_bytes(side_, side_, bytes))}, {"mimeType", "image/png"}}};
  writer.json["samplers"] = {{{"magFilter", kLinear}, {"minFilter", kLinear}, {"wrapS", kClamp}, {"wrapT", kClamp}}};
  writer.json["textures"] = {{{"sampler", 0}, {"source", 0}}};
  writer.json["materials"][static_cast<std::size_t>(material)]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};

  for (const bool front : {true, false}) {
    std::vector<Vec3> positions;
    std::vector<Vec2> uvs;
    std::vector<std::uint32_t> indices;
    for (const Chart& chart : charts_) {
      if (Patches::is_front(chart.face) != front) continue;
      const std::uint32_t patch = chart.face / 2;
      const SurfaceCell cell = patches_.surface(patch);
      const DomainCell domain = patches_.domain(patch);
      const Vec3 off = front ? Vec3(0) : -kLift * glm::normalize(glm::cross(cell.a, cell.b));
      const auto first = static_cast<std::uint32_t>(positions.size());
      for (int k = 0; k < cell.corner_count(); ++k) {
        const Vec2 st = domain.corner(k);
        positions.push_back(cell.corner(k) + off);
        uvs.push_back((Vec2(chart.x, chart.y) + 0.5f + st * Vec2(chart.width - 1, chart.height - 1)) /
                      static_cast<float>(side_));
      }
      for (auto k = static_cast<std::uint32_t>(cell.corner_count() - 1); k >= 2; --k)
        indices.insert(indices.end(), {first, first + (front ? k - 1 : k), first + (front ? k : k - 1)});
    }
    if (indices.empty()) continue;
    writer.add_mesh(front ? "front" : "back",
                    {{"attributes",
                      {{"POSITION", writer.add_positions(positions)}, {"TEXCOORD_0", writer.add(std::span<const Vec2>(uvs))}}},
                     {"indices", writer.add_indices(indices)},
                     {"material", material}},
                    data);
  }
  writer.write(info_.file);
  write_exr(atlas, side_, side_, irradiance.data(),
            {{"network", std::string(network)}, {"lightPaths", std::string(info_.light_paths)}});
}

}  // namespace ln
