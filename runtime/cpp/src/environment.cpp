#include "ln/emitter_environment.hpp"

#include "ln/texture.hpp"

namespace ln {

namespace {

constexpr double kPiDouble = 3.14159265358979323846;

float usable(float x) { return x > 0 && x < kInfinity ? x : 0.0f; }

/// Integral over [a, b] of (p + q theta) sin(theta).
double integrate_linear_sin(double a, double b, double p, double q) {
  return p * (std::cos(a) - std::cos(b)) + q * ((std::sin(b) - b * std::cos(b)) - (std::sin(a) - a * std::cos(a)));
}

/// How much of the radiance of rows y - 1, y and y + 1 is in row y, as a share of solid angle: linear interpolation
/// between the centres of the rows, which are `step` high.
struct RowWeights {
  double above, own, below;
};
RowWeights row_weights(int y, double step) {
  const double top = y * step, middle = top + 0.5 * step, bottom = top + step;
  RowWeights w;
  w.above = integrate_linear_sin(top, middle, middle / step, -1 / step);
  w.below = integrate_linear_sin(middle, bottom, -middle / step, 1 / step);
  w.own = (std::cos(top) - std::cos(bottom)) - w.above - w.below;
  return w;
}

}  // namespace

Environment::Environment(const Image& image) : image_(&image) {
  const int width = image.width, height = image.height;
  if (width <= 0 || height <= 0) {
    constant_ = true;
    return;
  }
  mean_ = light_of(0, 0);
  constant_ = true;
  for (int y = 0; y < height && constant_; ++y)
    for (int x = 0; x < width && constant_; ++x) constant_ = light_of(x, y) == mean_;
  if (constant_) return;

  // Integrate the interpolated picture over its pixels.
  const double step = kPiDouble / height;
  glm::dvec3 sum(0);
  std::vector<double> ring[3], cells(width), rows(height);
  std::vector<Color> row(width);
  const auto load = [&](int y) {
    for (int x = 0; x < width; ++x) row[x] = light_of(x, y);
    const RowWeights up = row_weights(std::max(y - 1, 0), step), own = row_weights(y, step),
                     down = row_weights(std::min(y + 1, height - 1), step);
    const double share = own.own + (y > 0 ? up.below : own.above) + (y < height - 1 ? down.above : own.below);
    ring[y % 3].resize(width);
    for (int x = 0; x < width; ++x) {
      sum += share * glm::dvec3(row[x]);
      const auto value = [&](int i) { return static_cast<double>(mean_component(row[i])); };
      ring[y % 3][x] = 0.75 * value(x) + 0.125 * (value(x == 0 ? width - 1 : x - 1) + value(x == width - 1 ? 0 : x + 1));
    }
  };
  load(0);
  columns_.reserve(height);
  for (int y = 0; y < height; ++y) {
    if (y + 1 < height) load(y + 1);
    const RowWeights w = row_weights(y, step);
    const std::vector<double>&above = ring[std::max(y - 1, 0) % 3], &own = ring[y % 3],
          &below = ring[std::min(y + 1, height - 1) % 3];
    for (int x = 0; x < width; ++x) cells[x] = w.above * above[x] + w.own * own[x] + w.below * below[x];
    columns_.emplace_back(cells);
    rows[y] = columns_.back().total();
    pixel_solid_angle_.push_back(static_cast<float>((std::cos(y * step) - std::cos((y + 1) * step)) * 2 * kPiDouble / width));
  }
  rows_ = Distribution(rows);
  mean_ = Color(sum / (2.0 * width));
}

Color Environment::light_of(int x, int y) const {
  const Vec4 t = texel(*image_, x, y);
  return {usable(t.x), usable(t.y), usable(t.z)};
}

Vec2 Environment::picture_position(const Vec3& w) const {
  const float theta = std::atan2(std::sqrt(w.x * w.x + w.z * w.z), w.y), phi = std::atan2(w.x, w.z);
  return {(0.5f - phi * (0.5f * kInvPi)) * static_cast<float>(image_->width),
          theta * kInvPi * static_cast<float>(image_->height)};
}

Color Environment::interpolated(const Vec3& w) const {
  const Vec2 at = picture_position(w) - 0.5f;
  const float x = std::floor(at.x), y = std::floor(at.y), fx = at.x - x, fy = at.y - y;
  const int width = image_->width, height = image_->height;
  int x0 = static_cast<int>(x), x1 = x0 + 1;
  if (x0 < 0) x0 += width;
  if (x0 >= width) x0 -= width;
  if (x1 >= width) x1 -= width;
  const int y0 = std::clamp(static_cast<int>(y), 0, height - 1), y1 = std::clamp(static_cast<int>(y) + 1, 0, height - 1);
  const Color top = (1 - fx) * light_of(x0, y0) + fx * light_of(x1, y0),
              bottom = (1 - fx) * light_of(x0, y1) + fx * light_of(x1, y1);
  return (1 - fy) * top + fy * bottom;
}

Environment::Sample Environment::sample(const Vec2& u) const {
  if (constant_) {
    if (is_black()) return {};
    const float y = 1 - 2 * u.y, r = 2 * std::sqrt(u.y * (1 - u.y)), phi = 2 * kPi * u.x;
    return {{r * std::sin(phi), y, r * std::cos(phi)}, 0.25f * kInvPi};
  }
  const Distribution::Sample row = rows_.sample(u.y);
  if (row.pmf == 0) return {};
  const Distribution::Sample column = columns_[row.index].sample(u.x);

  // Within the pixel uniformly by solid angle: 1 - cos is uniform, taken from the nearer pole.
  const float step = kPi / static_cast<float>(image_->height);
  const bool upper = row.index < static_cast<std::uint32_t>(image_->height + 1) / 2;
  const float near = static_cast<float>(upper ? row.index : static_cast<std::uint32_t>(image_->height) - 1 - row.index) * step;
  const float q0 = sqr(std::sin(0.5f * near)), q1 = sqr(std::sin(0.5f * (near + step)));
  const float q = q0 + (q1 - q0) * (upper ? row.u : 1 - row.u);
  const float y = 1 - 2 * q, r = 2 * safe_sqrt(q * (1 - q));
  const float phi = 2 * kPi * (0.5f - (static_cast<float>(column.index) + column.u) / static_cast<float>(image_->width));
  return {{r * std::sin(phi), upper ? y : -y, r * std::cos(phi)}, row.pmf * column.pmf / pixel_solid_angle_[row.index]};
}

float Environment::pdf_w(const Vec3& w) const {
  if (constant_) return is_black() ? 0.0f : 0.25f * kInvPi;
  const Vec2 at = picture_position(w);
  const int x = std::clamp(static_cast<int>(at.x), 0, image_->width - 1),
            y = std::clamp(static_cast<int>(at.y), 0, image_->height - 1);
  return rows_.pmf(y) == 0 ? 0.0f : rows_.pmf(y) * columns_[y].pmf(x) / pixel_solid_angle_[y];
}

Environment::Sample Environment::sample(const Vec3& n, const Vec2& u) const {
  if (!constant_ || n == Vec3(0) || is_black()) return sample(u);
  const float r = std::sqrt(u.x), z = std::sqrt(1 - u.x), phi = 2 * kPi * u.y;
  return {make_frame(n).to_world({r * std::cos(phi), r * std::sin(phi), z}), z * kInvPi};
}

float Environment::pdf_w(const Vec3& n, const Vec3& w) const {
  if (!constant_ || n == Vec3(0) || is_black()) return pdf_w(w);
  return std::max(0.0f, glm::dot(n, w)) * kInvPi;
}

}  // namespace ln
