#pragma once
// Irradiance at points of surfaces, over the links of radiosity.

#include "radiosity_light.hpp"
#include "radiosity_links.hpp"

namespace ln::radiosity {

class Gatherer {
 public:
  /// `allowed`: what a link may err by [W/m^2], `rays_of_error`: rays of one that brings as much. Spreads of the light must
  /// be known.
  Gatherer(PrepareContext& context, NodeId node, const Hierarchy& shape, const Links& links, const Light& light, float allowed,
           float rays_of_error)
      : context_(context),
        node_(node),
        shape_(shape),
        links_(links),
        light_(light),
        allowed_(allowed),
        rays_of_error_(rays_of_error) {}

  /// Irradiance in the middle of each leaf that the radiosity makes, with form factors of and rays from that point; on
  /// large leaves the mean of several points.
  std::vector<Color> at_leaves() const;

 private:
  struct Gathered {
    Color E{0};
    float sum = 0;  // of form factors

    Gathered operator*(float f) const { return {E * f, sum * f}; }
    Gathered operator/(float f) const { return *this * (1 / f); }
    Gathered& operator+=(const Gathered& other) {
      E += other.E;
      sum += other.sum;
      return *this;
    }
  };

  struct Receiver {
    /// `number`: of the point among those of its leaf.
    Receiver(const Hierarchy& shape, const Hierarchy::Place& place, std::uint32_t number)
        : element(place.element),
          key(hash32(place.element, number)),
          p(place.p),
          n(shape.elements[place.element].flat.normal),
          at(shape.locate(place)) {}
    std::uint32_t element, key;  // the key is for random numbers
    Vec3 p, n;
    SurfacePosition at;
  };

  static std::uint32_t points_in(const Element& element);
  Gathered gather(const Receiver& receiver, const std::vector<Gathered>& from_clusters, Tracer& tracer) const;
  Gathered unoccluded(std::uint32_t source, const Receiver& receiver, float resolved) const;
  float towards(const Link& link, const Receiver& receiver) const;
  Gathered visible_part(const Gathered& g, const Link& link, const Receiver& receiver, Tracer& tracer) const;
  float seen(NodeRef source, const Receiver& receiver, std::uint32_t rays, bool bright, Tracer& tracer) const;
  Hierarchy::Place bright_place(NodeRef n, float pick, const Vec2& u) const;

  PrepareContext& context_;
  NodeId node_;
  const Hierarchy& shape_;
  const Links& links_;
  const Light& light_;
  float allowed_, rays_of_error_;
};

}  // namespace ln::radiosity
