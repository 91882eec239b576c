#include <numeric>

#include "ln/disjoint_sets.hpp"
#include "ln/sorted_photons.hpp"

namespace ln {

SortedPhotons sort_by_surface(const SceneData& data, std::span<const Photon> photons) {
  SortedPhotons sorted;
  sorted.patches = std::make_shared<const Patches>(data);
  const Patches& patches = *sorted.patches;

  // Sheets: patches that hang together.
  DisjointSets sets(patches.size());
  for (std::uint32_t p = 0; p < patches.size(); ++p) {
    for (int k = 0; k < patches.domain(p).corner_count(); ++k) {
      const std::uint32_t neighbour = patches.neighbour(p, k);
      if (neighbour != Patches::kNone) sets.join(p, neighbour / 4);
    }
  }
  std::uint32_t sheets = 0;
  sorted.sheet_of_patch = sets.labels(sheets);
  sorted.sheet_area.resize(sheets);
  for (std::uint32_t p = 0; p < patches.size(); ++p)
    sorted.sheet_area[sorted.sheet_of_patch[p]] += static_cast<double>(area(patches.surface(p)));
  sorted.sheet_of_triangle.resize(data.triangles.size());
  for (std::uint32_t t = 0; t < data.triangles.size(); ++t)
    sorted.sheet_of_triangle[t] = sorted.sheet_of_patch[patches.locate(t, 0, 0).patch];

  // Count, then put each photon in its place.
  const auto surface_of = [&](const Photon& photon) {
    return 2 * sorted.sheet_of_triangle[photon.triangle] + (photon.normal.front() ? 0 : 1);
  };
  sorted.first.assign(2 * std::size_t{sheets} + 1, 0);
  for (const Photon& photon : photons) ++sorted.first[surface_of(photon) + 1];
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  sorted.hits.resize(photons.size());
  std::vector<std::size_t> next(sorted.first.begin(), sorted.first.end() - 1);
  for (const Photon& photon : photons) sorted.hits[next[surface_of(photon)]++] = photon;
  return sorted;
}

}  // namespace ln
