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

inline constexpr std::uint32_t kMostRays = 16;
/// Rays of a link that carries as much as it may err.
inline constexpr float kRaysOfError = 4;
/// Number of rays for a link that carries so many times what it may err.
inline std::uint32_t rays_of(float importance) {
  return static_cast<std::uint32_t>(std::clamp(kRaysOfError * importance, 1.0f, static_cast<float>(kMostRays)));
}

/// What irradiance on an element is multiplied by whose form factors add up to `sum`: they should to 1 where its face sees
/// nothing but surfaces, and nowhere to more.
float sum_correction(const Hierarchy& shape, std::uint32_t element, float sum);

/// Random numbers for a point of each of two things.
struct PairOfPoints {
  Vec2 pick, u, v;
};
/// Evenly distributed pairs: the additive recurrence of Roberts 2018, "The Unreasonable Effectiveness of Quasirandom
/// Sequences", in six dimensions, shifted at random. Costs a fraction of Sobol points, and few are looked at.
class PairSequence {
 public:
  explicit PairSequence(std::uint32_t key) {
    for (std::uint32_t k = 0; k < 6; ++k) shift_[k] = hash32(key, k);
  }

  PairOfPoints operator[](std::uint32_t i) const {
    // 2^32 / g^k with g^7 = g + 1, so that products are their own fractional parts.
    constexpr std::uint32_t kStep[6] = {0xe60e2b72u, 0xcebd76d9u, 0xb9c9aa3au, 0xa6f5777fu, 0x9609c71eu, 0x86d516e5u};
    float x[6];
    for (std::uint32_t k = 0; k < 6; ++k) x[k] = to_unit_float(shift_[k] + i * kStep[k]);
    return {{x[0], x[1]}, {x[2], x[3]}, {x[4], x[5]}};
  }

 private:
  std::uint32_t shift_[6];
};

}  // namespace ln::radiosity
