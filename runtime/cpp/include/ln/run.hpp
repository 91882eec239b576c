#pragma once
// From a network to a program: what `main` of a generated file calls.
//
// A Network is a struct with
//   void prepare(PrepareStep& step)              work before the picture: step(node id, [&](PrepareContext&) { ... }) each
//   Color image(Request&) const                  what the eye gets from a surface point; a template
//   static constexpr Events scene_events         what surfaces may scatter by, in every scene that the program accepts
//   static constexpr int emitters_layer          the layer that shows the emitters that are seen; -1: none does
//   static constexpr bool shows_emitters         is what is seen of the emitters part of the picture?
//   void write_taps(Write&& write) const         write(i, what is stored) for each TapInfo; a template
//   auto measured() const                        what evaluates the wires of all probes, then of all lightmaps: a tuple
//   void wires(Visit&&) const                    visit(WireInfo, what the wire carries) for each wire but emission (verify.hpp)

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <thread>
#include <tuple>
#include <vector>

#include "ln/cache.hpp"
#include "ln/camera.hpp"
#include "ln/film.hpp"
#include "ln/lightmap.hpp"
#include "ln/operator.hpp"
#include "ln/prepare.hpp"
#include "ln/probe.hpp"
#include "ln/program.hpp"
#include "ln/render_passes.hpp"
#include "ln/request.hpp"
#include "ln/tap.hpp"
#include "ln/verify.hpp"

namespace ln {

/// Node 0 of every network: the picture itself. It casts camera rays.
inline constexpr NodeId kEye = 0;

/// What a program knows about the making of a wire that is kept.
struct CacheOrigin {
  const char* network;                       // stands for the part of the network that leads to it
  const char* code;                          // for the sources that do the work
  std::vector<std::string_view> parameters;  // NODE.PARAMETER: those that count, as they are now
  bool for_view;                             // it depends on what results look at
};

/// Runs and times the preparation of one node after the other.
class PrepareStep {
 public:
  /// `environment`: what lights the scene from outside, or null. `caches`: may files from earlier runs be used and written?
  PrepareStep(PrepareContext& context, RunContext& run, std::vector<double>& seconds, const Image* environment,
              bool caches = true)
      : context_(context), run_(run), seconds_(seconds), environment_(environment), caches_(caches) {}

  /// Lets a cache look whether it has its wire from an earlier run; one without a file has not. Throws Error if another cache
  /// has the same file.
  template <class Cache>
  void open(Cache& cache, const CacheOrigin& origin) {
    if (!caches_ || cache.file.empty()) return;
    claim(cache.file, cache.node);
    cache.open(context_, cache_key(origin));
  }

  void operator()(NodeId node, FunctionRef<void(PrepareContext&)> work);

 private:
  void claim(const std::string& file, NodeId cache);
  CacheKey cache_key(const CacheOrigin& origin);

  PrepareContext& context_;
  RunContext& run_;
  std::vector<double>& seconds_;
  const Image* environment_;
  bool caches_;
  std::optional<Fingerprint> scene_, looked_at_;
  std::map<std::filesystem::path, NodeId> files_;  // of caches
};

/// Watches, from a thread of its own, which node each tracer is at, and so shares out the time of the picture.
class NodeSampler {
 public:
  NodeSampler(const std::vector<Tracer>& tracers, std::size_t node_count);
  ~NodeSampler();

  /// Ends the watch. The share of the busy time that each node has had, without the nodes that it asked.
  std::vector<double> shares();

 private:
  std::vector<std::uint64_t> seen_;  // by node
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// Everything of a run that needs no knowledge of the network's type.
class NetworkRun : public RunCallbacks {
 public:
  NetworkRun(const ProgramInfo& program, std::span<const TagRule> tags) : program_(program), tags_(tags) {}

  PictureSize load(RunContext& context) override;
  void build(RunContext& context) override;
  void prepare(RunContext& context) override;
  RenderOutcome measure(RunContext& context, const RenderLimits& limits) override;
  bool verify(RunContext& context) override;
  void finish(RunContext& context, const Film* film) override;
  void collect(Stats& stats) override;

 protected:
  virtual void prepare_network(PrepareStep& step) = 0;
  virtual void write_taps() {}
  /// Samples of probe `number`, or of lightmap `number` less the number of probes.
  virtual void measure_tile(std::size_t /*number*/, const Tile&, Film&) {}
  /// After prepare_network: every wire.
  virtual void measure_wires(Verification&) { throw UsageError("--verify-paths: this program has no wires"); }

  const Scene& scene() const { return *scene_; }
  const CameraRays& camera() const { return camera_; }
  PictureSize size() const { return size_; }
  std::vector<Probe>& probes() { return probes_; }
  std::vector<Lightmap>& lightmaps() { return lightmaps_; }
  TapFile tap_file(std::size_t i) const { return {program_.network, program_.taps[i], scene().data()}; }
  Tracer& tracer(int worker) { return tracers_[static_cast<std::size_t>(worker)]; }
  std::uint32_t seed_hash() const { return seed_hash_; }

 private:
  void write_pictures(const Film& film) const;
  /// Places on surfaces at which probes and lightmaps measure; of a large lightmap a part.
  std::vector<MeasuredPlace> measured_places() const;
  /// Finds the operators that carry no light in this scene, says so, and has the network leave them out. Throws Error if the
  /// program was compiled for a scene that has less. Where it `verifies`, nothing is left out.
  void skip_dark_nodes(bool verifies);

