// Taps of irradiance records: point clouds and tables.

#include "ln/irradiance_records.hpp"
#include "point_table.hpp"

namespace ln {

namespace {

/// x, y, z, nx, ny, nz, E_r, E_g, E_b, radius, rotation_r_x ... translation_b_z, beyond.
std::vector<PointTable::Column> record_columns() {
  std::vector<PointTable::Column> columns = {{"x"},  {"y"},   {"z"},   {"nx"},  {"ny"},
                                             {"nz"}, {"E_r"}, {"E_g"}, {"E_b"}, {"radius"}};
  for (const char* gradient : {"rotation_", "translation_"})
    for (const char* channel : {"r_", "g_", "b_"})
      for (const char* axis : {"x", "y", "z"}) columns.push_back({std::string(gradient) + channel + axis});
  columns.push_back({"beyond", true});
  return columns;
}

}  // namespace

void write_tap(const TapFile& tap, const IrradianceRecordSets& sets) {
  const std::size_t seen = sets.seen.size();
  const auto record = [&](std::size_t i) -> const IrradianceRecord& {
    return i < seen ? sets.seen.records()[i] : sets.beyond.records()[i - seen];
  };
  const double unit = tap.scene.unit;
  const auto fill = [&](std::size_t i, std::vector<double>& values) {
    const IrradianceRecord& r = record(i);
    for (const DVec3& v : {tap.scene.origin + unit * DVec3(r.p), DVec3(r.n), DVec3(r.sample.irradiance)})
      values.insert(values.end(), {v.x, v.y, v.z});
    values.push_back(unit * static_cast<double>(r.reach));
    for (int c = 0; c < 3; ++c)
      values.insert(values.end(), {r.sample.rotation[c].x, r.sample.rotation[c].y, r.sample.rotation[c].z});
    for (int c = 0; c < 3; ++c) {
      const DVec3 slope = DVec3(r.sample.translation[c]) / unit;
      values.insert(values.end(), {slope.x, slope.y, slope.z});
    }
    values.push_back(i < seen ? 0 : 1);
  };
  const auto colour = [&](std::size_t i) { return record(i).sample.irradiance; };
  write_points(tap, {"irradiance records",
                     "irradiance E in W/m^2, its gradients by rotation (W/m^2 a radian) and by translation (W/m^3); radius: "
                     "the record is used within, "
                     "in m; beyond 1: for surfaces that others see, not the eye",
                     "E", record_columns(), seen + sets.beyond.size(), fill, colour});
}

}  // namespace ln
