// Whole runs of a program whose network is a stub: exit statuses, files, signals.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfStringAttribute.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <new>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "ln/film.hpp"
#include "ln/parallel.hpp"
#include "ln/program.hpp"
#include "ln/progress.hpp"
#include "ln/render_passes.hpp"
#include "ln/stats.hpp"

namespace {

using namespace ln;
namespace fs = std::filesystem;

std::uint32_t hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

std::int64_t photon_count = 100;
const ParameterSlot kSlots[] = {{"photons", "count", ParameterKind::count, &photon_count, 1, 1e6}};
const NodeInfo kNodes[] = {{"photons", "ParticleTracer", 3}};
const LayerInfo kLayers[] = {{"caustic", "LS+DE"}};
const ProgramInfo kProgram{"stub", "stub.ln", "L(D|G|S)*E", kSlots, kNodes, kLayers};

struct Stub : RunCallbacks {
  int microseconds_per_pixel = 0;
  int prepare_seconds = 0;
  bool broken_samples = false;
  std::function<void()> fault;  // in prepare

  PictureSize load(RunContext& context) override {
    if (!fs::exists(context.options.scene)) throw Error(context.options.scene + ": no such file");
    note("material 'a\x1b[31m\n\xff\xe2\x80\xae' is odd");
    return picture_size(context.options, 1.6f);
  }
  void build(RunContext&) override {}
  void prepare(RunContext& context) override {
    context.progress.phase("prepare", "photons");
    if (fault) fault();
    context.workers.parallel_for(static_cast<std::size_t>(prepare_seconds) * 100, 1,
                                 [](std::size_t) { std::this_thread::sleep_for(std::chrono::milliseconds(10)); });
  }
  void render_tile(const Tile& tile, Film& film) override {
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        if (tile.stopped()) return;
        for (std::uint32_t i = 0; i < tile.sample_count; ++i) {
          const std::uint32_t sample = tile.first_sample + i;
          const float value = static_cast<float>(hash(hash(static_cast<std::uint32_t>(x + 1000 * y)) + sample) >> 8) * 0x1p-24f;
          film.add(x, y, sample, broken_samples && sample == 1 ? Color(NAN, -1, kInfinity) : Color(value, 2 * value, 1));
          film.add_layer(0, x, y, Color(value));
        }
        if (microseconds_per_pixel > 0) std::this_thread::sleep_for(std::chrono::microseconds(microseconds_per_pixel));
      }
    }
  }
  void collect(Stats& stats) override {
    stats.scene_file = "s.gltf";
    stats.scene_counts = {{"triangles", 12}};
    stats.rays.camera = stats.rays.total = 99;
    stats.nodes.push_back({"photons", "ParticleTracer", 0.5, 7, "the scene has no specular surface"});
  }
};

std::string read(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

/// Runs programs in a folder of their own that holds a scene.
struct Bench {
  fs::path folder = make();
  Stub stub;
  ~Bench() { fs::remove_all(folder); }

  static fs::path make() {
    std::string name = (fs::temp_directory_path() / "ln_program_XXXXXX").string();
    REQUIRE(mkdtemp(name.data()));
    std::ofstream(fs::path(name) / "s.gltf") << "{}";
    return name;
  }

  pid_t start(std::vector<std::string> arguments, const std::function<void()>& before = {}) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child > 0) return child;
    if (chdir(folder.c_str()) != 0) _exit(99);
    dup2(open("stdout.txt", O_WRONLY | O_CREAT | O_TRUNC, 0666), 1);
    dup2(open("stderr.txt", O_WRONLY | O_CREAT | O_TRUNC, 0666), 2);
    if (before) before();
    arguments.insert(arguments.begin(), "bin/network");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    _exit(run_program(static_cast<int>(argv.size()), argv.data(), kProgram, stub));
  }
  int wait(pid_t child) {
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int run(std::vector<std::string> arguments, const std::function<void()>& before = {}) {
    return wait(start(std::move(arguments), before));
  }

  /// Starts a render of hours, and returns when its first pass has begun.
  pid_t start_rendering(std::vector<std::string> options) {
    options.insert(options.begin(), {"s.gltf", "--samples", "1000000", "--progress", "json"});
    const pid_t child = start(std::move(options));
    for (int i = 0; i < 6000 && !contains(errors(), "\"render\""); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    REQUIRE(contains(errors(), "\"render\""));
    return child;
  }

  std::string errors() const { return read(folder / "stderr.txt"); }
  /// Lines on stderr that are neither notes nor empty.
  std::vector<std::string> error_lines() const {
    std::vector<std::string> lines;
    std::ifstream stream(folder / "stderr.txt");
    for (std::string line; std::getline(stream, line);) {
      if (!line.starts_with("note: ")) lines.push_back(line);
    }
    return lines;
  }
  /// True if nothing but the scene and what the test put there is left.
  bool clean() const {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename();
      if (name != "s.gltf" && name != "stdout.txt" && name != "stderr.txt") return false;
    }
    return true;
  }
};

