#pragma once
// The light of radiosity while it is solved for.

#include "radiosity_hierarchy.hpp"

namespace ln::radiosity {

/// A dark surface counts as this bright, in means of the radiosity, where light arrives: its form factors are needed for the
/// sum of all, which is known.
inline constexpr float kDarkest = 1;

class Light {
 public:
  explicit Light(const Hierarchy& shape) : shape_(shape) {}

  // By element.
  std::vector<Color> radiosity, irradiance;  // irradiance: all of it, that of the input too
  std::vector<float> spread;                 // how much the radiosity of its leaves differs from its own
  float mean = 0;                            // area mean of the radiosity, of its brightest channel

  /// From the irradiance of the leaves.
  void pull() { pull(irradiance, radiosity); }
  void pull(std::vector<Color>& irradiance, std::vector<Color>& radiosity) const;
  void find_spreads();
  float find_mean();
  void summarise_clusters();
  /// For elements that are new: those of `parent`.
  void add_children_of(std::uint32_t parent);

  /// How much it counts that the source shines, where errors are judged.
  float brightness(NodeRef source, NodeRef receiver) const {
    return std::max(brightness(source), lit(receiver) ? kDarkest * mean : 0.0f);
  }
  float brightness(NodeRef n) const {
    return is_cluster(n) ? cluster_brightness_[cluster_index(n)] : max_component(radiosity[n]);
  }
  bool lit(NodeRef n) const { return is_cluster(n) ? cluster_lit_[cluster_index(n)] != 0 : !is_black(irradiance[n]); }
  /// Mean radiosity of the leaf that a point lies in.
  float brightness(const Hierarchy::Place& place) const;

 private:
  const Hierarchy& shape_;
  std::vector<float> cluster_brightness_;
  std::vector<std::uint8_t> cluster_lit_;
};

}  // namespace ln::radiosity
