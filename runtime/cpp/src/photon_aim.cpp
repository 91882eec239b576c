#include "ln/photon_aim.hpp"

#include <algorithm>
#include <numeric>

namespace ln {

namespace {

constexpr std::size_t kMaxBalls = 16;

/// A ball is replaced by two if their cross sections are smaller by this factor.
constexpr float kWorthSplitting = 0.9f;

/// Beyond the rounding of coordinates within [-1, 1].
constexpr float kMargin = 1e-5f;

float solid_angle_of(float distance2, float radius) {
  const float sine2 = sqr(radius) / distance2;
  if (!(sine2 < 1)) return kInfinity;
  return 2 * kPi * sine2 / (1 + std::sqrt(1 - sine2));
}

/// Picks one of n weights by u, which is made new.
template <class Weight>
std::size_t pick(std::size_t n, float sum, float& u, Weight&& weight) {
  float rest = u * sum;
  std::size_t i = 0;
  while (i + 1 < n && rest >= weight(i)) rest -= weight(i++);
  u = std::clamp(rest / weight(i), 0.0f, kOneMinusEpsilon);
  return i;
}

}  // namespace

PhotonAim::PhotonAim(const SceneData& data, const std::vector<bool>& wanted) {
  using Triangles = std::vector<std::uint32_t>;
  const auto vertex = [&](std::uint32_t t, std::size_t k) { return data.positions[data.triangles[t][k]]; };
  const auto bounds = [&](const Triangles& triangles) {
    std::pair<Vec3, Vec3> box{Vec3(kInfinity), Vec3(-kInfinity)};
    for (const std::uint32_t t : triangles)
      for (std::size_t k = 0; k < 3; ++k) box = {glm::min(box.first, vertex(t, k)), glm::max(box.second, vertex(t, k))};
    return box;
  };
  const auto ball_around = [&](const Triangles& triangles) {
    const auto [low, high] = bounds(triangles);
    Ball ball{0.5f * (low + high), 0};
    for (const std::uint32_t t : triangles)
      for (std::size_t k = 0; k < 3; ++k) ball.radius = std::max(ball.radius, glm::distance(vertex(t, k), ball.center));
    ball.radius += kMargin;
    return ball;
  };

  Triangles all;
  for (std::uint32_t t = 0; t < data.triangles.size(); ++t)
    if (wanted[data.triangle_part[t]]) all.push_back(t);
  if (all.empty()) return;

  // Halve the largest group along the longest side of its box, as long as that makes it smaller.
  struct Group {
    Triangles triangles;
    Ball ball;
    bool final = false;
  };
  std::vector<Group> groups;
  groups.push_back({std::move(all), {}});
  groups[0].ball = ball_around(groups[0].triangles);
  while (groups.size() < kMaxBalls) {
    const auto largest = std::max_element(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
      return (a.final ? 0 : a.ball.radius) < (b.final ? 0 : b.ball.radius);
    });
    if (largest->final) break;
    const auto [low, high] = bounds(largest->triangles);
    const Vec3 size = high - low;
    const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const float middle = 0.5f * (low[axis] + high[axis]);
    Group halves[2];
    for (const std::uint32_t t : largest->triangles) {
      const float center = (vertex(t, 0)[axis] + vertex(t, 1)[axis] + vertex(t, 2)[axis]) * (1.0f / 3);
      halves[center < middle ? 0 : 1].triangles.push_back(t);
    }
    largest->final = halves[0].triangles.empty() || halves[1].triangles.empty();
    if (largest->final) continue;
    for (Group& half : halves) half.ball = ball_around(half.triangles);
    if (sqr(halves[0].ball.radius) + sqr(halves[1].ball.radius) > kWorthSplitting * sqr(largest->ball.radius)) {
      largest->final = true;
      continue;
    }
    *largest = std::move(halves[0]);
    groups.push_back(std::move(halves[1]));
  }
  for (const Group& group : groups) balls_.push_back(group.ball);
}

float PhotonAim::solid_angle(const Vec3& from) const {
  float sum = 0;
  for (const Ball& ball : balls_) {
    const Vec3 d = ball.center - from;
    sum += solid_angle_of(glm::dot(d, d), ball.radius);
  }
  return sum;
}

PhotonAim::Direction PhotonAim::direction(const Vec3& from, const Vec2& u) const {
  const auto weight = [&](std::size_t i) {
    const Vec3 d = balls_[i].center - from;
    return solid_angle_of(glm::dot(d, d), balls_[i].radius);
  };
  const float sum = solid_angle(from);
  float u_cone = u.x;
  const Ball& ball = balls_[pick(balls_.size(), sum, u_cone, weight)];
  const Vec3 d = ball.center - from;
  const float sine2 = sqr(ball.radius) / glm::dot(d, d);
  const float height = u_cone * sine2 / (1 + std::sqrt(1 - sine2));  // 1 - cos
  const float r = safe_sqrt(height * (2 - height)), phi = 2 * kPi * u.y;
  const Vec3 w = glm::normalize(make_frame(glm::normalize(d)).to_world({r * std::cos(phi), r * std::sin(phi), 1 - height}));
  return {w, sum / static_cast<float>(std::max(met(from, w), 1))};
}

float PhotonAim::cross_section() const {
  float sum = 0;
  for (const Ball& ball : balls_) sum += kPi * sqr(ball.radius);
  return sum;
}

PhotonAim::Origin PhotonAim::origin(const Vec3& w, const Vec2& u) const {
  const float sum = cross_section();
  float u_disc = u.x;
  const Ball& ball = balls_[pick(balls_.size(), sum, u_disc, [&](std::size_t i) { return kPi * sqr(balls_[i].radius); })];
  const float r = ball.radius * std::sqrt(u_disc), phi = 2 * kPi * u.y;
  const Vec3 p = ball.center + make_frame(w).to_world({r * std::cos(phi), r * std::sin(phi), 0});
  const Vec3 on_plane = p - glm::dot(p, w) * w;
  constexpr float kFar = 4;  // before everything
  return {on_plane, sum / static_cast<float>(std::max(met(on_plane - kFar * w, w), 1))};
}

int PhotonAim::met(const Vec3& from, const Vec3& w) const {
  int count = 0;
  for (const Ball& ball : balls_) {
    const Vec3 d = ball.center - from;
    const float along = glm::dot(d, w);
    const Vec3 across = d - along * w;
    if (glm::dot(across, across) <= sqr(ball.radius) && (along >= 0 || glm::dot(d, d) <= sqr(ball.radius))) ++count;
  }
  return count;
}

}  // namespace ln
