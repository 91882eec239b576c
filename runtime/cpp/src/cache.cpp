#include "ln/cache.hpp"

#include <array>
#include <cmath>
#include <cstring>

#include "gltf_files.hpp"
#include "ln/error.hpp"
#include "ln/output_file.hpp"
#include "ln/progress.hpp"
#include "ln/text.hpp"

namespace ln {

namespace {

constexpr char kMagic[8] = {'L', 'N', 'C', 'A', 'C', 'H', 'E', '\n'};
constexpr std::uint32_t kVersion = 3;  // of everything below and of what encode() writes

/// The beginning of the file.
struct Header {
  char magic[8];
  std::uint32_t version;
  char representation[20];
  Fingerprint scene, network, code, view;
  std::uint64_t seed;
  std::uint64_t payload_size;
  Fingerprint payload;
  Fingerprint header;  // of everything before
};
static_assert(std::is_trivially_copyable_v<Header> && sizeof(Header) == 144, "no gaps");

Fingerprint fingerprint(const Header& header) {
  Fingerprint f;
  f.add(&header, offsetof(Header, header));
  return f;
}

Header make_header(std::string_view representation, const CacheKey& key, const std::string& payload) {
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kVersion;
  representation.copy(header.representation, sizeof header.representation - 1);
  header.scene = key.scene;
  header.network = key.network;
  header.code = key.code;
  header.view = key.view;
  header.seed = key.seed;
  header.payload_size = payload.size();
  header.payload.add(payload);
  header.header = fingerprint(header);
  return header;
}

void add(Fingerprint& f, const Color& c) {
  for (std::size_t i = 0; i < 3; ++i) f.add(c[i]);
}

void add(Fingerprint& f, const TextureRef& t) {
  f.add(t.image);
  if (!t) return;
  f.add(t.uv_set);
  f.add(t.wrap_s);
  f.add(t.wrap_t);
  f.add(t.nearest);
  add(f, t.row0);
  add(f, t.row1);
}

void add(Fingerprint& f, const std::vector<std::string>& texts) {
  f.add(std::uint64_t{texts.size()});
  for (const std::string& text : texts) f.add(text);
}

void add(Fingerprint& f, const Material& m) {
  f.add(m.name);
  add(f, m.tags);
  for (const Color& c : {m.base_color, m.emission, m.attenuation_color, m.specular_color}) add(f, c);
  for (const float x : {m.alpha, m.metallic, m.roughness, m.normal_scale, m.alpha_cutoff, m.ior, m.transmission,
                        m.attenuation_distance, m.specular})
    f.add(x);
  f.add(m.alpha_mode);
  for (const bool x : {m.double_sided, m.unlit, m.solid}) f.add(x);
  for (const TextureRef* t : {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.emissive_texture,
                              &m.transmission_texture, &m.specular_texture, &m.specular_color_texture})
    add(f, *t);
}

void add(Fingerprint& f, const Image& image) {
  for (const int x : {image.width, image.height, image.channels}) f.add(x);
  f.add(image.srgb);
  f.add(image.bytes);
  f.add(std::uint64_t{image.floats.size()});
  f.add(image.floats.data(), image.floats.size() * sizeof(float));
}

}  // namespace

// --- Fingerprints ----------------------------------------------------------------------------------------------------

void Fingerprint::mix(std::uint64_t word) {
  const auto stir = [](std::uint64_t x) {  // Stafford's variant 13 of the finaliser of MurmurHash3
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  };
  a_ = stir(a_ ^ word);
  b_ = stir(b_ + word * 0x9e3779b97f4a7c15u) + a_;
}

void Fingerprint::add(const void* data, std::size_t size) {
  const char* bytes = static_cast<const char*>(data);
  for (; size >= 8; bytes += 8, size -= 8) {
    std::uint64_t word;
    std::memcpy(&word, bytes, 8);
    mix(word);
  }
  if (size == 0) return;
  std::uint64_t word = std::uint64_t{size} << 56;
  std::memcpy(&word, bytes, size);
  mix(word);
}

Fingerprint fingerprint(const SceneData& scene, const Image* environment) {
  Fingerprint f;
  for (const double x : {scene.origin.x, scene.origin.y, scene.origin.z, scene.unit}) f.add(x);
  f.add(scene.positions);
  f.add(std::uint64_t{scene.triangles.size()});
  f.add(scene.triangles.data(), scene.triangles.size() * sizeof(UVec3));
  f.add(scene.normals);
  f.add(scene.tangents);
  for (const auto& uvs : scene.uvs) f.add(uvs);
  f.add(scene.colors);
  for (const Part& part : scene.parts) {
    for (const std::uint32_t x : {part.first_triangle, part.triangle_count, part.material}) f.add(x);
    for (const bool x : {part.has_normals, part.has_colors, part.has_tangents}) f.add(x);
    f.add(part.mesh);
    f.add(part.node);
    add(f, part.tags);
  }
  for (const Material& material : scene.materials) add(f, material);
  for (const Image& image : scene.images) add(f, image);
  for (const PunctualLight& light : scene.lights) {
    f.add(light.kind);
    f.add(light.node);
    add(f, light.tags);
    for (const Vec3& v : {light.position, light.direction, light.intensity}) add(f, v);
    f.add(light.cos_inner);
    f.add(light.cos_outer);
  }
  if (environment) add(f, *environment);
  return f;
}

Fingerprint fingerprint(const View& view) {
  Fingerprint f;
  for (const int x : {view.width, view.height}) f.add(x);
  // Three pixels' rays and a height say where the camera stands and what it covers.
  for (const Vec2& pixel : {Vec2(0), Vec2(1, 0), Vec2(0, 1)}) {
    const Ray ray = view.rays.ray(pixel);
    f.add(&ray.origin, sizeof ray.origin);
    f.add(&ray.direction, sizeof ray.direction);
  }
  f.add(view.rays.height_at(1));
  for (const MeasuredPlace& place : view.measured()) {
    f.add(place.hit.triangle);
    for (const float x : {place.hit.u, place.hit.v}) f.add(x);
    f.add(place.front);
  }
  return f;
}

// --- Files -----------------------------------------------------------------------------------------------------------

void CacheReader::check(std::uint64_t count, std::size_t size) const {
  if (count > rest_.size() / size) throw Error("it is damaged");
}

void CacheReader::take(void* to, std::uint64_t count, std::size_t size) {
  check(count, size);
  if (count > 0) std::memcpy(to, rest_.data(), count * size);
  rest_.remove_prefix(count * size);
}

std::string load_cache(const std::string& path, std::string_view representation, const CacheKey& key) {
  gltf::Bytes file;
  try {
    gltf::MemoryBudget memory(0);
    file = gltf::read_file(path, memory);
  } catch (const Error& error) {
    const std::string_view text = error.what();
    if (text.ends_with("no such file")) throw Error("");
    throw Error("it cannot be read");
  }
  const std::string_view bytes = file.text();
  const std::string_view magic(kMagic, sizeof kMagic);
  if (!bytes.starts_with(magic.substr(0, bytes.size())))
    throw NotACache(printable(path) +
                    ": holds something else than a cache, which is not overwritten: give the cache another file, or "
                    "remove this one");
  Header header;
  if (bytes.size() < sizeof header) throw Error("it is damaged");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.version != kVersion) throw Error("it was written by another version of this program");
  if (header.header != fingerprint(header)) throw Error("it is damaged");
  if (std::string_view(header.representation) != representation) throw Error("it holds " + std::string(header.representation));
  if (header.scene != key.scene) throw Error("it was made for another scene");
  if (header.code != key.code) throw Error("it was made by another version of its operators or of the runtime library");
  if (header.network != key.network) throw Error("it was made by another network, or with other parameters");
  if (header.view != key.view)
    throw Error("it was made for another camera, size of the picture, or places where probes and lightmaps measure");
  if (header.seed != key.seed) throw Error("it was made with seed " + std::to_string(header.seed));
  std::string payload(bytes.substr(sizeof header));
  Fingerprint found;
  found.add(payload);
  if (payload.size() != header.payload_size || found != header.payload) throw Error("it is damaged");
  return payload;
}

