#pragma once
// Interface only for now: see the definitions below for what must be provided.

#include "ln/math.hpp"

namespace ln {

/// Scattering events of a light path, as a set: D diffuse, G glossy, S ideal specular.
enum class Events : std::uint8_t { none = 0, D = 1, G = 2, DG = 3, S = 4, all = 7 };
constexpr Events operator&(Events a, Events b) { return static_cast<Events>(static_cast<unsigned>(a) & static_cast<unsigned>(b)); }
constexpr Events operator|(Events a, Events b) { return static_cast<Events>(static_cast<unsigned>(a) | static_cast<unsigned>(b)); }
constexpr bool any(Events e) { return e != Events::none; }

/// What is carried along the ray: `radiance` (traced from the eye) is scaled by 1/eta^2 where it is refracted, `flux` (traced from a light) is not.
enum class Carried : std::uint8_t { radiance, flux };

}  // namespace ln