struct Picture {
  int width = 0, height = 0, samples = 0;
  std::vector<float> red, caustic_green;
  std::string caustic_paths, seed, parameters;
  std::vector<std::string> channels;
};

Picture read_picture(const fs::path& path) {
  Imf::InputFile file(path.c_str());
  const Imf::Header& header = file.header();
  Picture picture;
  const Imath::Box2i box = header.dataWindow();
  picture.width = box.max.x + 1;
  picture.height = box.max.y + 1;
  const std::size_t size = static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  picture.red.resize(size);
  picture.caustic_green.resize(size);
  Imf::FrameBuffer buffer;
  const std::size_t row = sizeof(float) * static_cast<std::size_t>(picture.width);
  buffer.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(picture.red.data()), sizeof(float), row));
  buffer.insert("caustic.G", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(picture.caustic_green.data()), sizeof(float), row));
  file.setFrameBuffer(buffer);
  file.readPixels(box.min.y, box.max.y);
  picture.samples = header.typedAttribute<Imf::IntAttribute>("samples").value();
  picture.seed = header.typedAttribute<Imf::StringAttribute>("seed").value();
  picture.caustic_paths = header.typedAttribute<Imf::StringAttribute>("lightPaths.caustic").value();
  if (const auto* sets = header.findTypedAttribute<Imf::StringAttribute>("parameters")) picture.parameters = sets->value();
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel)
    picture.channels.emplace_back(channel.name());
  return picture;
}

TEST_CASE("a render leaves the picture, its layers and what made it") {
  Bench bench;
  CHECK(bench.run({"s.gltf", "-o", "a.exr", "--size", "45x31", "--samples", "5", "--seed", "7", "--set", "photons.count=2k",
                   "--stats", "a.json", "--preview", "a.png"}) == 0);
  const Picture picture = read_picture(bench.folder / "a.exr");
  CHECK(picture.width == 45);
  CHECK(picture.height == 31);
  CHECK(picture.samples == 5);
  CHECK(picture.seed == "7");
  CHECK(picture.caustic_paths == "LS+DE");
  CHECK(picture.parameters == "photons.count=2k");
  CHECK(picture.channels == std::vector<std::string>{"B", "G", "R", "caustic.B", "caustic.G", "caustic.R"});
  CHECK(picture.red == picture.caustic_green);
  CHECK(read(bench.folder / "a.png").starts_with("\x89PNG"));
  CHECK(read(bench.folder / "stdout.txt").empty());

  const auto stats = nlohmann::json::parse(read(bench.folder / "a.json"));
  CHECK(stats["network"] == "stub");
  CHECK(stats["scene"]["triangles"] == 12);
  CHECK(stats["samples"] == 5);
  CHECK(stats["rays"]["total"] == 99);
  CHECK(stats["nodes"][0]["skipped"] == "the scene has no specular surface");
  CHECK(stats["peak_bytes"] > 1'000'000);
  double sum = 0;
  for (const char* phase : {"load", "build", "prepare", "render"}) sum += stats["seconds"][phase].get<double>();
  CHECK(stats["seconds"]["total"].get<double>() >= sum);
}

TEST_CASE("the same seed gives the same file with any number of threads") {
  Bench bench;
  for (const char* threads : {"1", "2", "5"}) {
    REQUIRE(bench.run({"s.gltf", "-o", std::string("a") + threads + ".exr", "--size", "333x211", "--samples", "21", "--threads",
                       threads}) == 0);
  }
  const std::string one = read(bench.folder / "a1.exr");
  CHECK(!one.empty());
  CHECK(one == read(bench.folder / "a2.exr"));
  CHECK(one == read(bench.folder / "a5.exr"));
}

