#pragma once
// Files of sensors: points with normals, one a row.

#include <string>
#include <vector>

#include "ln/math.hpp"

namespace ln {

/// A point where irradiance is wanted.
struct Sensor {
  DVec3 position{0};     // world coordinates, in the scene's units
  Vec3 normal{0, 0, 1};  // unit length
  std::size_t line = 0;  // in the file, from 1
  std::string row;       // as it stands there, without columns of results
};

struct SensorFile {
  std::string path;
  std::string header;  // names of the columns of `row`
  std::vector<Sensor> sensors;
};

/// Names of the columns that a probe adds.
inline constexpr const char* kResultColumns[] = {"E_r", "E_g", "E_b", "lux", "stderr"};

/// Reads comma-separated values x, y, z, nx, ny, nz. Where the first row holds names, the columns may stand in any order and
/// there may be others, which are kept; columns of earlier results are left out. Empty lines and lines that begin with # are
/// skipped, normals are brought to unit length. Throws Error "<path>:<line>: ..." for anything else.
SensorFile read_sensors(const std::string& path);

}  // namespace ln