  const ProgramInfo& program_;
  std::span<const TagRule> tags_;
  SceneData data_;  // moved into the scene by `build`
  Image environment_;
  bool has_environment_ = false;
  Camera chosen_camera_;
  PictureSize size_;
  std::string scene_file_;
  CameraRays camera_;
  std::unique_ptr<Scene> scene_;
  std::optional<PrepareContext> prepare_context_;
  std::vector<double> prepare_seconds_;
  std::vector<std::optional<std::string>> skipped_;  // by node: why
  std::vector<Tracer> tracers_;
  std::vector<Probe> probes_;
  std::vector<Lightmap> lightmaps_;
  std::optional<NodeSampler> sampler_;
  std::uint32_t seed_hash_ = 0;
};

/// Radiance that arrives at the eye along `ray`: follows specular surfaces (S*), adds the emitters that are seen (L S* E)
/// and asks the network at every surface on the way.
template <class Network>
LN_INLINE Color eye_radiance(const Network& network, Tracer& tracer, Ray ray, const SampleStream& random) {
  const Scene& scene = tracer.scene();
  Color result(0), beta(1);
  const auto add_emitter = [&](const Color& light) {
    if constexpr (Network::shows_emitters) result += light;
    if constexpr (Network::emitters_layer >= 0) tracer.layers()[Network::emitters_layer] += light;
  };
  for (std::uint32_t depth = 0;; ++depth) {
    const Hit hit = tracer.intersect(ray, random.bits(depth, kCoverage + 1), kEye, RayKind::camera);
    if (!hit.found()) {
      add_emitter(beta * scene.emitters().environment(ray.direction));
      return result;
    }
    const Interaction at(scene, ray, hit);
    beta *= at.transmittance;
    add_emitter(beta * scene.emitters().radiance(hit, at.wo));

    constexpr Events kScene = Network::scene_events;
    Request<Events::DG & kScene, kScene, kScene> request(tracer, random, at, beta, depth + 1, RayKind::camera);
    if (any(at.bsdf().events() & Events::DG & kScene)) result += beta * network.image(request);

    // Follow a specular direction, if the point's sample is one.
    if (!any(at.bsdf().events() & Events::S & kScene)) return result;
    const BsdfRay* sample = request.sample();
    if (!sample || sample->event != Events::S) return result;
    beta *= sample->weight;
    ray = sample->ray;
    constexpr std::uint32_t kRouletteDepth = 16;
    if (depth >= kRouletteDepth) {
      const float survival = std::min(max_component(beta), 0.95f);
      if (random.get1(depth + 1, kRoulette) >= survival) return result;
      beta /= survival;
    }
  }
}

template <class Network>
class NetworkProgram final : public NetworkRun {
 public:
  NetworkProgram(const ProgramInfo& program, std::span<const TagRule> tags, Network& network)
      : NetworkRun(program, tags), network_(network), layer_count_(program.layers.size()) {}

  void render_tile(const Tile& tile, Film& film) override {
    Tracer& tracer = this->tracer(tile.worker);
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        if (tile.stopped()) break;
        const std::uint32_t key = hash32(hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)), seed_hash());
        for_samples(key, tile.first_sample, tile.first_sample + tile.sample_count, tracer,
                    [&](const SampleStream& random) { render_sample(x, y, random, tracer, film); });
      }
    }
    tracer.enter(Tracer::kIdle);
  }

 protected:
  void prepare_network(PrepareStep& step) override { network_.prepare(step); }

  void write_taps() override {
    network_.write_taps([&](std::size_t i, const auto& stored) { write_tap(tap_file(i), stored); });
  }

  void measure_tile(std::size_t number, const Tile& tile, Film& film) override {
    Tracer& tracer = this->tracer(tile.worker);
    std::size_t i = 0;
    const auto measure = [&](const auto& wire) {
      if (i++ != number) return;
      const std::size_t probes = this->probes().size();
      if (number < probes)
        this->probes()[number].measure(tile, tracer, seed_hash(), wire, film);
      else
        this->lightmaps()[number - probes].measure(tile, tracer, seed_hash(), wire, film);
    };
    std::apply([&](const auto&... wire) { (measure(wire), ...); }, network_.measured());
  }

  void measure_wires(Verification& verification) override {
    network_.wires([&](const WireInfo& wire, const auto& carried) { verification.measure(wire, carried); });
  }

 private:
  void render_sample(int x, int y, const SampleStream& random, Tracer& tracer, Film& film) {
    const std::uint32_t sample = random.index();
    tracer.enter(kEye);
    const Vec2 pixel = Vec2(static_cast<float>(x), static_cast<float>(y)) + random.get2(0, kPixel);
    film.add(x, y, sample, eye_radiance(network_, tracer, camera().ray(pixel), random));
    for (std::size_t layer = 0; layer < layer_count_; ++layer) {
      film.add_layer(static_cast<int>(layer), x, y, tracer.layers()[layer]);
      tracer.layers()[layer] = Color(0);
    }
  }

  static constexpr std::uint32_t kPixel = kOwn;  // of vertex 0, the eye

  Network& network_;
  std::size_t layer_count_;
};

/// The program of a network: from the command line to the exit status.
template <class Network>
int run(int argc, char** argv, const ProgramInfo& program, std::span<const TagRule> tags, Network& network) {
  NetworkProgram<Network> run(program, tags, network);
  return run_program(argc, argv, program, run);
}

}  // namespace ln
