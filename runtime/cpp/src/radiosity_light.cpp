#include "radiosity_light.hpp"

#include <algorithm>
#include <glm/common.hpp>

namespace ln::radiosity {

/// Radiosity of the leaves from their irradiance; means of both for all others.
void Light::pull(std::vector<Color>& irradiance, std::vector<Color>& radiosity) const {
  const std::size_t count = shape_.elements.size();
  radiosity.resize(count);
  for (std::size_t i = count; i-- > 0;) {
    const Element& e = shape_.elements[i];
    if (e.leaf()) {
      radiosity[i] = e.albedo * irradiance[i];
      continue;
    }
    radiosity[i] = irradiance[i] = Color(0);
    for (std::uint32_t c = e.children; c < e.children + 4; ++c) {
      radiosity[i] += 0.25f * radiosity[c];
      irradiance[i] += 0.25f * irradiance[c];
    }
  }
}

void Light::find_spreads() {
  spread.assign(shape_.elements.size(), 0.0f);
  for (std::size_t i = spread.size(); i-- > 0;) {
    const Element& e = shape_.elements[i];
    for (std::uint32_t c = e.children; c < e.children + 4 && !e.leaf(); ++c)
      spread[i] = std::max(spread[i], max_component(glm::abs(radiosity[c] - radiosity[i])) + spread[c]);
  }
}

float Light::find_mean() {
  double sum = 0, whole = 0;
  for (std::size_t i = 0; i < shape_.faces.size(); ++i) {
    const auto a = static_cast<double>(shape_.elements[i].flat.area);
    sum += a * static_cast<double>(max_component(radiosity[i]));
    whole += a;
  }
  mean = static_cast<float>(sum / whole);
  return mean;
}

/// Mean brightness and whether any light arrives, by cluster.
void Light::summarise_clusters() {
  cluster_brightness_.assign(shape_.clusters.size(), 0);
  cluster_lit_.assign(shape_.clusters.size(), 0);
  for (std::size_t i = shape_.clusters.size(); i-- > 0;) {
    const Cluster& c = shape_.clusters[i];
    float sum = 0;
    for (const NodeRef child : c.child) {
      sum += shape_.area(child) * brightness(child);
      if (lit(child)) cluster_lit_[i] = 1;
    }
    cluster_brightness_[i] = sum / c.area;
  }
}

float Light::brightness(const Hierarchy::Place& place) const {
  std::uint32_t e = place.element;
  for (Vec2 st = place.st; !shape_.elements[e].leaf();)
    e = shape_.elements[e].children + static_cast<std::uint32_t>(descend(shape_.elements[e].domain.quad, st));
  return mean_component(radiosity[e]);
}

void Light::add_children_of(std::uint32_t parent) {
  const std::size_t count = shape_.elements.size();
  radiosity.resize(count, radiosity[parent]);
  irradiance.resize(count, irradiance[parent]);
  spread.resize(count, 0.0f);
}

}  // namespace ln::radiosity