TEST_CASE("wrong use: status 2, one line") {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{},
                                             {"s.gltf", "--bogus"},
                                             {"s.gltf", "--samples", "-1"},
                                             {"s.gltf", "--set", "photon.count=1"},
                                             {"s.gltf", "-o", "s.gltf"},
                                             {"s.gltf", "-o", "a.exr", "--stats", "./a.exr"},
                                             {"s.gltf", "--preview", "p.png", "--env", "p.png"}}) {
    Bench bench;
    CHECK(bench.run(arguments) == 2);
    const std::vector<std::string> lines = bench.error_lines();
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].starts_with("network: error: "));
    CHECK(bench.clean());
    CHECK(read(bench.folder / "s.gltf") == "{}");
  }
}

TEST_CASE("help and version go to standard output") {
  Bench bench;
  CHECK(bench.run({"--help"}) == 0);
  CHECK(contains(read(bench.folder / "stdout.txt"), "photons.count=100"));
  CHECK(bench.run({"--version"}) == 0);
  CHECK(bench.errors().empty());
}

TEST_CASE("failures: status 1, one line, no file") {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{{"none.gltf"},
                                                                                         {"s.gltf", "-o", "none/a.exr"},
                                                                                         {"s.gltf", "-o", "."},
                                                                                         {"s.gltf", "--stats", "none/a.json"},
                                                                                         {"s.gltf", "--preview", "none/a.png"},
                                                                                         {"s.gltf", "-o", "/dev/full"}}) {
    Bench bench;
    CHECK(bench.run(arguments) == 1);
    const std::vector<std::string> lines = bench.error_lines();
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].starts_with("network: error: "));
    CHECK(bench.clean());
  }
}

TEST_CASE("whatever the network throws becomes a line and a status") {
  const std::pair<std::function<void()>, const char*> faults[] = {
      {[] { throw Error("no such thing"); }, "no such thing"},
      {[] { throw std::bad_alloc(); }, "out of memory"},
      {[] { throw std::logic_error("index"); }, "internal error: index"},
      {[] { throw 3; }, "internal error"},
  };
  for (const auto& [fault, message] : faults) {
    for (const char* progress : {"auto", "json", "none"}) {
      Bench bench;
      bench.stub.fault = fault;
      CHECK(bench.run({"s.gltf", "--progress", progress}) == 1);
      CHECK(contains(bench.errors(), message));
      CHECK(bench.clean());
    }
  }
}

TEST_CASE("names from files cannot steer the terminal") {
  for (const char* progress : {"plain", "json"}) {
    Bench bench;
    CHECK(bench.run({"s.gltf", "--size", "8x5", "--progress", progress}) == 0);
    const std::string text = bench.errors();
    CHECK(contains(text, "a\\"));
    for (const char c : text) CHECK((static_cast<unsigned char>(c) >= 0x20 || c == '\n'));
    CHECK(!contains(text, "\xff"));
    CHECK(!contains(text, "\xe2\x80\xae"));
  }
}

TEST_CASE("progress in JSON is JSON, line by line; none is silent but for notes") {
  Bench bench;
  bench.stub.microseconds_per_pixel = 500;
  CHECK(bench.run({"s.gltf", "--size", "64x40", "--samples", "4", "--progress", "json", "--preview", "p.png"}) == 0);
  std::ifstream stream(bench.folder / "stderr.txt");
  std::vector<std::string> events, phases;
  for (std::string line; std::getline(stream, line);) {
    const auto json = nlohmann::json::parse(line);
    events.push_back(json["event"]);
    if (events.back() == "progress" && (phases.empty() || phases.back() != json["phase"])) phases.push_back(json["phase"]);
  }
  CHECK(phases == std::vector<std::string>{"load", "build", "prepare", "render", "write"});
  CHECK(events.back() == "done");
  CHECK(bench.run({"s.gltf", "--size", "8x5", "--progress", "none"}) == 0);
  CHECK(bench.error_lines().empty());
}

TEST_CASE("samples that no picture may hold are repaired, counted and reported") {
  Bench bench;
  bench.stub.broken_samples = true;
  CHECK(bench.run({"s.gltf", "--size", "8x5", "--samples", "4", "--stats", "a.json"}) == 0);
  CHECK(contains(bench.errors(), "warning: 40 samples were not finite and 40 were negative"));
  for (const float value : read_picture(bench.folder / "out.exr").red) CHECK((std::isfinite(value) && value >= 0));
  CHECK(nlohmann::json::parse(read(bench.folder / "a.json"))["repaired_samples"] == 80);
}

