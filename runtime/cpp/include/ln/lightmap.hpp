#pragma once
// A lightmap: irradiance of a wire, baked onto the surfaces of the scene as a texture.
//
// Each face of the scene's patches (fronts, and backs of double-sided materials) has a chart: a rectangle of texels in one
// square atlas. The centres of its outermost texels are the borders of the patch, so that bilinear look-ups never leave the
// chart. A texel holds the mean irradiance around its centre, half-way to its neighbours.

#include <vector>

#include "ln/film.hpp"
#include "ln/parallel.hpp"
#include "ln/patches.hpp"
#include "ln/prepare.hpp"
#include "ln/program.hpp"
#include "ln/receiver.hpp"
#include "ln/render_passes.hpp"

namespace ln {

class Lightmap {
 public:
  explicit Lightmap(const LightmapInfo& info) : info_(info) {}

  /// Lays out the charts in an atlas of `side` x `side` texels, or more where the patches are too many for it.
  void lay_out(const SceneData& data, int side);

  int side() const { return side_; }

  /// Adds a place in each texel, evenly thinned out where they are more than `most`.
  void add_places(std::size_t most, std::vector<MeasuredPlace>& places) const {
    constexpr float kInside = 0.25f;  // of the texel: centres lie on the borders of patches, where rays may pass between walls
    const std::size_t step = 1 + texels_.size() / most;
    for (std::size_t i = 0; i < texels_.size(); i += step) {
      if (texels_[i] == kNone) continue;
      const Chart& chart = charts_[texels_[i]];
      const auto width = static_cast<std::size_t>(side_);
      places.push_back(
          {hit(chart, static_cast<int>(i % width), static_cast<int>(i / width), Vec2(kInside)), Patches::is_front(chart.face)});
    }
  }

  /// Adds the tile's samples of its texels.
  template <class Wire>
  void measure(const Tile& tile, Tracer& tracer, std::uint32_t seed_hash, const Wire& wire, Film& film) const {
    const std::uint32_t end = tile.first_sample + tile.sample_count;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1 && !tile.stopped(); ++x) {
        const std::uint32_t number = chart_at(x, y);
        const std::uint32_t key =
            hash32(hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) + kFirstKey, seed_hash);
        for_samples(key, tile.first_sample, end, tracer, [&](const SampleStream& random) {
          film.add(x, y, random.index(), number == kNone ? Color(0) : sample(charts_[number], x, y, tracer, random, wire));
        });
      }
    }
    tracer.enter(Tracer::kIdle);
  }

  /// Writes the surfaces with their texture, and the irradiance itself as an OpenEXR file beside them. Throws Error.
  void write(const Film& film, const char* network, const SceneData& data) const;

 private:
  static constexpr std::uint32_t kNone = Patches::kNone;
  static constexpr std::uint32_t kFirstKey = 0x11647;

  struct Chart {
    std::uint32_t face;
    int x = 0, y = 0, width = 2, height = 2;  // texels: its columns are s, its rows t
  };

  std::uint32_t chart_at(int x, int y) const {
    return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(x)];
  }

  /// A point of [0,1] around texel `i` of `n`, evenly distributed half-way to its neighbours; only inwards at the ends.
  static float around(int i, int n, float random) {
    const float s = std::abs(static_cast<float>(i) + random - 0.5f) / static_cast<float>(n - 1);
    return s > 1 ? 2 - s : s;
  }

  template <class Wire>
  LN_INLINE Color sample(const Chart& chart, int x, int y, Tracer& tracer, const SampleStream& random, const Wire& wire) const {
    return sample_irradiance(tracer, random, hit(chart, x, y, random.get2(0, kOwn)), Patches::is_front(chart.face), wire);
  }

  /// The point of a texel that `u` of the unit square chooses.
  Hit hit(const Chart& chart, int x, int y, const Vec2& u) const {
    Vec2 st(around(x - chart.x, chart.width, u.x), around(y - chart.y, chart.height, u.y));
    const std::uint32_t patch = chart.face / 2;
    if (!patches_.quad(patch) && st.x + st.y > 1) st /= (st.x + st.y) * (1 + 0x1p-20f);  // beyond the edge: the nearest of it
    return patches_.hit(patch, st);
  }

  bool pack();

  const LightmapInfo& info_;
  Patches patches_;
  std::vector<Chart> charts_;
  std::vector<std::uint32_t> texels_;  // the chart of each
  int side_ = 0;
};

/// The picture that holds the irradiance of the lightmap `file`: the same name with the suffix .exr.
std::string atlas_file(const std::string& file);

}  // namespace ln
