#include "ln/secondary_sources.hpp"

#include <algorithm>

#include "ln/diffuse_surface.hpp"
#include "ln/material.hpp"

namespace ln {

namespace {

constexpr std::uint64_t kPilotsPerCell = 4;
constexpr int kMaxDepth = 8;  // of cells in a patch

/// Dark cells get this share of the mean power by area: a pilot may have missed their light.
constexpr double kSafeShare = 0.2;

}  // namespace

SecondarySources::SecondarySources(PrepareContext& context, NodeId node, const RadianceSource& source, std::uint32_t key,
                                   std::uint64_t pilots)
    : node_(node), source_(&source), patches_(context.scene().data()), doubled_(patches_.face_count(), 0) {
  add_cells(context.scene(), std::clamp<std::uint64_t>(pilots / kPilotsPerCell, 64, 1 << 16));

  std::vector<double> powers(cells_.size());
  std::vector<std::uint8_t> doubled(cells_.size(), 0);
  context.for_chunks(cells_.size(), 64, [&](std::size_t begin, std::size_t end, Tracer& tracer) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::uint32_t k = 0; k < kPilotsPerCell; ++k) {
        const SampleStream random(key, static_cast<std::uint32_t>(i * kPilotsPerCell + k));
        if (hidden(cells_[i], tracer, random)) doubled[i] = 1;
        powers[i] += static_cast<double>(max_component(emit_from(cells_[i], tracer, random).flux)) / kPilotsPerCell;
      }
  });
  double power = 0, area = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    doubled_[cells_[i].face] |= doubled[i];
    power += powers[i];
    area += static_cast<double>(cells_[i].area);
  }
  if (!(power > 0)) power = area;  // all pilots were dark: any cell may be bright nevertheless
  for (std::size_t i = 0; i < cells_.size(); ++i) powers[i] += kSafeShare * power * static_cast<double>(cells_[i].area) / area;
  power_ = Distribution(powers);
}

void SecondarySources::add_cells(const Scene& scene, std::uint64_t wanted) {
  std::vector<std::uint32_t> faces;
  double whole = 0;
  for (std::uint32_t face = 0; face < patches_.face_count(); ++face) {
    if (!scatters_diffusely(scene, patches_.part(face / 2), Patches::is_front(face))) continue;
    faces.push_back(face);
    whole += static_cast<double>(area(patches_.surface(face / 2)));
  }
  const auto largest = static_cast<float>(whole / static_cast<double>(wanted));
  for (const std::uint32_t face : faces) {
    const float face_area = area(patches_.surface(face / 2));
    int depth = 0;
    while (depth < kMaxDepth && std::ldexp(face_area, -2 * depth) > largest) ++depth;
    std::vector<DomainCell> cells{patches_.domain(face / 2)};
    for (int level = 0; level < depth; ++level) {
      std::vector<DomainCell> children;
      for (const DomainCell& cell : cells)
        for (int i = 0; i < 4; ++i) children.push_back(cell.child(i));
      cells.swap(children);
    }
    for (const DomainCell& cell : cells) cells_.push_back({face, cell, std::ldexp(face_area, -2 * depth)});
  }
}

bool SecondarySources::hidden(const Cell& cell, Tracer& tracer, const SampleStream& random) const {
  const Hit at = patches_.hit(cell.face / 2, cell.domain.point(random.get2(kOwn)));
  return !outermost(tracer, node_, at, Patches::is_front(cell.face), random.bits(kCoverage));
}

PhotonEmission SecondarySources::emit_from(const Cell& cell, Tracer& tracer, const SampleStream& random) const {
  const Scene& scene = tracer.scene();
  const Hit hit = patches_.hit(cell.face / 2, cell.domain.point(random.get2(kOwn)));
  PhotonEmission photon;
  photon.triangle = hit.triangle;
  scene.locate(hit, photon.position);
  const Vec3 normal = Patches::is_front(cell.face) ? photon.position.ng : -photon.position.ng;
  const Vec2 u = random.get2(kBsdfDirection);
  const float r = std::sqrt(u.x), phi = 2 * kPi * u.y;
  photon.cos_theta = std::sqrt(1 - u.x);
  photon.direction = make_frame(normal).to_world({r * std::cos(phi), r * std::sin(phi), photon.cos_theta});

  Hit near = hit;
  near.t = 0;  // nothing is absorbed on the way from here to here
  const Interaction at(scene, Ray{photon.position.p, -photon.direction, kInfinity}, near);
  if (!any(at.bsdf().events() & Events::D)) return photon;
  const float there = hit.triangle < scene.data().alpha_begin ? 1.0f : coverage(scene.data(), hit.triangle, hit.u, hit.v);
  photon.flux = (*source_)(tracer, random, at) * (kPi * cell.area * there);
  return photon;
}

PhotonEmission SecondarySources::emit(Tracer& tracer, const SampleStream& random) const {
  const Distribution::Sample pick = power_.sample(random.get1(kBsdfLobe));
  if (!(pick.pmf > 0)) return {};
  const Cell& cell = cells_[pick.index];
  if (doubled_[cell.face] != 0 && hidden(cell, tracer, random)) return {};
  PhotonEmission photon = emit_from(cell, tracer, random);
  photon.flux /= pick.pmf;
  return photon;
}

}  // namespace ln
