#include "ln/run.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <numeric>

#include "ln/exr_film.hpp"
#include "ln/gltf.hpp"
#include "ln/image_reader.hpp"
#include "ln/progress.hpp"
#include "ln/stats.hpp"
#include "ln/text.hpp"
#include "ln/texture.hpp"

namespace ln {

namespace {

/// A camera that frames the whole scene, which normalised coordinates put into the unit ball around the origin.
Camera framing_camera() {
  Camera camera;
  camera.name = "default";
  camera.yfov = 0.7f;
  const Vec3 towards = glm::normalize(Vec3(0.5f, 0.35f, 1.0f));
  camera.position = towards * (1.0f / std::sin(0.5f * camera.yfov));
  camera.forward = -towards;
  camera.right = glm::normalize(glm::cross(camera.forward, Vec3(0, 1, 0)));
  camera.up = glm::cross(camera.right, camera.forward);
  return camera;
}

Camera choose_camera(const SceneData& data, const std::string& wanted) {
  std::string names;
  for (const Camera& camera : data.cameras) {
    if (wanted.empty() || camera.name == wanted || camera.node == wanted) return camera;
    names += (names.empty() ? "" : ", ") + printable(camera.node.empty() ? camera.name : camera.node);
  }
  if (!wanted.empty())
    throw Error("--camera: the scene has no camera '" + printable(wanted) + "'" +
                (names.empty() ? "; it has none at all" : "; it has: " + names));
  note("the scene has no camera: using one that frames it");
  return framing_camera();
}

bool has_emitter(const SceneData& data) {
  if (!data.lights.empty()) return true;
  for (const Part& part : data.parts) {
    const Material& m = data.materials[part.material];
    if (part.triangle_count == 0 || !m.emits()) continue;
    if (!m.emissive_texture || max_component(m.emission * Color(color_range(data.images[m.emissive_texture.image]).high)) > 0)
      return true;
  }
  return false;
}

/// The light of a scene without any: a clear sky over grey ground, with a soft sun at the upper right of the default view.
/// Rows of a lat-long picture as Environment has it; radiance in W/(m^2 sr).
Image default_sky() {
  constexpr Color kZenith(0.35f, 0.5f, 0.9f), kHorizon(0.85f, 0.9f, 1.0f), kGround(0.25f, 0.23f, 0.2f), kSun(6.0f, 5.5f, 4.6f);
  constexpr float kSunWidth = 0.35f;  // [rad]
  const Vec3 sun = glm::normalize(Vec3(0.6f, 0.8f, 0.5f));
  Image image;
  image.width = 128;
  image.height = 64;
  image.channels = 3;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float theta = kPi * (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height);
      const float phi = kPi * (1 - 2 * (static_cast<float>(x) + 0.5f) / static_cast<float>(image.width));
      const Vec3 w(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
      Color c = w.y > 0 ? glm::mix(kHorizon, kZenith, std::sqrt(w.y)) : kGround;
      const float angle = std::acos(std::min(1.0f, glm::dot(w, sun)));
      c += kSun * std::exp(-sqr(angle / kSunWidth));
      image.floats.insert(image.floats.end(), {c.x, c.y, c.z});
    }
  }
  return image;
}

}  // namespace

void PrepareStep::operator()(NodeId node, FunctionRef<void(PrepareContext&)> work) {
  run_.progress.phase("prepare", run_.program.nodes[node].name);
  const Stopwatch watch;
  work(context_);
  seconds_[node] += watch.seconds();
}

void PrepareStep::claim(const std::string& file, NodeId cache) {
  std::error_code ignored;
  const auto [place, is_new] =
      files_.emplace(std::filesystem::weakly_canonical(std::filesystem::absolute(file, ignored), ignored), cache);
  if (is_new) return;
  const std::string one = run_.program.nodes[place->second].name, other = run_.program.nodes[cache].name;
  throw Error(printable(file) + ": '" + one + "' and '" + other +
              "' are to be kept in this one file: give one of them another by --set " + other + ".file=NAME");
}

CacheKey PrepareStep::cache_key(const CacheOrigin& origin) {
  if (!scene_) scene_ = fingerprint(context_.scene().data(), environment_);
  CacheKey key{*scene_, {}, {}, {}, context_.seed()};
  if (origin.for_view) {
    if (!looked_at_) looked_at_ = fingerprint(context_.view());
    key.view = *looked_at_;
  }
  key.network.add(std::string_view(origin.network));
  key.code.add(std::string_view(origin.code));
  for (const ParameterSlot& slot : run_.program.parameters) {
    const std::string name = std::string(slot.node) + "." + slot.name;
    if (std::find(origin.parameters.begin(), origin.parameters.end(), name) != origin.parameters.end())
      key.network.add(name + "=" + parameter_text(slot));
  }
  return key;
}

