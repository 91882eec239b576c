#include "ln/probe.hpp"

#include <charconv>
#include <cmath>

#include "ln/error.hpp"
#include "ln/output_file.hpp"
#include "ln/progress.hpp"
#include "ln/text.hpp"

namespace ln {

namespace {

constexpr double kLumensPerWatt = 683;  // so much luminous flux has a watt of luminance 1

std::string value_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, static_cast<float>(value)).ptr};
}

/// The surface that a sensor is on: the nearest one along its normal, within Probe::kReach.
Hit surface_at(Tracer& tracer, const Vec3& position, const Vec3& normal) {
  constexpr int kMost = 16;  // surfaces that lie on each other
  Ray ray{position + Probe::kReach * normal, -normal, 2 * Probe::kReach};
  Hit nearest;
  float least = kInfinity;
  for (int i = 0; i < kMost && ray.tmax > 0; ++i) {
    const Hit hit = tracer.intersect(ray, 0, 0, RayKind::gather);
    if (!hit.found()) break;
    SurfacePosition at;
    tracer.scene().locate(hit, at);
    const float distance = glm::distance(at.p, position);
    if (std::abs(glm::dot(at.ng, normal)) >= Probe::kMinCos && distance < least) {
      least = distance;
      nearest = hit;
    }
    const float step = hit.t + 2 * at.error;
    ray.origin += step * ray.direction;
    ray.tmax -= step;
  }
  return nearest;
}

}  // namespace

Probe::Probe(const ProbeInfo& info) : info_(info), file_(read_sensors(info.sensors)) {
  constexpr std::size_t kMost = std::size_t{1} << 28;
  if (file_.sensors.size() > kMost)
    throw Error(printable(file_.path) + ": holds more sensors than the 268 million that a probe may have");
}

void Probe::place(Tracer& tracer) {
  const SceneData& data = tracer.scene().data();
  std::size_t free = 0, first_free = 0;
  places_.reserve(file_.sensors.size());
  for (const Sensor& sensor : file_.sensors) {
    const Vec3 position((sensor.position - data.origin) / data.unit);
    if (!within_reach(position))
      throw Error(printable(file_.path) + ":" + std::to_string(sensor.line) + ": this sensor is too far away from the scene");
    places_.push_back({position, sensor.normal, surface_at(tracer, position, sensor.normal)});
    if (places_.back().hit.found()) continue;
    if (free++ == 0) first_free = sensor.line;
  }
  sums_.resize(places_.size());
  if (free == 0 || !info_.on_surfaces) return;
  throw Error(printable(file_.path) + ":" + std::to_string(first_free) + ": this sensor is on no surface, but '" + info_.wire +
              "' is known on surfaces only" + (free > 1 ? " (so are " + std::to_string(free - 1) + " more)" : "") +
              ": move it to within " + number_text(static_cast<double>(kReach) * data.unit) +
              " of a surface that faces the same way, or probe PathTracer(...) and direct light, which are known everywhere");
}

// With m_s the mean of the n_s samples of set s, m that of all N, and S sets, sum n_s (m_s - m)^2 / (S - 1) is N times the
// variance of m, if the variance of m_s falls as 1 / n_s.
double Probe::Sum::standard_error() const {
  double total = 0;
  for (const double sum : luminance) total += sum;
  const double mean = total / samples;
  double squares = 0;
  std::uint32_t sets = 0;
  for (std::uint32_t set = 0; set < kSets; ++set) {
    const std::uint32_t count = (samples + kSets - 1 - set) / kSets;
    if (count == 0) continue;
    squares += count * (luminance[set] / count - mean) * (luminance[set] / count - mean);
    ++sets;
  }
  return sets > 1 ? std::sqrt(squares / (sets - 1) / samples) : std::numeric_limits<double>::quiet_NaN();
}

void Probe::write(Units units) const {
  const double factor = units == Units::photometric ? 1 : kLumensPerWatt;
  OutputFile out(info_.file);
  std::string line = file_.header;
  for (const char* column : kResultColumns) line += std::string(",") + column;
  out.write(line + "\n");
  std::uint64_t broken = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const Sum& sum = sums_[i];
    const double n = sum.samples;
    const double mean[3] = {sum.irradiance[0] / n, sum.irradiance[1] / n, sum.irradiance[2] / n};
    const double illuminance = factor * (0.2126 * mean[0] + 0.7152 * mean[1] + 0.0722 * mean[2]);
    line = file_.sensors[i].row;
    for (const double value : {mean[0], mean[1], mean[2], illuminance, factor * sum.standard_error()})
      line += "," + value_text(value);
    out.write(line + "\n");
    broken += sum.broken;
  }
  out.commit();
  if (broken > 0)
    warning(std::string(info_.file) + ": " + std::to_string(broken) +
            " samples were not finite; they count as black. This is a fault of an operator or of the scene's values");
}

}  // namespace ln
