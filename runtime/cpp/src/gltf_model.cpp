#include "gltf_model.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "gltf_accessor.hpp"
#include "gltf_schema.hpp"
#include "ln/text.hpp"

namespace ln::gltf {

void Notes::count(std::string singular, std::string plural, double n) {
  constexpr std::size_t kMost = 40;
  if (notes_.size() >= kMost && index_.find(singular) == index_.end()) {
    ++left_out_;
    return;
  }
  const auto [found, is_new] = index_.emplace(singular, notes_.size());
  if (is_new) {
    notes_.push_back({std::move(singular), std::move(plural), n});
  } else {
    notes_[found->second].n += n;
  }
}

std::vector<std::string> Notes::take() const {
  std::vector<std::string> texts;
  for (const Note& note : notes_) {
    texts.push_back(note.n == 0 ? note.singular : number_text(note.n) + " " + (note.n == 1 ? note.singular : note.plural));
  }
  if (left_out_ > 0) texts.push_back("... and " + number_text(left_out_) + " more of this kind");
  return texts;
}

// ---------------------------------------------------------------- extensions

namespace {

/// Extensions that are read, or say nothing about a picture of the default state at rest.
constexpr std::array<std::string_view, 15> kRead{"KHR_lights_punctual",
                                                 "KHR_materials_emissive_strength",
                                                 "KHR_materials_ior",
                                                 "KHR_materials_pbrSpecularGlossiness",
                                                 "KHR_materials_specular",
                                                 "KHR_materials_transmission",
                                                 "KHR_materials_unlit",
                                                 "KHR_materials_volume",
                                                 "KHR_texture_transform",
                                                 "KHR_mesh_quantization",
                                                 "KHR_xmp",
                                                 "KHR_xmp_json_ld",
                                                 "EXT_mesh_gpu_instancing",
                                                 "KHR_animation_pointer",
                                                 "KHR_materials_variants"};

constexpr std::string_view kMeshopt = "EXT_meshopt_compression";

bool is_read(std::string_view name) { return std::find(kRead.begin(), kRead.end(), name) != kRead.end(); }

[[noreturn]] void refuse_extension(Json at, std::string_view name, std::string_view why) {
  at.fail("the extension " + printable(name, 80) + " " + std::string(why));
}

}  // namespace

void Model::check_extensions() {
  // Buffers with meshopt's data may come with plain data as well; load_buffers refuses those that do not.
  const auto readable = [](std::string_view name) { return is_read(name) || name == kMeshopt; };
  for (const Json name : root()["extensionsRequired"]) {
    if (!readable(name.text())) refuse_extension(name, name.text(), "is required, but not supported");
  }
  for (const Json name : root()["extensionsUsed"]) {
    if (!readable(name.text())) notes.add("the extension " + printable(name.text(), 80) + " is not supported and ignored");
    if (name.text() == "KHR_mesh_quantization") quantized = true;
  }
  if (root()["animations"].size() > 0) notes.add("animations are ignored; the scene is shown at rest");
}

// ---------------------------------------------------------------- the file

Model::Model(const std::string& path, std::uint64_t max_bytes) : memory(max_bytes), folder(path) {
  const std::string name = printable(path);
  file = read_file(path, memory);
  Glb glb;
  std::string_view text = file.text();
  try {
    if (is_glb(file) || path.ends_with(".glb") || path.ends_with(".GLB")) {
      glb = split_glb(file);
      text = glb.json;
      if (glb.has_extra_data) notes.add("there are bytes behind the end of the GLB content; they are ignored");
    }
    if (text.empty()) throw Error("the file is empty");
  } catch (const Error& error) {
    throw Error(name + ": " + error.what());
  }
  document = std::make_unique<JsonDocument>(name, text);
  if (!glb.has_binary) file = {};  // JSON alone: its text is not needed any more

  check_version();
  check_schema(root());
  const JsonArray accessor_json(root()["accessors"]);
  buffer_views = JsonArray(root()["bufferViews"]);
  cameras = JsonArray(root()["cameras"]);
  images = JsonArray(root()["images"]);
  lights = JsonArray(root()["extensions"]["KHR_lights_punctual"]["lights"]);
  materials = JsonArray(root()["materials"]);
  meshes = JsonArray(root()["meshes"]);
  nodes = JsonArray(root()["nodes"]);
  samplers = JsonArray(root()["samplers"]);
  skins = JsonArray(root()["skins"]);
  textures = JsonArray(root()["textures"]);
  check_extensions();
  load_buffers(glb);
  check_buffer_views();
  for (std::size_t i = 0; i < accessor_json.size(); ++i) {
    accessors.emplace_back(*this, accessor_json[i]);
    accessors.back().check_sparse_order();
  }
}

void Model::check_version() const {
  struct Version {
    int major = 0, minor = 0;
  };
  const auto read = [](Json json) {
    Version version;
    const std::string_view text = json.text();
    const auto major = std::from_chars(text.data(), text.data() + text.size(), version.major);
    const bool has_point = major.ec == std::errc{} && major.ptr < text.data() + text.size() && *major.ptr == '.';
    const auto minor = has_point ? std::from_chars(major.ptr + 1, text.data() + text.size(), version.minor) : major;
    if (!has_point || minor.ec != std::errc{} || minor.ptr != text.data() + text.size())
      json.fail(quoted(text, 40) + " is not a version like \"2.0\"");
    return version;
  };
  const Json asset = root()["asset"];
  if (!asset.is_object() || asset["version"].text().empty()) root().fail("asset.version is missing: is this a glTF file?");
  if (read(asset["version"]).major != 2)
    asset["version"].fail("glTF " + printable(asset["version"].text(), 40) + " is not supported, only 2.0 is");
  const Json least = asset["minVersion"];
  if (!least || least.kind() != JsonKind::string) return;
  const Version wanted = read(least);
  if (wanted.major > 2 || wanted.minor > 0)
    least.fail("the file needs a reader of glTF " + printable(least.text(), 40) + "; this one reads 2.0");
}

void Model::load_buffers(const Glb& glb) {
  std::size_t index = 0;
  for (const Json buffer : root()["buffers"]) buffers.push_back(load_buffer(buffer, index++, glb));
}

/// True if a buffer is there for what a decoder of EXT_meshopt_compression would write.
bool Model::holds_meshopt_data(std::size_t buffer) const {
  return std::any_of(buffer_views.begin(), buffer_views.end(),
                     [&](Json view) { return view["buffer"].index() == buffer && view["extensions"][kMeshopt]; });
}

Bytes Model::load_buffer(Json buffer, std::size_t index, const Glb& glb) {
  const Json uri = buffer["uri"];
  const auto wanted = buffer["byteLength"].index();
  Bytes bytes;
  if (!uri) {
    if (index == 0 && glb.has_binary) {
      bytes = {std::shared_ptr<std::uint8_t[]>(file.data, file.data.get() + (glb.binary.data() - file.data.get())),
               glb.binary.size()};
    } else if (holds_meshopt_data(index)) {
      refuse_extension(buffer, kMeshopt, "is not supported, and there is no uncompressed data beside it");
    } else {
      buffer.fail("uri", index == 0 ? "is missing, and the file has no binary GLB chunk" : "is missing");
    }
  } else {
    try {
      bytes = is_data_uri(uri.text()) ? decode_data_uri(uri.text(), memory) : folder.read_uri(uri.text(), memory);
    } catch (const Error& error) {
      uri.fail((is_data_uri(uri.text()) ? "" : quoted(uri.text(), 120) + ": ") + error.what());
    }
  }
  if (bytes.size < wanted)
    buffer.fail("byteLength", std::to_string(wanted) + " bytes are wanted, there are " + std::to_string(bytes.size));
  bytes.size = wanted;
  return bytes;
}

void Model::check_buffer_views() const {
  for (const Json json : buffer_views) {
    const std::size_t buffer_size = buffers[json["buffer"].index()].size;
    const auto offset = static_cast<std::uint64_t>(json["byteOffset"].integer(0)),
               length = static_cast<std::uint64_t>(json["byteLength"].integer(0));
    if (offset > buffer_size || length > buffer_size - offset) {
      json.fail(std::to_string(length) + " bytes from byte " + std::to_string(offset) + " on do not fit the buffer with its " +
                std::to_string(buffer_size) + " bytes");
    }
    const Json stride = json["byteStride"];
    if (stride && static_cast<std::uint64_t>(stride.integer(0)) > length)
      stride.fail(std::to_string(stride.integer(0)) + " is more than the view's " + std::to_string(length) + " bytes");
  }
}

ByteView Model::view(std::size_t buffer_view) const {
  const Json json = buffer_views[buffer_view];
  const ByteView buffer(buffers[json["buffer"].index()].span());
  return ByteView(buffer.part(json["byteOffset"].index(), json["byteLength"].index()));
}

}  // namespace ln::gltf
