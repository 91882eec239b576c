// Taps of photons: point clouds and tables.

#include <charconv>
#include <string>

#include "ln/output_file.hpp"
#include "ln/photon_tracer.hpp"
#include "ln/tap.hpp"
#include "ln/text.hpp"
#include "srgb.hpp"

namespace ln {

namespace {

/// A photon in world coordinates.
struct WorldPhoton {
  DVec3 position;
  Vec3 normal, wi;  // wi: towards where the light came from
  Color flux;       // [W]
};

WorldPhoton in_world(const Photon& photon, const SceneData& scene) {
  const auto area = static_cast<float>(scene.unit * scene.unit);
  return {scene.origin + scene.unit * DVec3(photon.position), photon.normal.normal(), unpack_unit(photon.wi), area * photon.flux.unpack()};
}

/// Factor that makes the mean of the largest channels of all photons half of white.
float exposure(const Photons& photons, const SceneData& scene) {
  double sum = 0;
  for (const Photon& photon : photons.hits) sum += static_cast<double>(max_component(in_world(photon, scene).flux));
  return sum > 0 ? static_cast<float>(std::clamp(0.5 * static_cast<double>(photons.hits.size()) / sum, 1e-30, 1e30)) : 1.0f;
}

void write_ply(const TapFile& tap, const Photons& photons) {
  const float scale = exposure(photons, tap.scene);
  OutputFile file(tap.info.file);
  file.write("ply\nformat binary_little_endian 1.0\ncomment photons of '" + printable(tap.info.wire) + "' in the network '" + printable(tap.network) +
             "', light paths " + printable(tap.info.light_paths, 1000) + "\ncomment flux in W; colours are sRGB of flux * " +
             number_text(static_cast<double>(scale)) + "; wi: direction to where the light came from\nelement vertex " +
             std::to_string(photons.hits.size()) + "\n");
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "wi_x", "wi_y", "wi_z", "flux_r", "flux_g", "flux_b"})
    file.write("property float " + std::string(name) + "\n");
  file.write("property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
  for (const Photon& photon : photons.hits) {
    const WorldPhoton p = in_world(photon, tap.scene);
    const Vec3 vectors[] = {Vec3(p.position), p.normal, p.wi, p.flux};
    const unsigned char colour[] = {srgb_byte(p.flux.x * scale), srgb_byte(p.flux.y * scale), srgb_byte(p.flux.z * scale)};
    file.write(vectors, sizeof vectors);
    file.write(colour, sizeof colour);
  }
  file.commit();
}

void write_csv(const TapFile& tap, const Photons& photons) {
  OutputFile file(tap.info.file);
  file.write("x,y,z,nx,ny,nz,wi_x,wi_y,wi_z,flux_r,flux_g,flux_b\n");
  constexpr int kDigits = 9;  // tell any two floats apart
  for (const Photon& photon : photons.hits) {
    const WorldPhoton p = in_world(photon, tap.scene);
    char line[400];
    char* end = line;
    for (const DVec3& v : {p.position, DVec3(p.normal), DVec3(p.wi), DVec3(p.flux)}) {
      for (const double value : {v.x, v.y, v.z}) {
        end = std::to_chars(end, line + sizeof line, value, std::chars_format::general, kDigits).ptr;
        *end++ = ',';
      }
    }
    end[-1] = '\n';
    file.write(line, static_cast<std::size_t>(end - line));
  }
  file.commit();
}

}  // namespace

void write_tap(const TapFile& tap, const Photons& photons) { tap.is(".csv") ? write_csv(tap, photons) : write_ply(tap, photons); }

}  // namespace ln
