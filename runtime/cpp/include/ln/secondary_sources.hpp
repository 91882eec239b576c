#pragma once
// Surfaces that send out particles, as they scatter diffusely what reaches them.

#include <vector>

#include "ln/distribution.hpp"
#include "ln/patches.hpp"
#include "ln/photon_tracer.hpp"

namespace ln {

class SecondarySources {
 public:
  /// Cuts the surfaces into cells and asks `source`, some `pilots` times, how bright each is.
  SecondarySources(PrepareContext& context, NodeId node, const RadianceSource& source, std::uint32_t key, std::uint64_t pilots);

  bool empty() const { return power_.empty(); }

  /// A particle from a point of a cell, which is chosen by its power: direction by the cosine, flux as `source` says. Nothing
  /// else may use the numbers of `random`.
  PhotonEmission emit(Tracer& tracer, const SampleStream& random) const;

 private:
  struct Cell {
    std::uint32_t face;
    DomainCell domain;
    float area;
  };

  void add_cells(const Scene& scene, std::uint64_t wanted);
  /// Does another surface coincide with the cell where `emit_from` starts?
  bool hidden(const Cell& cell, Tracer& tracer, const SampleStream& random) const;
  /// A particle from one cell; its flux is that of the whole cell.
  PhotonEmission emit_from(const Cell& cell, Tracer& tracer, const SampleStream& random) const;

  NodeId node_;
  const RadianceSource* source_;
  Patches patches_;
  std::vector<Cell> cells_;
  std::vector<std::uint8_t> doubled_;  // by face: does another surface coincide with it, somewhere?
  Distribution power_;
};

}  // namespace ln
