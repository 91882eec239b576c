#pragma once
// Photons sorted by the surface that they hit.

#include <memory>
#include <span>
#include <vector>

#include "ln/patches.hpp"
#include "ln/photon_tracer.hpp"

namespace ln {

/// A surface is a side of patches that go on into each other without a crease: what light is smooth on.
struct SortedPhotons {
  std::shared_ptr<const Patches> patches;
  std::vector<std::uint32_t> sheet_of_triangle;  // a sheet has two surfaces, its front 2 s and its back 2 s + 1
  std::vector<std::uint32_t> sheet_of_patch;
  std::vector<double> sheet_area;     // [normalised units^2]
  std::vector<Photon> hits;           // surface by surface, on each in the order in which they were traced
  std::vector<std::size_t> first{0};  // by surface: of its photons in `hits`; one more at the end

  std::size_t surface_count() const { return first.size() - 1; }
  std::span<const Photon> on(std::size_t surface) const {
    return {hits.data() + first[surface], first[surface + 1] - first[surface]};
  }
  std::uint32_t surface_of_face(std::uint32_t face) const { return 2 * sheet_of_patch[face / 2] + face % 2; }
};

SortedPhotons sort_by_surface(const SceneData& data, std::span<const Photon> photons);

void write_tap(const TapFile& tap, const SortedPhotons& photons);

}  // namespace ln
