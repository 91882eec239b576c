// Taps of photons: point clouds and tables.

#include <algorithm>

#include "ln/sorted_photons.hpp"
#include "point_table.hpp"

namespace ln {

namespace {

const std::vector<PointTable::Column> kPhotonColumns = {{"x"},    {"y"},    {"z"},    {"nx"},     {"ny"},     {"nz"},
                                                        {"wi_x"}, {"wi_y"}, {"wi_z"}, {"flux_r"}, {"flux_g"}, {"flux_b"}};
constexpr const char* kPhotonUnits = "flux in W; wi: direction to where the light came from";

Color flux(const Photon& photon, const SceneData& scene) {
  return static_cast<float>(scene.unit * scene.unit) * photon.flux.unpack();
}

/// The values of kPhotonColumns.
void add_photon(const Photon& photon, const SceneData& scene, std::vector<double>& values) {
  const DVec3 position = scene.origin + scene.unit * DVec3(photon.position);
  for (const DVec3& v : {position, DVec3(photon.normal.normal()), DVec3(unpack_unit(photon.wi)), DVec3(flux(photon, scene))})
    values.insert(values.end(), {v.x, v.y, v.z});
}

}  // namespace

void write_tap(const TapFile& tap, const Photons& photons) {
  const auto fill = [&](std::size_t i, std::vector<double>& values) { add_photon(photons.hits[i], tap.scene, values); };
  const auto colour = [&](std::size_t i) { return flux(photons.hits[i], tap.scene); };
  write_points(tap, {"photons", kPhotonUnits, "flux", kPhotonColumns, photons.hits.size(), fill, colour});
}

void write_tap(const TapFile& tap, const SortedPhotons& photons) {
  std::vector<PointTable::Column> columns = kPhotonColumns;
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

}  // namespace ln
