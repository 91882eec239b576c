#pragma once
// Wires that are kept in files between runs.
//
// A cache holds what one wire stores, and what it was made from: the scene, the part of the network that leads to it with its
// parameters, the sources of its operators and of this library, the seed, and, where that matters, what results look at. Where
// any of them differs, or the file is damaged, it is not used, a note says why, and the wire is computed and written again.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ln/error.hpp"
#include "ln/irradiance_records.hpp"
#include "ln/photon_map.hpp"
#include "ln/photon_tracer.hpp"
#include "ln/prepare.hpp"
#include "ln/quad_tree.hpp"
#include "ln/sorted_photons.hpp"
#include "ln/tri_mesh.hpp"

namespace ln {

struct Image;

/// A fingerprint of 128 bits, for telling things apart that nobody has made alike on purpose.
class Fingerprint {
 public:
  void add(const void* data, std::size_t size);
  void add(std::string_view text) {
    add(std::uint64_t{text.size()});
    add(text.data(), text.size());
  }
  template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void add(T value) {
    add(&value, sizeof value);
  }
  template <class T>
    requires std::has_unique_object_representations_v<T> || std::is_same_v<T, Vec2> || std::is_same_v<T, Vec3> ||
             std::is_same_v<T, Vec4>
  void add(const std::vector<T>& values) {
    add(std::uint64_t{values.size()});
    add(values.data(), values.size() * sizeof(T));
  }
  bool operator==(const Fingerprint&) const = default;

 private:
  void mix(std::uint64_t word);

  std::uint64_t a_ = 0x243f6a8885a308d3u, b_ = 0x13198a2e03707344u;
};

/// Of everything that a scene and its environment map say about light.
Fingerprint fingerprint(const SceneData& scene, const Image* environment);

/// Of the camera, the size of the picture, and the places where probes and lightmaps measure.
Fingerprint fingerprint(const View& view);

/// What a cached wire is made from.
struct CacheKey {
  Fingerprint scene, network;
  Fingerprint code;  // of the operators and of the runtime library that make it
  Fingerprint view;  // none if it does not depend on that
  std::uint64_t seed = 0;
};

/// The bytes of a wire, on their way out.
class CacheBytes {
 public:
  template <class T>
    requires std::is_trivially_copyable_v<T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
    requires std::is_trivially_copyable_v<T>
  void put(std::span<const T> values) {
    put(std::uint64_t{values.size()});
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// The bytes of a wire, coming back. Throws Error where they end too early.
class CacheReader {
 public:
  explicit CacheReader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
    requires std::is_trivially_copyable_v<T>
  T get() {
    T value{};
    take(&value, 1, sizeof value);
    return value;
  }
  template <class T>
    requires std::is_trivially_copyable_v<T>
  std::vector<T> get_all() {
    const auto count = get<std::uint64_t>();
    check(count, sizeof(T));
    std::vector<T> values(count);
    take(values.data(), count, sizeof(T));
    return values;
  }
  bool at_end() const { return rest_.empty(); }

 private:
  void check(std::uint64_t count, std::size_t size) const;
  void take(void* to, std::uint64_t count, std::size_t size);

  std::string_view rest_;
};

// What each representation puts into a cache and makes of it. `decode` throws Error if it cannot belong to the scene.
const char* cache_name(const Photons*);
void encode(CacheBytes& out, const Photons& photons);
void decode(CacheReader& in, PrepareContext& context, Photons& photons);
const char* cache_name(const PhotonMap*);
void encode(CacheBytes& out, const PhotonMap& map);
void decode(CacheReader& in, PrepareContext& context, PhotonMap& map);
const char* cache_name(const SortedPhotons*);
void encode(CacheBytes& out, const SortedPhotons& photons);
void decode(CacheReader& in, PrepareContext& context, SortedPhotons& photons);
const char* cache_name(const QuadTree*);
void encode(CacheBytes& out, const QuadTree& tree);
void decode(CacheReader& in, PrepareContext& context, QuadTree& tree);
const char* cache_name(const TriMesh*);
void encode(CacheBytes& out, const TriMesh& mesh);
void decode(CacheReader& in, PrepareContext& context, TriMesh& mesh);
const char* cache_name(const IrradianceRecordSets*);
void encode(CacheBytes& out, const IrradianceRecordSets& sets);
void decode(CacheReader& in, PrepareContext& context, IrradianceRecordSets& sets);

/// A file that is to hold a cache holds something else: the user's own work, perhaps.
struct NotACache : Error {
  using Error::Error;
};

/// The payload of a cache that was made from `key`; throws Error with the reason if there is none. An empty reason: no such
/// file.
std::string load_cache(const std::string& path, std::string_view representation, const CacheKey& key);
/// Writes a cache; a failure is a warning.
void save_cache(const std::string& path, std::string_view representation, const CacheKey& key, const std::string& payload);
/// Says why a cache is not used; nothing if `reason` is empty.
void refuse_cache(const std::string& path, std::string_view reason);

/// The wire in a file, if that can be used. Throws NotACache.
template <class T>
std::unique_ptr<T> read_cache(PrepareContext& context, const CacheKey& key, const std::string& path) {
  try {
    auto found = std::make_unique<T>();
    const std::string payload = load_cache(path, cache_name(found.get()), key);
    CacheReader in(payload);
    decode(in, context, *found);
    return found;
  } catch (const NotACache&) {
    throw;
  } catch (const Error& error) {
    refuse_cache(path, error.what());
    return nullptr;
  }
}

template <class T>
void write_cache(const T& wire, const CacheKey& key, const std::string& path) {
  CacheBytes out;
  encode(out, wire);
  save_cache(path, cache_name(&wire), key, out.bytes());
}

/// A wire, read from its file or computed and written to it.
template <class T>
class CachedWire {
 public:
  /// Reads the file if it can be used.
  void open(PrepareContext& context, const CacheKey& key, const std::string& path) {
    key_ = key;
    found_ = read_cache<T>(context, key, path);
    wire_ = found_.get();
  }

  /// Must the wire be computed?
  bool wanted() const { return !found_; }

  /// Keeps what has been computed, which must outlive this; in the file, too, if that was to be opened.
  void keep(const T& computed, const std::string& path) {
    wire_ = &computed;
    if (key_) write_cache(computed, *key_, path);
  }

  /// The wire; empty before either, as in a scene where it carries no light.
  const T& get() const {
    static const T kNothing{};
    return wire_ ? *wire_ : kNothing;
  }

 private:
  std::optional<CacheKey> key_;
  std::unique_ptr<T> found_;
  const T* wire_ = nullptr;
};

}  // namespace ln
