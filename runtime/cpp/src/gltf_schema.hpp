#pragma once
// The members of a glTF file that the loader reads: their kinds, ranges and references, as one table.

#include "gltf_json.hpp"

namespace ln::gltf {

/// Checks every member that the loader reads, used or not: kind, presence, range, length, and that references point at
/// something. Members that are not in the table are left alone. Throws Error naming the file and the member.
///
/// Ranges are those of the specification; fractions may miss theirs by 1e-5, as some exporters round (readers clamp).
void check_schema(Json root);

}  // namespace ln::gltf
