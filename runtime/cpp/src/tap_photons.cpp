// Taps of light that leaves emitters and of photons: point clouds and tables.

#include <algorithm>

#include "ln/photon_map.hpp"
#include "ln/sorted_photons.hpp"
#include "point_table.hpp"

namespace ln {

namespace {

constexpr const char* kPhotonUnits = "flux in W; wi: direction to where the light came from";

std::vector<PointTable::Column> photon_columns() {
  return {{"x"}, {"y"}, {"z"}, {"nx"}, {"ny"}, {"nz"}, {"wi_x"}, {"wi_y"}, {"wi_z"}, {"flux_r"}, {"flux_g"}, {"flux_b"}};
}

DVec3 world(const Vec3& position, const SceneData& scene) { return scene.origin + scene.unit * DVec3(position); }
Color watts(const Color& flux, const SceneData& scene) { return static_cast<float>(scene.unit * scene.unit) * flux; }
Color flux(const Photon& photon, const SceneData& scene) { return watts(photon.flux.unpack(), scene); }

void add(const DVec3& v, std::vector<double>& values) { values.insert(values.end(), {v.x, v.y, v.z}); }

/// The values of photon_columns.
void add_photon(const Photon& photon, const SceneData& scene, std::vector<double>& values) {
  add(world(photon.position, scene), values);
  add(DVec3(photon.normal.normal()), values);
  add(DVec3(unpack_unit(photon.wi)), values);
  add(DVec3(flux(photon, scene)), values);
}

}  // namespace

void write_tap(const TapFile& tap, const Photons& photons) {
  const auto fill = [&](std::size_t i, std::vector<double>& values) { add_photon(photons.hits[i], tap.scene, values); };
  const auto colour = [&](std::size_t i) { return flux(photons.hits[i], tap.scene); };
  write_points(tap, {"photons", kPhotonUnits, "flux", photon_columns(), photons.hits.size(), fill, colour});
}

void write_tap(const TapFile& tap, const SortedPhotons& photons) {
  std::vector<PointTable::Column> columns = photon_columns();
  columns.push_back({"surface", true});
  const auto fill = [&](std::size_t i, std::vector<double>& values) {
    add_photon(photons.hits[i], tap.scene, values);
    values.push_back(
        static_cast<double>(std::upper_bound(photons.first.begin(), photons.first.end(), i) - photons.first.begin() - 1));
  };
  const auto colour = [&](std::size_t i) { return flux(photons.hits[i], tap.scene); };
  const std::string units = std::string(kPhotonUnits) + "; surface 2 s: the front of sheet s, 2 s + 1: its back";
  write_points(tap, {"photons by surface", units, "flux", columns, photons.hits.size(), fill, colour});
}

void write_tap(const TapFile& tap, const PhotonMap& map) {
  const auto flux = [&](std::size_t i) { return watts(map.flux(static_cast<std::uint32_t>(i)), tap.scene); };
  const auto fill = [&](std::size_t i, std::vector<double>& values) {
    const auto slot = static_cast<std::uint32_t>(i);
    add(world(map.position(slot), tap.scene), values);
    add(DVec3(map.normal(slot).normal()), values);
    add(DVec3(flux(i)), values);
  };
  const std::vector<PointTable::Column> columns = {{"x"},  {"y"},      {"z"},      {"nx"},    {"ny"},
                                                   {"nz"}, {"flux_r"}, {"flux_g"}, {"flux_b"}};
  write_points(tap, {"photons of a map", "flux in W", "flux", columns, map.size(), fill, flux});
}

void write_tap(const TapFile& tap, const Emitters& emitters) {
  constexpr std::uint32_t kParticles = 16384;
  std::vector<PhotonEmission> particles;
  for (std::uint32_t i = 0; i < kParticles && !emitters.empty(); ++i)
    particles.push_back(emitters.emit(sobol_point(0, 0, i).x, sobol_point(0, 1, i), sobol_point(0, 2, i)));
  const auto flux = [&](std::size_t i) { return watts(particles[i].flux, tap.scene) / static_cast<float>(kParticles); };
  const auto fill = [&](std::size_t i, std::vector<double>& values) {
    const PhotonEmission& particle = particles[i];
    add(world(particle.position.p, tap.scene), values);
    add(DVec3(particle.direction), values);
    add(DVec3(flux(i)), values);
    values.push_back(particle.delta ? 1 : 0);
  };
  const std::vector<PointTable::Column> columns = {{"x"},   {"y"},      {"z"},      {"w_x"},    {"w_y"},
                                                   {"w_z"}, {"flux_r"}, {"flux_g"}, {"flux_b"}, {"delta", true}};
  write_points(tap, {"light that leaves emitters",
                     "flux in W; w: direction in which it leaves; delta 1: of a point, spot or directional light", "flux",
                     columns, particles.size(), fill, flux});
}

}  // namespace ln