void save_cache(const std::string& path, std::string_view representation, const CacheKey& key, const std::string& payload) {
  try {
    const Header header = make_header(representation, key, payload);
    OutputFile file(path);
    file.write(&header, sizeof header);
    file.write(payload);
    file.commit();
  } catch (const Error& error) {
    warning(std::string(error.what()) + ": this cache is not kept");
  }
}

void refuse_cache(const std::string& path, std::string_view reason) {
  if (!reason.empty())
    note(printable(path) + ": this cache is not used, " + std::string(reason) + "; it is computed and written again");
}

// --- Representations -------------------------------------------------------------------------------------------------

namespace {

void require(bool sound) {
  if (!sound) throw Error("it is damaged");
}

/// All that is left: photons on triangles of the scene.
std::vector<Photon> decode_hits(CacheReader& in, PrepareContext& context) {
  auto hits = in.get_all<Photon>();
  require(in.at_end());
  const std::size_t triangles = context.scene().data().triangles.size();
  for (const Photon& photon : hits) require(photon.triangle < triangles);
  return hits;
}

}  // namespace

const char* cache_name(const Photons*) { return "Photons"; }

void encode(CacheBytes& out, const Photons& photons) {
  out.put(photons.ledger);
  out.put(std::span<const Photon>(photons.hits));
}

