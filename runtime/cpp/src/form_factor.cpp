#include "ln/form_factor.hpp"

#include <algorithm>
#include <glm/common.hpp>

namespace ln {

namespace {

/// What lies less than this share of a cell's radius above a plane counts as in it.
constexpr float kFlat = 1e-5f;

/// Is all of the cell on the wrong side of the plane?
bool behind(const FlatCell& cell, const Vec3& p, const Vec3& n, float tolerance) {
  for (int k = 0; k < cell.cell.corner_count(); ++k)
    if (glm::dot(cell.cell.corner(k) - p, n) > tolerance) return false;
  return true;
}

/// atan2(y, x) / y for y > 0.
double angle_over_sine(double y, double x) {
  const double q = y / x * (y / x);
  if (x > 0 && q < 0.15) {  // the series, to nine digits: most edges are seen at small angles
    double sum = 0;
    for (int k = 8; k >= 0; --k) sum = 1.0 / (2 * k + 1) - q * sum;
    return sum / x;
  }
  return std::atan2(y, x) / y;
}

}  // namespace

FlatCell make_flat_cell(const SurfaceCell& cell, bool front) {
  FlatCell flat;
  flat.cell = cell;
  flat.area = area(cell);
  const Vec3 n = glm::normalize(glm::cross(cell.a, cell.b));
  flat.normal = front ? n : -n;
  for (int k = 0; k < cell.corner_count(); ++k)
    flat.radius = std::max(flat.radius, glm::distance(cell.corner(k), cell.center()));
  return flat;
}

float point_form_factor(const Vec3& p, const Vec3& n, const FlatCell& source) {
  if (glm::dot(p - source.cell.o, source.normal) <= kFlat * source.radius) return 0;
  // Clip at the horizon.
  const int count = source.cell.corner_count();
  DVec3 corner[5];
  int m = 0;
  const DVec3 normal(n);
  for (int k = 0; k < count; ++k) {
    const DVec3 a(source.cell.corner(k) - p), b(source.cell.corner((k + 1) % count) - p);
    const double ha = glm::dot(a, normal), hb = glm::dot(b, normal);
    if (ha >= 0) corner[m++] = a;
    if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) corner[m++] = a + (ha / (ha - hb)) * (b - a);
  }
  if (m < 3) return 0;
  double sum = 0;
  for (int k = 0; k < m; ++k) {
    const DVec3 a = corner[k], b = corner[(k + 1) % m], c = glm::cross(a, b);
    const double length = glm::length(c);
    if (length > 0) sum += angle_over_sine(length, glm::dot(a, b)) * glm::dot(c, normal);
  }
  return std::min(1.0f, static_cast<float>(std::abs(sum) * (0.5 / static_cast<double>(kPi))));
}

FormFactor form_factor(const FlatCell& receiver, const FlatCell& source) {
  const Vec3 here = receiver.cell.center();
  if (behind(source, here, receiver.normal, kFlat * source.radius) &&
      behind(source, receiver.cell.o, receiver.normal, kFlat * source.radius))
    return {};
  if (behind(receiver, source.cell.o, source.normal, kFlat * receiver.radius)) return {};

  const Vec3 way = source.cell.center() - here;
  const float distance2 = glm::dot(way, way);
  // The kernel errs by about the square of size over distance, its change over the receiver is twice the size over the
  // distance.
  constexpr float kFar = 12, kApart = 3;
  if (distance2 > sqr(kFar * std::max(source.radius, receiver.radius))) {
    const float f = std::max(0.0f, glm::dot(way, receiver.normal)) * std::max(0.0f, -glm::dot(way, source.normal)) *
                    source.area * kInvPi / sqr(distance2);
    return {f, 2 * f * receiver.radius / std::sqrt(distance2)};
  }
  const bool apart = distance2 > sqr(kApart * (source.radius + receiver.radius));
  float sum = 0, low = kInfinity, high = 0;
  for (int i = 0; i < 4; ++i) {
    const SurfaceCell child = receiver.cell.child(i);
    float f = 0;
    if (apart) {
      f = point_form_factor(child.center(), receiver.normal, source);
    } else {
      for (int k = 0; k < 4; ++k) {
        const float part = point_form_factor(child.child(k).center(), receiver.normal, source);
        low = std::min(low, part);
        high = std::max(high, part);
        f += 0.25f * part;
      }
    }
    low = std::min(low, f);
    high = std::max(high, f);
    sum += 0.25f * f;
  }
  return {sum, 0.5f * (high - low)};
}

}  // namespace ln