/// How a child ended after a signal. Machines that do much else are slow by the wall clock only.
struct Ending {
  int status;
  double processor_seconds, wall_seconds;  // since the signal
};

double seconds_of(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

/// Sends a child a signal after `milliseconds`, and waits for its end.
Ending end_after(pid_t child, int signal_number, int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
  clockid_t clock;
  timespec before{};
  REQUIRE(clock_getcpuclockid(child, &clock) == 0);
  REQUIRE(clock_gettime(clock, &before) == 0);
  const Stopwatch watch;
  kill(child, signal_number);
  int status = 0;
  rusage used{};
  REQUIRE(wait4(child, &status, 0, &used) == child);
  const double processor = seconds_of(used.ru_utime) + seconds_of(used.ru_stime) - static_cast<double>(before.tv_sec) -
                           1e-9 * static_cast<double>(before.tv_nsec);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), processor, watch.seconds()};
}

TEST_CASE("after Ctrl-C or SIGTERM the picture so far is written, within two seconds of work") {
  for (const int signal_number : {SIGINT, SIGTERM}) {
    for (const int milliseconds : {300, 1500}) {
      Bench bench;
      bench.stub.microseconds_per_pixel = 20;
      const Ending ending =
          end_after(bench.start_rendering({"--size", "160x100", "--stats", "a.json"}), signal_number, milliseconds);
      CHECK(ending.status == 130);
      CHECK(ending.processor_seconds < 2);
      const Picture picture = read_picture(bench.folder / "out.exr");
      CHECK(nlohmann::json::parse(read(bench.folder / "a.json"))["interrupted"] == true);
      for (const float value : picture.red) REQUIRE((std::isfinite(value) && value >= 0));
    }
  }
}

TEST_CASE("an interrupted picture whose passes are complete is the picture of that many samples") {
  Bench bench;  // its passes take a small part of the second that an interrupt grants them, on a busy machine, too
  bench.stub.microseconds_per_pixel = 20;
  CHECK(end_after(bench.start_rendering({"--size", "50x30"}), SIGINT, 600).status == 130);
  const Picture interrupted = read_picture(bench.folder / "out.exr");
  bench.stub.microseconds_per_pixel = 0;
  REQUIRE(interrupted.samples > 0);
  CHECK(bench.run({"s.gltf", "--size", "50x30", "--samples", std::to_string(interrupted.samples), "-o", "b.exr"}) == 0);
  CHECK(read_picture(bench.folder / "b.exr").red == interrupted.red);
}

TEST_CASE("an interrupt before the picture leaves the old one; a second signal kills") {
  Bench bench;
  std::ofstream(bench.folder / "out.exr") << "old";
  bench.stub.prepare_seconds = 60;
  const Ending ending = end_after(bench.start({"s.gltf"}), SIGINT, 300);
  CHECK(ending.wall_seconds < 20);
  CHECK(ending.status == 130);
  CHECK(read(bench.folder / "out.exr") == "old");
  CHECK(contains(bench.errors(), "no picture is written"));

  bench.stub.fault = [] {
    for (int i = 0; i < 6000; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  };
  const pid_t child = bench.start({"s.gltf"});
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  kill(child, SIGINT);
  const Ending killed = end_after(child, SIGINT, 300);
  CHECK(killed.wall_seconds < 20);
  CHECK(killed.status == -SIGINT);
  CHECK(read(bench.folder / "out.exr") == "old");
}

TEST_CASE("a signal that was ignored at the start stays ignored") {
  Bench bench;
  bench.stub.microseconds_per_pixel = 20;
  const pid_t child = bench.start({"s.gltf", "--size", "100x60", "--samples", "8"}, [] { std::signal(SIGINT, SIG_IGN); });
  CHECK(end_after(child, SIGINT, 100).status == 0);
}

TEST_CASE("closed standard streams and a reader that is gone do no harm") {
  Bench bench;
  CHECK(bench.run({"s.gltf", "--size", "8x5"}, [] {
    for (int stream = 0; stream < 3; ++stream) close(stream);
  }) == 0);
  CHECK_NOTHROW(read_picture(bench.folder / "out.exr"));
  CHECK(bench.run({"s.gltf", "--size", "8x5", "--progress", "json"}, [] {
    int ends[2];
    if (pipe(ends) != 0) _exit(98);
    dup2(ends[1], 2);
    close(ends[0]);
  }) == 0);
}

}  // namespace