void decode(CacheReader& in, PrepareContext& context, Photons& photons) {
  photons.ledger = in.get<PhotonLedger>();
  photons.hits = decode_hits(in, context);
}

const char* cache_name(const PhotonMap*) { return "PhotonMap"; }

void encode(CacheBytes& out, const PhotonMap& map) {
  out.put(std::uint64_t{map.size()});
  out.put(std::span<const PhotonMap::Block>(map.blocks_));
  out.put(std::span<const PhotonMap::Node>(map.nodes_));
}

void decode(CacheReader& in, PrepareContext&, PhotonMap& map) {
  map.size_ = in.get<std::uint64_t>();
  map.blocks_ = in.get_all<PhotonMap::Block>();
  map.nodes_ = in.get_all<PhotonMap::Node>();
  require(in.at_end());
  require(map.blocks_.size() == map.size_ / PhotonMap::kBlock + (map.size_ % PhotonMap::kBlock > 0));
  require(map.nodes_.size() == map.blocks_.size());
  for (const PhotonMap::Node& node : map.nodes_) require(node.axis < 3);
}

const char* cache_name(const SortedPhotons*) { return "SortedPhotons"; }

// The rest follows from the scene.
void encode(CacheBytes& out, const SortedPhotons& photons) { out.put(std::span<const Photon>(photons.hits)); }

void decode(CacheReader& in, PrepareContext& context, SortedPhotons& photons) {
  photons = sort_by_surface(context.scene().data(), decode_hits(in, context));
}

const char* cache_name(const QuadTree*) { return "QuadTree"; }

// Of each face the nodes of its tree, children behind parents and numbered from its root.
void encode(CacheBytes& out, const QuadTree& tree) {
  const std::size_t faces = tree.empty() ? 0 : tree.patches().face_count();
  out.put(std::uint64_t{faces});
  for (std::uint32_t face = 0; face < faces; ++face) {
    std::vector<QuadTreeNode> nodes;
    if (tree.lit(face)) nodes = tree.face_nodes(face);
    out.put(std::span<const QuadTreeNode>(nodes));
  }
}

void decode(CacheReader& in, PrepareContext& context, QuadTree& tree) {
  const auto patches = std::make_shared<const Patches>(context.scene().data());
  tree = QuadTree(patches);
  const auto faces = in.get<std::uint64_t>();
  require(faces == 0 || faces == patches->face_count());
  for (std::uint32_t face = 0; face < faces; ++face) {
    std::vector<QuadTreeNode> nodes = in.get_all<QuadTreeNode>();
    for (std::size_t i = 0; i < nodes.size(); ++i)
      require(nodes[i].leaf() || (nodes[i].children > i && nodes[i].children + 3u < nodes.size()));
    if (!nodes.empty()) tree.set(face, std::move(nodes));
  }
  require(in.at_end());
}

const char* cache_name(const TriMesh*) { return "TriMesh"; }

