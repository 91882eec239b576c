#pragma once
// A probe: irradiance of a wire at sensors.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ln/film.hpp"
#include "ln/options.hpp"
#include "ln/prepare.hpp"
#include "ln/program.hpp"
#include "ln/receiver.hpp"
#include "ln/render_passes.hpp"
#include "ln/sensors.hpp"

namespace ln {

/// Sensors with what was measured there. One that lies on a surface, as far as rounding lets us tell (kReach), and whose normal
/// agrees with the surface's, measures on that surface and has its tags; others measure in free space.
class Probe {
 public:
  /// How far a sensor may lie off a surface to be on it, in normalised units.
  static constexpr float kReach = 1e-4f;
  /// Least |cos| between the normals of a sensor and of the surface that it is on.
  static constexpr float kMinCos = 0.9f;

  /// Reads the sensors. Throws Error.
  explicit Probe(const ProbeInfo& info);

  int size() const { return static_cast<int>(file_.sensors.size()); }

  /// Finds the surfaces that the sensors are on. Throws Error if the wire is known on surfaces only and a sensor is on none.
  void place(Tracer& tracer);

  /// Adds the sensors that are on surfaces.
  void add_places(const Scene& scene, std::vector<MeasuredPlace>& places) const {
    for (const Place& place : places_)
      if (place.hit.found())
        places.push_back({place.hit, Interaction(scene, place.hit, place.position, place.normal, white_receiver()).front});
  }

  /// Adds the tile's samples of its sensors, which are the pixels of a picture of one row. The film is kept for
  /// render_passes, which estimates errors and counts samples with it.
  template <class Wire>
  void measure(const Tile& tile, Tracer& tracer, std::uint32_t seed_hash, const Wire& wire, Film& film) {
    for (int i = tile.x0; i < tile.x1 && !tile.stopped(); ++i) {
      const Place& place = places_[static_cast<std::size_t>(i)];
      Sum& sum = sums_[static_cast<std::size_t>(i)];
      const Interaction at(tracer.scene(), place.hit, place.position, place.normal, white_receiver());
      for (std::uint32_t set = 0; set < kSets; ++set) {
        const auto share = [set](std::uint32_t samples) { return (samples + kSets - 1 - set) / kSets; };
        const std::uint32_t key = hash32(hash32(static_cast<std::uint32_t>(i), kFirstKey + set), seed_hash);
        for_samples(key, share(tile.first_sample), share(tile.first_sample + tile.sample_count), tracer,
                    [&](const SampleStream& random) {
                      const Color irradiance = sample_irradiance(tracer, random, at, wire);
                      sum.add(set, irradiance);
                      film.add(i, 0, random.index() * kSets + set, irradiance);
                    });
      }
    }
    tracer.enter(Tracer::kIdle);
  }

  /// Writes the sensors with their results.
  void write(Units units) const;

 private:
  /// Samples are dealt out to sets of their own random numbers; the differences between sets tell the error.
  static constexpr std::uint32_t kSets = 16;
  static constexpr std::uint32_t kFirstKey = 0x5e4505;

  struct Place {
    Vec3 position{0}, normal{0, 0, 1};
    Hit hit;  // not found: in free space
  };

  struct Sum {
    std::array<double, 3> irradiance{};
    std::array<double, kSets> luminance{};  // of each set
    std::uint32_t samples = 0, broken = 0;

    void add(std::uint32_t set, const Color& value) {
      ++samples;
      if (!is_finite(value)) {
        ++broken;
        return;
      }
      for (int c = 0; c < 3; ++c)
        irradiance[static_cast<std::size_t>(c)] += static_cast<double>(value[static_cast<std::size_t>(c)]);
      luminance[set] += static_cast<double>(ln::luminance(value));
    }

    double standard_error() const;
  };

  const ProbeInfo& info_;
  SensorFile file_;
  std::vector<Place> places_;
  std::vector<Sum> sums_;
};

}  // namespace ln
