// Computes the tables of ln/albedo_table.hpp: `make_albedo_tables OUT.inc`, run when the library is built.
//
// E(mu) = integral of f cos over the hemisphere, by the midpoint rule over the square that visible-normal sampling maps to
// it, in double precision and independent of the code that renders.

#include <cmath>
#include <cstdio>

#include "ln/albedo_table.hpp"

namespace {

struct Albedo {
  double deficit, schlick;
};

double reach(double alpha, double z) { return std::sqrt(alpha * alpha + (1 - alpha * alpha) * z * z); }

/// Single-bounce albedo of GGX for the cosine `mu`.
Albedo integrate(double mu, double alpha) {
  constexpr int kSteps = 64;
  const double sine = std::sqrt(std::max(0.0, 1 - mu * mu));
  const double length = std::hypot(alpha * sine, mu);
  const double vx = alpha * sine / length, vz = mu / length;
  const double s = 1 + sine;
  const double share = (1 - alpha * alpha) * s * s / (s * s + alpha * alpha * mu * mu);
  const double reach_o = reach(alpha, mu);
  double deficit = 0, schlick = 0, total = 0;
  for (int j = 0; j < kSteps; j++) {
    // Smoothstep crowds the points where the integrand has its kinks: the poles of the cap.
    const double x = (j + 0.5) / kSteps, u = x * x * (3 - 2 * x), weight = 6 * x * (1 - x);
    const double b = share * vz, z = (1 - u) * (1 + b) - b, r = std::sqrt(std::max(0.0, (1 - z) * (1 + z)));
    for (int i = 0; i < kSteps; i++) {
      const double phi = M_PI * (i + 0.5) / kSteps;
      double hx = alpha * (r * std::cos(phi) + vx), hy = alpha * r * std::sin(phi), hz = z + vz;
      const double h = std::sqrt(hx * hx + hy * hy + hz * hz);
      hx /= h, hz /= h;
      const double om = sine * hx + mu * hz, zi = 2 * om * hz - mu;
      const double f = zi > 0 ? zi * (share * mu + reach_o) / (mu * reach(alpha, zi) + zi * reach_o) : 0;
      total += weight;
      deficit += weight * (1 - f);
      schlick += weight * f * std::pow(std::max(0.0, 1 - om), 5);
    }
  }
  return {deficit / total, schlick / total};
}

/// The cosine that lends its Schlick weight to all that is reflected, as a shift from `mu` in units of alpha.
double shift(const Albedo& a, double mu, double alpha) { return (1 - std::pow(a.schlick / (1 - a.deficit), 0.2) - mu) / alpha; }

double cosine_of(double u, double alpha) { return std::clamp(u * u * alpha / (1 + alpha - u * u), 1e-9, 1.0); }

double roughness_of(int row, int rows) { return ln::kMinRoughness + (1 - ln::kMinRoughness) * row / (rows - 1); }

}  // namespace

int main(int argc, char** argv) {
  using namespace ln::albedo_table;
  if (argc != 2) return std::fprintf(stderr, "usage: make_albedo_tables OUT.inc\n"), 2;
  std::FILE* out = std::fopen(argv[1], "w");
  if (!out) return std::perror(argv[1]), 1;

  static float facet_table[kRows][kColumns][2];
  for (int row = 0; row < kRows; row++) {
    const double roughness = roughness_of(row, kRows), alpha = roughness * roughness;
    const auto shift_at = [&](double u) { return shift(integrate(cosine_of(u, alpha), alpha), cosine_of(u, alpha), alpha); };
    for (int column = 0; column < kColumns; column++) {
      const double cell = 1 / (kColumns - 1.0), u = column * cell;
      facet_table[row][column][0] = static_cast<float>(std::max(integrate(cosine_of(u, alpha), alpha).deficit, 0.0));
      // At normal incidence hardly anything depends on the shift, in the rest of the last cell much does: extrapolate.
      facet_table[row][column][1] =
          static_cast<float>(column < kColumns - 1 ? shift_at(u) : 2 * shift_at(1 - cell / 2) - shift_at(1 - cell));
    }
  }

  std::fprintf(out, "// Written by make_albedo_tables.\nconst float kFacets[kRows][kColumns][2] = {\n");
  for (const auto& row : facet_table) {
    std::fprintf(out, "{");
    for (const auto& value : row)
      std::fprintf(out, "{%.9gf,%.9gf},", static_cast<double>(value[0]), static_cast<double>(value[1]));
    std::fprintf(out, "},\n");
  }

  // Averages of what look-ups return, not of the true function: what several bounces add is then exactly what is missing.
  std::fprintf(out, "};\nconst float kAverage[kAverages][2] = {\n");
  for (int row = 0; row < kAverages; row++) {
    const double roughness = roughness_of(row, kAverages), alpha = roughness * roughness;
    const Row at(static_cast<float>(roughness));
    // Integrate 2 mu dmu over v with mu = alpha (exp(v log(1 + 1 / alpha)) - 1): as much happens around alpha as around 1.
    constexpr int kPoints = 1024;
    const double scale = std::log(1 + 1 / alpha);
    Albedo sum{0, 0};
    for (int k = 0; k < kPoints; k++) {
      const double growth = std::exp(scale * (k + 0.5) / kPoints), mu = alpha * (growth - 1);
      const double weight = 2 * mu * alpha * growth * scale / kPoints;
      const ln::FacetAlbedo a =
          facets(facet_table[at.row], facet_table[at.row + 1], at.fraction, static_cast<float>(alpha), static_cast<float>(mu));
      sum.deficit += weight * a.deficit;
      sum.schlick += weight * a.schlick;
    }
    std::fprintf(out, "{%.9gf,%.9gf},\n", sum.deficit / (alpha * alpha), sum.schlick);
  }
  std::fprintf(out, "};\n");
  if (std::fclose(out) != 0) return std::perror(argv[1]), 1;
  return 0;
}