void encode(CacheBytes& out, const TriMesh& mesh) {
  const std::size_t faces = mesh.empty() ? 0 : mesh.patches().face_count();
  out.put(std::uint64_t{faces});
  out.put(std::span<const Color>(mesh.vertices()));
  for (std::uint32_t face = 0; face < faces; ++face) out.put(mesh.triangles(face));
}

void decode(CacheReader& in, PrepareContext& context, TriMesh& mesh) {
  const auto patches = std::make_shared<const Patches>(context.scene().data());
  mesh = TriMesh(patches);
  const auto faces = in.get<std::uint64_t>();
  require(faces == 0 || faces == patches->face_count());
  const std::vector<Color> vertices = in.get_all<Color>();
  for (const Color& vertex : vertices) mesh.add_vertex(vertex);
  for (std::uint32_t face = 0; face < faces; ++face) {
    const std::vector<MeshTriangle> triangles = in.get_all<MeshTriangle>();
    for (const MeshTriangle& t : triangles) {
      for (const std::uint32_t v : t.vertex) require(v < vertices.size());
      for (const Vec2& corner : t.corner) require(std::isfinite(corner.x) && std::isfinite(corner.y));  // they are sorted
    }
    if (!triangles.empty()) mesh.add_triangles(face, triangles);
  }
  require(in.at_end());
  mesh.finish(context.workers());
}

const char* cache_name(const IrradianceRecordSets*) { return "IrradianceRecords"; }

namespace {

/// A record without its horizon, whose values follow behind all records.
struct StoredRecord {
  Vec3 p, n;
  float exact, reach, first_reach, clear, above;
  Color irradiance;
  glm::mat3 rotation, translation;
  float distance, nearest;
  std::uint32_t horizon;  // how many
};
static_assert(sizeof(StoredRecord) == 35 * sizeof(float), "no gaps");

void encode(CacheBytes& out, const IrradianceRecords& records) {
  out.put(records.spacing());
  const std::vector<float> first_reaches = records.first_reaches();
  std::vector<StoredRecord> stored;
  std::vector<float> horizons;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const IrradianceRecord& r = records.records()[i];
    const IrradianceSample& s = r.sample;
    stored.push_back({r.p, r.n, r.exact, r.reach, first_reaches[i], r.clear, r.above, s.irradiance, s.rotation, s.translation,
                      s.distance, s.nearest, static_cast<std::uint32_t>(s.horizon.size())});
    horizons.insert(horizons.end(), s.horizon.begin(), s.horizon.end());
  }
  out.put(std::span<const StoredRecord>(stored));
  out.put(std::span<const float>(horizons));
}

IrradianceRecords decode_records(CacheReader& in) {
  constexpr float kFarthest = 2;  // from the origin, along each axis [normalised units]
  IrradianceRecords records(in.get<RecordSpacing>());
  const auto stored = in.get_all<StoredRecord>();
  const auto horizons = in.get_all<float>();
  auto horizon = horizons.begin();
  for (const StoredRecord& s : stored) {
    for (int axis = 0; axis < 3; ++axis) require(std::abs(s.p[axis]) <= kFarthest && std::abs(s.n[axis]) <= kFarthest);
    require(s.first_reach >= 0 && s.first_reach < kInfinity);
    require(s.horizon <= static_cast<std::size_t>(horizons.end() - horizon) && (s.horizon > 0 || s.clear == kInfinity));
    const auto end = horizon + s.horizon;
    records.restore({s.p,
                     s.n,
                     s.exact,
                     s.reach,
                     s.clear,
                     s.above,
                     {s.irradiance, s.rotation, s.translation, s.distance, s.nearest, {horizon, end}}},
                    s.first_reach);
    horizon = end;
  }
  require(horizon == horizons.end());
  return records;
}

}  // namespace

void encode(CacheBytes& out, const IrradianceRecordSets& sets) {
  encode(out, sets.seen);
  encode(out, sets.beyond);
  out.put(sets.ambient);
}

void decode(CacheReader& in, PrepareContext&, IrradianceRecordSets& sets) {
  sets.seen = decode_records(in);
  sets.beyond = decode_records(in);
  sets.ambient = in.get<Color>();
  require(in.at_end());
}

}  // namespace ln
