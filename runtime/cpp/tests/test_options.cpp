#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "ln/program.hpp"

namespace {

using namespace ln;

struct Parameters {
  std::int64_t count = 200'000;
  float error = 0.01f, radius = 0.05f, cone = 0.5235987756f, wait = 2, scale = 0.1f;
  bool aim = true;
  std::int32_t kernel = 1;
  std::string file = "a";

  static constexpr const char* kKernels[] = {"cone", "box"};
  std::vector<ParameterSlot> slots = {
      {"photons", "count", ParameterKind::count, &count, 1, 1e9},
      {"photons", "aim", ParameterKind::flag, &aim},
      {"gather.photons", "error", ParameterKind::ratio, &error, 1e-4, 1},
      {"caustic", "radius", ParameterKind::length, &radius, 0},
      {"caustic", "cone", ParameterKind::angle, &cone, 0, 1.5707964},
      {"caustic", "wait", ParameterKind::time, &wait, 0, 60},
      {"caustic", "scale", ParameterKind::number, &scale},
      {"caustic", "kernel", ParameterKind::choice, &kernel, 0, 0, kKernels},
      {"caustic", "file", ParameterKind::text, &file},
  };
  std::vector<NodeInfo> nodes = {{"light", "Lights", 3}, {"photons", "ParticleTracer", 4}, {"caustic", "NNDensity", 5}};
  ProgramInfo info{"composite", "composite.ln", "L(D|G|S)*E", slots, nodes, {}};

  Options parse(std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "some/network");
    return parse_options(static_cast<int>(arguments.size()), arguments.data(), info);
  }
  Options set(const char* text) { return parse({"s.gltf", "--set", text}); }
};