NodeSampler::NodeSampler(const std::vector<Tracer>& tracers, std::size_t node_count) : seen_(node_count) {
  thread_ = std::thread([this, &tracers] {
    while (!stop_.load(std::memory_order_relaxed)) {
      for (const Tracer& tracer : tracers)
        if (const NodeId node = tracer.present_node(); node < seen_.size()) ++seen_[node];
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  });
}

NodeSampler::~NodeSampler() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::vector<double> NodeSampler::shares() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  const double all = std::accumulate(seen_.begin(), seen_.end(), 0.0);
  std::vector<double> shares(seen_.size());
  for (std::size_t i = 0; i < seen_.size() && all > 0; ++i) shares[i] = static_cast<double>(seen_[i]) / all;
  return shares;
}

PictureSize NetworkRun::load(RunContext& context) {
  const Options& options = context.options;
  scene_file_ = options.scene;
  data_ = load_gltf(options.scene);
  for (const std::string& text : data_.notes) note(text);
  if (!options.environment_path.empty()) {
    environment_ = read_image_file(options.environment_path);
    has_environment_ = true;
  } else if (!has_emitter(data_)) {
    note("the scene has no light: using a clear sky with a soft sun");
    environment_ = default_sky();
    has_environment_ = true;
  }
  if (options.print_letters) {
    const Scene scene(std::move(data_), tags_, context.workers.count(), has_environment_ ? &environment_ : nullptr);
    throw HelpRequest{letters_text(letters_of(scene, program_.path_tags))};
  }
  for (const ProbeInfo& info : program_.probes) probes_.emplace_back(info);
  for (const LightmapInfo& info : program_.lightmaps) lightmaps_.emplace_back(info);
  if (!program_.uses_camera()) return {};
  chosen_camera_ = choose_camera(data_, options.camera);
  size_ = picture_size(options, chosen_camera_.aspect);
  camera_ = CameraRays(chosen_camera_, size_.width, size_.height);
  return size_;
}

void NetworkRun::build(RunContext& context) {
  scene_ =
      std::make_unique<Scene>(std::move(data_), tags_, context.workers.count(), has_environment_ ? &environment_ : nullptr);
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    const int tag = tags_[i].tag;
    const bool first = i == 0 || tags_[i - 1].tag != tag;
    if (first && scene_->tag_matches(tag) == 0)
      warning("LN0501: tag " + std::string(tags_[i].name) + " matches nothing in this scene");
  }
  skip_dark_nodes(context.options.verify_paths);
  seed_hash_ = hash32(static_cast<std::uint32_t>(context.options.seed), static_cast<std::uint32_t>(context.options.seed >> 32));
  prepare_seconds_.assign(program_.nodes.size(), 0);
  for (int i = 0; i < context.workers.count(); ++i)
    tracers_.emplace_back(*scene_, program_.nodes.size(), program_.layers.size());
  for (Probe& probe : probes_) probe.place(tracer(0));
  for (Lightmap& lightmap : lightmaps_) lightmap.lay_out(scene_->data(), context.options.lightmap_side);
  const View view{camera_, size_.width, size_.height, [this] { return measured_places(); }};
  prepare_context_.emplace(*scene_, context.workers, context.options.seed, program_.nodes.size(), view);
}

std::vector<MeasuredPlace> NetworkRun::measured_places() const {
  constexpr std::size_t kMostTexels = 1 << 17;  // of a lightmap
  std::vector<MeasuredPlace> places;
  for (const Probe& probe : probes_) probe.add_places(*scene_, places);
  for (const Lightmap& lightmap : lightmaps_) lightmap.add_places(kMostTexels, places);
  return places;
}

void NetworkRun::skip_dark_nodes(bool verifies) {
  skipped_.resize(program_.nodes.size());
  if (program_.skip_rules.empty() && !program_.compiled_for) return;
  const LetterSet letters = letters_of(*scene_, program_.path_tags);
  for (const LetterNeed& absent : program_.absent) {
    if (!absent.letters.meets(letters)) continue;
    throw Error(scene_file_ + ": has a " + absent.noun + "; this program was compiled for " + program_.compiled_for +
                ", which has none: compile it for this scene, or without --scene");
  }
  if (verifies) return;  // also light that reaches no result
  for (const SkipRule& rule : program_.skip_rules) {
    std::optional<std::string>& reason = skipped_[rule.node] = skip_reason(rule, letters);
    if (rule.skipped) *rule.skipped = reason.has_value();
    if (reason) note_skipped(program_.nodes[rule.node].name, *reason);
  }
}

void NetworkRun::prepare(RunContext& context) {
  PrepareStep step(*prepare_context_, context, prepare_seconds_, has_environment_ ? &environment_ : nullptr);
  prepare_network(step);
  sampler_.emplace(tracers_, program_.nodes.size());
}

