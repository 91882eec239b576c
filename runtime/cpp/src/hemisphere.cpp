#include "ln/hemisphere.hpp"

#include <glm/matrix.hpp>
#include <vector>

namespace ln {

namespace {

constexpr float kLeastDistance = 1e-6f;  // [normalised units]

/// Unit vector at the azimuth `phi` in the plane of the surface.
Vec3 towards(const Frame& frame, float phi) { return frame.s * std::cos(phi) + frame.t * std::sin(phi); }

}  // namespace

HemisphereGrid HemisphereGrid::of(float count) {
  HemisphereGrid grid;
  grid.polar = std::max(1, static_cast<int>(std::lround(std::sqrt(count / kPi))));
  grid.azimuth = std::max(3, static_cast<int>(std::lround(count / static_cast<float>(grid.polar))));
  return grid;
}

Vec3 HemisphereGrid::direction(int ring, int sector, const Vec2& u) const {
  const float sin2 = (static_cast<float>(ring) + u.x) / static_cast<float>(polar);
  const float phi = 2 * kPi * (static_cast<float>(sector) + u.y) / static_cast<float>(azimuth);
  const float sin = std::sqrt(sin2);
  return {sin * std::cos(phi), sin * std::sin(phi), safe_sqrt(1 - sin2)};
}

IrradianceSample integrate(const HemisphereGrid& grid, std::span<const HemisphereCell> cells, const Frame& frame, float step) {
  const auto rings = static_cast<std::size_t>(grid.polar), sectors = static_cast<std::size_t>(grid.azimuth);
  const auto cell = [&](std::size_t ring, std::size_t sector) -> const HemisphereCell& {
    return cells[ring * sectors + sector];
  };
  // Inverse distance of the border between two cells where it crosses the middle of their common side, at `u` of cell
  // (ring, sector). It belongs to the nearer surface, and moves as that one does (Ward and Heckbert 1992, eq. 2); but a wall
  // close by is much farther away at its end than where it was seen.
  const float nearest_inverse = 1 / std::max(step, kLeastDistance);
  const auto inverse_at = [&](std::size_t ring, std::size_t sector, const Vec2& u, const HemisphereCell& beside) {
    const HemisphereCell& here = cell(ring, sector);
    const HemisphereCell& close = here.distance < beside.distance ? here : beside;
    float inverse = 1 / close.distance;
    if (close.plane != Vec3(0)) {
      const Vec3 w = frame.to_world(grid.direction(static_cast<int>(ring), static_cast<int>(sector), u));
      inverse = std::max(std::min(inverse, glm::dot(w, close.plane)), 1 / std::max(here.distance, beside.distance));
    }
    return std::min(inverse, nearest_inverse);
  };
  const float width = 2 * kPi / static_cast<float>(sectors);

  // What a ring's borders and its inside contribute, at its polar angles theta: sin^2(theta) = ring / rings.
  struct Ring {
    float sin, cos2;  // at the border towards the normal
    float tilt;       // integral of sin^2(theta)
  };
  std::vector<Ring> ring_of(rings + 1);
  const auto area = [](float sin, float cos) { return 0.5f * (std::asin(sin) - sin * cos); };
  for (std::size_t j = 0; j <= rings; ++j) {
    const float sin2 = static_cast<float>(j) / static_cast<float>(rings);
    ring_of[j] = {std::sqrt(sin2), 1 - sin2, area(std::sqrt(sin2), safe_sqrt(1 - sin2))};
  }
  for (std::size_t j = 0; j < rings; ++j) ring_of[j].tilt = ring_of[j + 1].tilt - ring_of[j].tilt;

  IrradianceSample result;
  Color sum(0);
  float inverse_distance = 0;
  for (std::size_t k = 0; k < sectors; ++k) {
    const std::size_t before = (k + sectors - 1) % sectors;
    const float phi = width * static_cast<float>(k);
    Color tilt(0), outwards(0), sideways(0);
    for (std::size_t j = 0; j < rings; ++j) {
      const HemisphereCell& here = cell(j, k);
      sum += here.radiance;
      inverse_distance += 1 / std::max(here.distance, kLeastDistance);
      result.nearest = std::min(result.nearest, here.distance);
      tilt += here.radiance * ring_of[j].tilt;
      if (j > 0) {
        const HemisphereCell& inner = cell(j - 1, k);
        const float inverse = inverse_at(j, k, Vec2(0.0f, 0.5f), inner);
        outwards += (here.radiance - inner.radiance) * (ring_of[j].sin * ring_of[j].cos2 * inverse);
      }
      const HemisphereCell& neighbour = cell(j, before);
      const float inverse = inverse_at(j, k, Vec2(0.5f, 0.0f), neighbour);
      sideways += (here.radiance - neighbour.radiance) * ((ring_of[j + 1].sin - ring_of[j].sin) * inverse);
    }
    const Vec3 middle = towards(frame, phi + 0.5f * width), across = towards(frame, phi + 0.5f * width + 0.5f * kPi);
    const Vec3 border = towards(frame, phi + 0.5f * kPi);
    // Integrated over the cell's azimuths, its vector shrinks to the chord.
    const float chord = 2 * std::sin(0.5f * width);
    result.rotation += glm::outerProduct(across, tilt) * chord;
    result.translation += glm::outerProduct(middle, outwards) * width + glm::outerProduct(border, sideways);
  }
  const auto count = static_cast<float>(cells.size());
  result.irradiance = sum * (kPi / count);
  result.distance = inverse_distance > 0 ? count / inverse_distance : kInfinity;
  const float sin = std::sqrt(1 - 0.5f / static_cast<float>(rings));  // in the middle of the lowest ring
  for (const HemisphereCell& low : cells.last(sectors))
    result.horizon.push_back(1 / (sin * std::max(low.distance, kLeastDistance)));
  return result;
}

}  // namespace ln