std::string usage_error(std::vector<const char*> arguments) {
  try {
    Parameters().parse(std::move(arguments));
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

TEST_CASE("defaults") {
  const Options options = Parameters().parse({"scene.gltf"});
  CHECK(options.scene == "scene.gltf");
  CHECK(options.output == "out.exr");
  CHECK(options.samples == kDefaultSamples);
  CHECK(!options.time);
  CHECK(!options.error);
  CHECK(options.seed == 0);
  CHECK(options.threads >= 1);
  CHECK(options.progress == ProgressMode::automatic);
  CHECK(options.units == Units::radiometric);
}

TEST_CASE("all options") {
  const Options options = Parameters().parse({"-o",
                                              "a.exr",
                                              "--size",
                                              "30x20",
                                              "--camera",
                                              "Cam 1",
                                              "--samples",
                                              "2k",
                                              "--time",
                                              "1.5",
                                              "--error=1%",
                                              "--seed",
                                              "18446744073709551615",
                                              "--threads",
                                              "5",
                                              "--stats",
                                              "s.json",
                                              "--progress",
                                              "json",
                                              "--preview",
                                              "p.png",
                                              "--env",
                                              "e.hdr",
                                              "--units",
                                              "photometric",
                                              "--set",
                                              "photons.count=7",
                                              "s.gltf",
                                              "--set=photons.aim=off"});
  CHECK(options.scene == "s.gltf");
  CHECK(options.output == "a.exr");
  CHECK(options.width == 30);
  CHECK(options.height == 20);
  CHECK(options.camera == "Cam 1");
  CHECK(options.samples == 2000u);
  CHECK(options.time == 1.5);
  CHECK(options.error == 0.01);
  CHECK(options.seed == 18446744073709551615u);
  CHECK(options.threads == 5);
  CHECK(options.stats_path == "s.json");
  CHECK(options.preview_path == "p.png");
  CHECK(options.environment_path == "e.hdr");
  CHECK(options.progress == ProgressMode::json);
  CHECK(options.units == Units::photometric);
  CHECK(options.sets == std::vector<std::string>{"photons.count=7", "photons.aim=off"});
}

TEST_CASE("a limit of time or error replaces the default number of samples") {
  CHECK(!Parameters().parse({"s.gltf", "--time", "2min"}).samples);
  CHECK(Parameters().parse({"s.gltf", "--time", "2min"}).time == 120);
  CHECK(!Parameters().parse({"s.gltf", "--error", "0.1"}).samples);
}

TEST_CASE("the last of repeated options counts; what follows -- is a scene") {
  CHECK(Parameters().parse({"s.gltf", "--samples", "1", "--samples", "2"}).samples == 2u);
  CHECK(Parameters().parse({"--samples", "1", "--", "-odd.gltf"}).scene == "-odd.gltf");
}

TEST_CASE("wrong use is refused with what was found and what was wanted") {
  CHECK(contains(usage_error({}), "no scene given"));
  CHECK(contains(usage_error({"a.gltf", "b.gltf"}), "'b.gltf' is one too many"));
  CHECK(contains(usage_error({"s.gltf", "--sampels", "4"}), "did you mean '--samples'?"));
  CHECK(contains(usage_error({"s.gltf", "--samples"}), "--samples needs a value"));
  CHECK(contains(usage_error({"s.gltf", "--progress", "jsn"}), "did you mean 'json'?"));
  CHECK(contains(usage_error({"s.gltf", "-o", "x.png"}), "--preview"));
  for (const char* value : {"-1", "0", "1.5", "abc", "", "1e99", "nan", "inf", "0x10", "5%", "1 "}) {
    CHECK_MESSAGE(contains(usage_error({"s.gltf", "--samples", value}), "--samples"), value);
  }
  for (const char* value :
       {"0x5", "5x0", "5", "x", "5x", "x5", "-3x5", "5x5x5", "5.5x4", "65537x1", "99999999999999x5", "65536x65536"}) {
    CHECK_MESSAGE(contains(usage_error({"s.gltf", "--size", value}), "--size"), value);
  }
  for (const char* value : {"0", "-2", "9999", "two"})
    CHECK(contains(usage_error({"s.gltf", "--threads", value}), "--threads"));
  for (const char* value : {"-1", "18446744073709551616", "1.5", "x"})
    CHECK(contains(usage_error({"s.gltf", "--seed", value}), "--seed"));
  for (const char* value : {"0", "-3", "soon", "nan", "5deg"})
    CHECK(contains(usage_error({"s.gltf", "--time", value}), "--time"));
  for (const char* value : {"0", "-1%", "x", "inf"}) CHECK(contains(usage_error({"s.gltf", "--error", value}), "--error"));
}

TEST_CASE("--set stores values with units") {
  Parameters p;
  p.set("photons.count=1.5M");
  CHECK(p.count == 1'500'000);
  p.set("photons.aim=no");
  CHECK(!p.aim);
  p.set("gather.photons.error=5%");  // node names of macros contain dots
  CHECK(p.error == 0.05f);
  p.set("caustic.radius=2mm");
  CHECK(p.radius == 0.002f);
  p.set("caustic.cone=90deg");
  CHECK(p.cone == doctest::Approx(1.5707963));
  p.set("caustic.wait=50ms");
  CHECK(p.wait == 0.05f);
  p.set("caustic.scale=-1e-3");
  CHECK(p.scale == -0.001f);
  p.set("caustic.kernel=cone");
  CHECK(p.kernel == 0);
  p.set("caustic.file=b=c.d");
  CHECK(p.file == "b=c.d");
}

TEST_CASE("--set refuses what no slot takes") {
  const auto error = [](const char* text) { return usage_error({"s.gltf", "--set", text}); };
  CHECK(contains(error("photon.count=3"), "did you mean 'photons'?"));
  CHECK(contains(error("photons.cuont=3"), "did you mean 'count'?"));
  CHECK(contains(error("photons.zzz=3"), "it has count, aim"));
  CHECK(contains(error("light.x=3"), "node 'light' has no parameters to set"));
  CHECK(contains(error("photons.count=0"), "between 1 and 1G"));
  CHECK(contains(error("photons.count=2.5"), "whole number"));
  CHECK(contains(error("caustic.cone=30"), "30deg"));
  CHECK(contains(error("caustic.cone=91deg"), "between 0deg and 90deg"));
  CHECK(contains(error("caustic.radius=-1cm"), "at least 0m"));
  CHECK(contains(error("caustic.radius=0.05"), "5cm"));
  CHECK(contains(error("caustic.radius=1e39km"), "caustic.radius"));
  CHECK(contains(error("caustic.kernel=bix"), "one of cone, box"));
  CHECK(contains(error("photons.aim=maybe"), "true or false"));
  for (const char* text : {"", "x", "photons.count", "=3", ".=3", "photons.=3", ".count=3", "photons=3"})
    CHECK_MESSAGE(!error(text).empty(), text);
}

TEST_CASE("parameter_text writes what set_parameter reads") {
  Parameters p;
  const char* expected[] = {"200k", "true", "1%", "0.05m", "30deg", "2s", "0.1", "box", "a"};
  for (std::size_t i = 0; i < p.slots.size(); ++i) {
    const std::string text = parameter_text(p.slots[i]);
    CHECK(text == expected[i]);
    CHECK_NOTHROW(set_parameter(p.slots[i], text));
    CHECK(parameter_text(p.slots[i]) == text);
  }
}

TEST_CASE("--help names the network's parameters with defaults and ranges") {
  std::string text;
  try {
    Parameters().parse({"--help"});
  } catch (const HelpRequest& request) {
    text = request.text;
  }
  for (const char* part : {"network SCENE [OPTIONS]", "composite.ln:4", "photons.count=200k", "between 1 and 1G",
                           "one of cone, box", "L(D|G|S)*E", "130"})
    CHECK_MESSAGE(contains(text, part), part);
}

TEST_CASE("the size of the picture follows the camera") {
  const auto is = [](PictureSize size, int width, int height) { return size.width == width && size.height == height; };
  Options options;
  CHECK(is(picture_size(options, 2), 640, 320));
  CHECK(is(picture_size(options, 0.5f), 320, 640));
  CHECK(is(picture_size(options, 0), 640, 480));
  CHECK(is(picture_size(options, NAN), 640, 480));
  CHECK(is(picture_size(options, 1e30f), 640, 480));
  CHECK(is(picture_size(options, 640), 640, 1));
  options.width = 5;
  options.height = 3;
  CHECK(is(picture_size(options, 2), 5, 3));
}

TEST_CASE("nearest_word") {
  CHECK(nearest_word("neighbors", {"neighbours", "count"}) == "neighbours");
  CHECK(nearest_word("rad", {"radius"}).empty());
  CHECK(nearest_word("radi", {"radius"}) == "radius");
  CHECK(nearest_word("cuont", {"count"}) == "count");
  CHECK(nearest_word("zzz", {"count"}).empty());
  CHECK(nearest_word("x", {"y"}).empty());
}

}  // namespace