RenderOutcome NetworkRun::measure(RunContext& context, const RenderLimits& limits) {
  const std::size_t count = probes_.size() + lightmaps_.size();
  RenderOutcome all;
  for (std::size_t i = 0; i < count && !all.interrupted; ++i) {
    const bool is_probe = i < probes_.size();
    const std::size_t map = i - probes_.size();
    context.progress.phase("render", is_probe ? program_.probes[i].file : program_.lightmaps[map].file);
    RenderLimits own = limits;
    if (is_probe && context.options.default_samples) own.samples = kDefaultProbeSamples;
    // What follows gets its share of the time.
    if (own.seconds)
      *own.seconds = (*own.seconds - all.seconds) / static_cast<double>(count - i + (program_.uses_camera() ? 1 : 0));
    Film film(is_probe ? probes_[i].size() : lightmaps_[map].side(), is_probe ? 1 : lightmaps_[map].side(), 0,
              program_.subtracts ? Film::Samples::signed_values : Film::Samples::positive);
    const RenderOutcome outcome = render_passes(film, own, context.workers, context.progress,
                                                [&](const Tile& tile, Film& target) { measure_tile(i, tile, target); });
    if (outcome.samples == 0) throw Interrupted{};
    if (is_probe)
      probes_[i].write(context.options.units);
    else
      lightmaps_[map].write(film, program_.network, scene_->data());
    const double seconds = all.seconds + outcome.seconds;
    all = outcome;
    all.seconds = seconds;
  }
  return all;
}

bool NetworkRun::verify(RunContext& context) {
  const Options& options = context.options;
  Verification verification(*scene_, program_, tags_,
                            options.default_samples ? Verification::kDefaultSamples : *options.samples);
  for (std::uint32_t batch = 0; batch < Verification::kBatches; ++batch) {
    PrepareContext prepare(*scene_, context.workers, options.seed * Verification::kBatches + batch, program_.nodes.size(),
                           View{camera_, size_.width, size_.height});
    std::optional<NotesOff> quiet;
    if (batch > 0) quiet.emplace();
    PrepareStep step(prepare, context, prepare_seconds_, nullptr, false);
    prepare_network(step);
    context.progress.phase("verify");
    verification.begin_batch(prepare);
    measure_wires(verification);
    verification.end_batch();
  }
  const VerificationReport report = verification.report();
  context.progress.finish(report.deviating_wires == 0
                              ? "every wire carries the light of its paths"
                              : std::to_string(report.deviating_wires) + " wires deviate from their light paths");
  std::fputs(report.table.c_str(), stdout);
  if (std::fflush(stdout) != 0) throw Error("the table cannot be written");
  return report.deviating_wires == 0;
}

void NetworkRun::finish(RunContext&, const Film* film) {
  write_taps();
  if (film) write_pictures(*film);
}

void NetworkRun::write_pictures(const Film& film) const {
  for (std::size_t i = 0; i < program_.layers.size(); ++i) {
    const LayerInfo& layer = program_.layers[i];
    if (!layer.file) continue;
    std::vector<float> rgb;
    rgb.reserve(static_cast<std::size_t>(film.width()) * static_cast<std::size_t>(film.height()) * 3);
    for (int y = 0; y < film.height(); ++y) {
      for (int x = 0; x < film.width(); ++x) {
        const Color c = layer.is_signed ? film.signed_mean(x, y, static_cast<int>(i)) : film.mean(x, y, static_cast<int>(i));
        rgb.insert(rgb.end(), {c.x, c.y, c.z});
      }
    }
    write_exr(layer.file, film.width(), film.height(), rgb.data(),
              {{"network", program_.network}, {"lightPaths", layer.light_paths}}, layer.is_signed);
  }
}

void NetworkRun::collect(Stats& stats) {
  std::vector<NodeCost> costs(program_.nodes.size());
  const auto add = [&](const std::vector<Tracer>& tracers) {
    for (const Tracer& tracer : tracers)
      for (std::size_t i = 0; i < costs.size(); ++i) costs[i] += tracer.costs()[i];
  };
  if (prepare_context_) add(prepare_context_->tracers());
  add(tracers_);

  const std::vector<double> shares = sampler_ ? sampler_->shares() : std::vector<double>(costs.size());
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const auto& rays = costs[i].rays;
    RayCounts sum{rays[0], rays[1], rays[2], rays[3], rays[0] + rays[1] + rays[2] + rays[3]};
    stats.rays += sum;
    NodeStats node;
    node.name = program_.nodes[i].name;
    node.op = program_.nodes[i].op;
    node.rays = sum.total;
    if (!skipped_.empty()) node.skipped = skipped_[i];
    node.seconds = (prepare_seconds_.empty() ? 0 : prepare_seconds_[i]) + shares[i] * stats.seconds.render;
    stats.nodes.push_back(std::move(node));
  }
  stats.scene_file = scene_file_;
  if (!scene_) return;
  const SceneData& data = scene_->data();
  stats.scene_counts = {{"triangles", data.triangles.size()}, {"vertices", data.positions.size()},
                        {"parts", data.parts.size()},         {"materials", data.materials.size()},
                        {"images", data.images.size()},       {"lights", data.lights.size()},
                        {"cameras", data.cameras.size()},     {"emitters", scene_->emitters().size()}};
}

}  // namespace ln
