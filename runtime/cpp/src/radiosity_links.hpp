#pragma once
// What light goes over between the cells and clusters of radiosity.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "ln/parallel.hpp"
#include "ln/sampling.hpp"
#include "radiosity_hierarchy.hpp"

namespace ln::radiosity {

/// Light goes from `source` to `receiver`. Between elements as radiosity * factor * visibility of each quarter of the source,
/// the same all over the receiver; with a cluster, faces count with their own normals as if each were at the cluster's center.
struct Link {
  NodeRef receiver, source;
  float factor[4] = {};  // form factors of the source's quarters without occlusion, between elements
  float visibility = 0;
  std::uint32_t rays = 0;  // that have been cast for the visibility

  bool plain() const { return !is_cluster(receiver) && !is_cluster(source); }
};

/// Irradiance that a face with the normal n gets over a link with a cluster, unless it is hidden: flow * max(0, dot(n,
/// towards)).
struct Flow {
  Vec3 towards;  // the source
  Color flow;
};

/// What elements shine, and large clusters all together.
class Shine {
 public:
  Shine(const Hierarchy& shape, Workers& workers, const std::vector<Color>& radiosity);

  /// Intensity [W/sr] times pi, if nothing hides anything.
  Color towards(NodeRef n, const Vec3& direction) const;

 private:
  const Hierarchy& shape_;
  const std::vector<Color>& radiosity_;
  std::vector<std::array<Color, kLobes>> lobes_;  // mean radiosity, by large cluster
};

/// The links of a hierarchy: those of elements first, in order of receivers.
class Links {
 public:
  explicit Links(const Hierarchy& shape) : shape_(shape) {}

  std::size_t size() const { return links_.size(); }
  const Link& operator[](std::size_t l) const { return links_[l]; }
  void set(std::vector<Link> links);
  std::vector<Link> take() { return std::move(links_); }

  /// Numbers of the links to an element or a cluster.
  struct Range {
    std::size_t first, end;
  };
  Range to(NodeRef receiver) const {
    const std::vector<std::size_t>& first = is_cluster(receiver) ? first_of_cluster_ : first_of_element_;
    const std::size_t i = is_cluster(receiver) ? cluster_index(receiver) : receiver;
    return {first[i], first[i + 1]};
  }

  Flow flow(const Link& link, const Shine& shine) const;

  /// Irradiance on each element that `radiosity` makes.
  std::vector<Color> transport(Workers& workers, const std::vector<Color>& radiosity) const;

 private:
  Color unoccluded(const Link& link, const std::vector<Color>& radiosity) const;

  const Hierarchy& shape_;
  std::vector<Link> links_;
  std::vector<std::size_t> first_of_element_, first_of_cluster_;
};

/// What irradiance on an element is multiplied by whose form factors add up to `sum`: they should to 1 where its face sees
/// nothing but surfaces, and nowhere to more.
float sum_correction(const Hierarchy& shape, std::uint32_t element, float sum);

}  // namespace ln::radiosity
