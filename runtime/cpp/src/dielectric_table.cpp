#include "ln/dielectric_table.hpp"

#include "ln/microfacet.hpp"

namespace ln {

namespace {

constexpr int kLanes = 16;  // loops over lanes become vector code

/// Points of the unit square in (cosine of the azimuth, height): a Kronecker lattice, which crosses the curves at which
/// the integrand breaks (the critical angle) at ever other places.
struct Lattice {
  std::vector<float> cosine, height;

  explicit Lattice(int points) : cosine(points), height(points) {
    for (int k = 0; k < points; k++) {
      const double turn = (k + 0.5) * 0.6180339887498949;
      cosine[k] = static_cast<float>(std::cos(3.14159265358979 * (turn - std::floor(turn))));
      height[k] = static_cast<float>((k + 0.5) / points);
    }
  }
};

/// 1 - single-bounce albedo, without and with Fresnel reflection: the mean over visible normals of what masking takes from
/// the reflected and the refracted direction.
Vec2 integrate(const Lattice& lattice, float mu, float alpha, float eta) {
  const Ggx ggx(alpha);
  const float sine = safe_sqrt((1 - mu) * (1 + mu));
  const float scale = 1 / std::sqrt(alpha * alpha * sine * sine + mu * mu);
  const float vx = alpha * sine * scale, vz = mu * scale;
  const float reach = ggx.reach(mu);
  const float bend = (eta - 1) * (eta + 1), inverse_eta = 1 / eta;
  float bare[kLanes] = {}, plain[kLanes] = {};
  for (std::size_t first = 0; first < lattice.height.size(); first += kLanes) {
    for (int lane = 0; lane < kLanes; lane++) {
      const float z = 1 - lattice.height[first + lane] * (1 + vz);
      const float r2 = std::max((1 - z) * (1 + z), 0.0f), hz = std::max(z + vz, 1e-7f);
      const float rc = std::sqrt(r2) * lattice.cosine[first + lane];
      const float hh = alpha * alpha * (r2 + 2 * rc * vx + vx * vx) + hz * hz;
      const float inverse_h = 1 / std::sqrt(hh);
      const float mx = alpha * (rc + vx) * inverse_h, mz = hz * inverse_h;
      const float om = std::max(sine * mx + mu * mz, 1e-7f);

      const float up = 2 * om * mz - mu;
      const float reflected = up > 0 ? up * (mu + reach) / (mu * ggx.reach(up) + up * reach) : 0;
      const float cos2_t = (bend + om * om) * inverse_eta * inverse_eta;
      const float cos_t = std::sqrt(std::max(cos2_t, 0.0f));
      const float down = (cos_t - om * inverse_eta) * mz + mu * inverse_eta;
      const float refracted = down > 0 ? 2 * down / (down + ggx.reach(down)) : 0;
      const float s = (om - eta * cos_t) / (om + eta * cos_t), p = (eta * om - cos_t) / (eta * om + cos_t);
      const float fresnel = 0.5f * (s * s + p * p);  // 1 at cos_t = 0
      bare[lane] += 1 - (cos2_t > 0 ? refracted : reflected);
      plain[lane] += 1 - (refracted + fresnel * (reflected - refracted));
    }
  }
  Vec2 sum{0};
  for (int lane = 0; lane < kLanes; lane++) sum += Vec2(bare[lane], plain[lane]);
  return sum / static_cast<float>(lattice.height.size());
}

}  // namespace

DielectricTable::DielectricTable(float ior, float min_roughness, float max_roughness) {
  min_roughness_ = std::clamp(min_roughness, kMinRoughness, 1.0f);
  const float span = std::clamp(max_roughness, min_roughness_, 1.0f) - min_roughness_;
  inverse_span_ = span > 0 ? 1 / span : 0;
  rows_ = span > 0 ? 2 + static_cast<int>(span * 34) : 1;
  const auto roughness_of = [&](int row, int rows) {
    const float x = rows > 1 ? static_cast<float>(row) / static_cast<float>(rows - 1) : 0;
    return min_roughness_ + span * 0.5f * (x + x * x);
  };

  // Total internal reflection needs the more points.
  const Lattice smooth(rows_ > 1 ? 2048 : 8192), broken(rows_ > 1 ? 4096 : 24576);
  for (const bool outside : {false, true}) {
    const float eta = outside ? ior : 1 / ior;
    deficit_[outside].resize(static_cast<std::size_t>(rows_));
    for (int row = 0; row < rows_; row++) {
      const float alpha = sqr(roughness_of(row, rows_));
      for (int i = 0; i < kColumns; i++) {
        const float target = static_cast<float>(i) / (kColumns - 1);
        float low = 0, high = 1;
        for (int step = 0; step < 40; step++) {
          const float middle = 0.5f * (low + high);
          (column(alpha, middle) < target ? low : high) = middle;
        }
        const Vec2 d = glm::max(integrate(eta < 1 ? broken : smooth, std::max(high, 1e-7f), alpha, eta), Vec2(0));
        deficit_[outside][row].values[i][0] = d.x;
        deficit_[outside][row].values[i][1] = d.y;
      }
    }

    const int averages = kFiner * (rows_ - 1) + 1;
    average_[outside].resize(static_cast<std::size_t>(averages));
    for (int row = 0; row < averages; row++) {
      // Integrate 2 mu dmu over v with mu = alpha (exp(v log(1 + 1 / alpha)) - 1): as much happens around alpha as around 1.
      constexpr int kPoints = 192;
      const float roughness = roughness_of(row, averages), alpha = roughness * roughness;
      const float scale = std::log(1 + 1 / alpha);
      Vec2 sum{0};
      for (int k = 0; k < kPoints; k++) {
        const float growth = std::exp(scale * (static_cast<float>(k) + 0.5f) / kPoints), mu = alpha * (growth - 1);
        sum += deficit(outside, roughness, mu) * (2 * mu * alpha * growth * scale / kPoints);
      }
      average_[outside][row] = sum / (alpha * alpha);
    }
  }
}

}  // namespace ln
