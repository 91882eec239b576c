#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "ln/cache.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "ln/progress.hpp"
#include "photon_scenes.hpp"
#include "quad_tree_functions.hpp"

using namespace ln;
using namespace ln::test;

namespace {

SceneData room() {
  SceneBuilder b;
  b.box(Vec3(-1), Vec3(1), b.material(Color(0.5f), Color(1)));
  return b.data;
}

Vec2 random_pair(std::uint32_t i) { return SampleStream(5, i).get2(0, 0); }

Photons some_photons() {
  Photons photons;
  for (std::uint32_t i = 0; i < 20; ++i) {
    Photon photon{};
    photon.triangle = i % 12;
    photons.hits.push_back(photon);
  }
  return photons;
}

QuadTree some_tree(const std::shared_ptr<const Patches>& patches) {
  QuadTree tree(patches);
  for (const std::uint32_t face : {0u, 3u})
    set_face(
        tree, face, [](const DomainCell& cell) { return larger_than(cell, 2); }, [](const DomainCell&) { return Color(1); });
  return tree;
}

TriMesh some_mesh(const std::shared_ptr<const Patches>& patches, Workers& workers) {
  TriMesh mesh(patches);
  std::vector<MeshTriangle> triangles;
  for (std::uint32_t i = 0; i < 9; ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) mesh.add_vertex(Color(random_pair(i).x));
    triangles.push_back({{random_pair(3 * i), random_pair(3 * i + 1), random_pair(3 * i + 2)}, {3 * i, 3 * i + 1, 3 * i + 2}});
  }
  mesh.add_triangles(1, triangles);
  mesh.finish(workers);
  return mesh;
}

IrradianceRecords some_records(std::uint32_t count) {
  IrradianceRecords records(RecordSpacing{});
  for (std::uint32_t i = 0; i < count; ++i) {
    Receiver where;
    where.p = Vec3(1.8f * random_pair(i).x - 0.9f, 0, 1.8f * random_pair(i).y - 0.9f);
    where.n = Vec3(0, 1, 0);
    where.footprint = 1;
    IrradianceSample sample;
    sample.irradiance = Color(random_pair(count + i).x);
    sample.distance = 0.1f + random_pair(count + i).y;
    sample.horizon.assign(3 + i % 3, i % 2 == 0 ? 4.0f : 0.5f);
    records.add(where, sample);
  }
  return records;
}

/// What a reader of the records finds at many points, bit by bit.
std::vector<float> found_in(const IrradianceRecords& records) {
  std::vector<float> found;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const Vec3 p(2 * random_pair(i).x - 1, 0, 2 * random_pair(i).y - 1), n(0, 1, 0);
    InterpolatedIrradiance mean(p, n);
    found.push_back(records.visit(p, n, IrradianceRecords::kOverlap, mean));
    const Color E = mean.value();
    found.insert(found.end(), {E.x, E.y, E.z});
  }
  return found;
}

template <class T>
std::string encoded(const T& wire) {
  CacheBytes out;
  encode(out, wire);
  return out.bytes();
}

/// Cuts the payload off everywhere, and changes each of its bytes: what is decoded is refused, or can be used.
template <class T, class Use>
void check_damage(Stage& stage, const T& wire, Use&& use) {
  const std::string whole = encoded(wire);
  int refused = 0;
  const auto decode_from = [&](const std::string& bytes) {
    try {
      T found;
      CacheReader in(bytes);
      decode(in, stage.context, found);
      use(found);
    } catch (const Error&) {
      ++refused;
    }
  };
  decode_from(whole);
  CHECK(refused == 0);
  for (std::size_t size = 0; size < whole.size(); ++size) decode_from(whole.substr(0, size));
  decode_from(whole + "x");
  CHECK(refused == static_cast<int>(whole.size()) + 1);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int bits : {0x01, 0x40, 0x80, 0xff}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ bits);
      decode_from(damaged);
    }
  }
}

}  // namespace

TEST_CASE("records read back are found as before, to the last bit") {
  Stage stage(room());
  const IrradianceRecordSets sets{some_records(400), some_records(30), Color(0.25f, 0.5f, 1)};
  IrradianceRecordSets again;
  const std::string bytes = encoded(sets);
  CacheReader in(bytes);
  decode(in, stage.context, again);
  CHECK(found_in(again.seen) == found_in(sets.seen));
  CHECK(found_in(again.beyond) == found_in(sets.beyond));
  CHECK(again.ambient == sets.ambient);
  CHECK(encoded(again) == bytes);
}

TEST_CASE("what does not make sense is refused, or harmless") {
  Stage stage(room());
  Workers workers(1);
  const auto patches = std::make_shared<const Patches>(stage.context.scene().data());
  const auto look = [](const auto& wire) {
    for (std::uint32_t i = 0; i < 24; ++i) wire.irradiance(i % 12, random_pair(i).x / 2, random_pair(i).y / 2, i < 12);
  };
  const Photons photons = some_photons();
  check_damage(stage, photons, [](const Photons&) {});
  check_damage(stage, PhotonMap(stage.context, photons.hits), [](const PhotonMap& map) {
    std::vector<NearPhoton> found(PhotonMap::capacity(5));
    map.nearest({}, 1, 5, found.data());
  });
  check_damage(stage, sort_by_surface(stage.context.scene().data(), photons.hits), [](const SortedPhotons&) {});
  check_damage(stage, some_tree(patches), look);
  check_damage(stage, some_mesh(patches, workers), look);
  check_damage(stage, IrradianceRecordSets{some_records(4), some_records(2), Color(1)},
               [](const IrradianceRecordSets& sets) { found_in(sets.seen); });
}

TEST_CASE("a file is used as it was written, for the key that it was written for, and else refused with a reason") {
  const std::string path = std::filesystem::temp_directory_path() / "ln_test_cache.cache";
  const auto write = [&](const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; };
  const auto refusal = [&](const CacheKey& key) -> std::string {
    try {
      load_cache(path, "Photons", key);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  CacheKey key;
  key.seed = 7;
  save_cache(path, "Photons", key, "some payload");
  CHECK(load_cache(path, "Photons", key) == "some payload");
  std::ifstream file(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(file), {}};
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write(whole.substr(0, size));
    CHECK(refusal(key).starts_with("it is "));
  }
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
    write(damaged);
    if (bit < 8 * 8)
      CHECK_THROWS_AS(load_cache(path, "Photons", key), NotACache);
    else
      CHECK(refusal(key).starts_with("it "));
  }
  for (const char* other : {"hello", "# a table of sensors", "LNCACHF\n and more"}) {
    write(other);
    CHECK_THROWS_AS(load_cache(path, "Photons", key), NotACache);
  }
  write(whole);
  CHECK_THROWS_WITH_AS(load_cache(path, "TriMesh", key), "it holds Photons", Error);
  const auto changed = [&](auto&& change) {
    CacheKey other = key;
    change(other);
    return refusal(other);
  };
  CHECK(changed([](CacheKey& k) { k.scene.add(1); }) == "it was made for another scene");
  CHECK(changed([](CacheKey& k) { k.code.add(1); }).starts_with("it was made by another version"));
  CHECK(changed([](CacheKey& k) { k.network.add(1); }).starts_with("it was made by another network"));
  CHECK(changed([](CacheKey& k) { k.view.add(1); }).starts_with("it was made for another camera"));
  CHECK(changed([](CacheKey& k) { k.seed = 8; }) == "it was made with seed 7");
  std::filesystem::remove(path);
  CHECK(refusal(key).empty());
}
