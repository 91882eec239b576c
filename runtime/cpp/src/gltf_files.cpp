#include "gltf_files.hpp"

#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "ln/text.hpp"

namespace ln::gltf {

// ---------------------------------------------------------------- memory

MemoryBudget::MemoryBudget(std::uint64_t limit) : limit_(static_cast<double>(limit)) {
  if (limit == 0) limit_ = 0.5 * static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  rlimit address_space{};
  if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY) {
    limit_ = std::min(limit_, static_cast<double>(address_space.rlim_cur));
  }
}

void MemoryBudget::claim(double bytes, const std::string& what) {
  if (!(used_ + bytes <= limit_)) {
    const std::string besides = used_ > 0 ? " (" + bytes_text(used_) + " are in use)" : "";
    throw Error(what + " needs " + bytes_text(bytes) + " of memory" + besides + ", more than the limit of " +
                bytes_text(limit_));
  }
  used_ += bytes;
}

// ---------------------------------------------------------------- files

namespace {

/// An open file that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  operator int() const { return number_; }

 private:
  int number_;
};

/// Says what `path` is if it is not a regular file.
struct stat require_regular(int descriptor) {
  struct stat status{};
  if (fstat(descriptor, &status) != 0) throw Error(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw Error("is a folder, not a file");
  if (!S_ISREG(status.st_mode)) throw Error("is not a regular file");
  return status;
}

Bytes allocate(std::size_t size) { return {std::make_shared_for_overwrite<std::uint8_t[]>(size), size}; }

Bytes read_all(int descriptor, std::size_t size, MemoryBudget& memory) {
  memory.claim(static_cast<double>(size), "the file");
  Bytes bytes = allocate(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = read(descriptor, bytes.data.get() + done, std::min<std::size_t>(size - done, 1 << 30));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Error(std::strerror(errno));
    if (got == 0) break;  // it has become shorter meanwhile
    done += static_cast<std::size_t>(got);
  }
  bytes.size = done;
  return bytes;
}

/// Opens a relative path component by component, without following any symbolic link: for kernels without openat2.
int open_beneath_by_steps(int folder, const std::string& path, int flags) {
  auto at = std::make_unique<Descriptor>(dup(folder));
  for (std::size_t begin = 0;;) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    const std::string name = path.substr(begin, end - begin);
    if (name == "..") {
      errno = EXDEV;
      return -1;
    }
    const std::string component = name.empty() ? "." : name;
    if (end == path.size()) return openat(*at, component.c_str(), flags | O_NOFOLLOW);
    at = std::make_unique<Descriptor>(openat(*at, component.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (*at < 0) return -1;
    begin = end + 1;
  }
}

int open_beneath(int folder, const std::string& path, int flags) {
  open_how how{};
  how.flags = static_cast<std::uint64_t>(flags);
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  const long result = syscall(SYS_openat2, folder, path.c_str(), &how, sizeof how);
  if (result >= 0) return static_cast<int>(result);
  if (errno != ENOSYS && errno != EPERM && errno != EINVAL) return -1;
  return open_beneath_by_steps(folder, path, flags);
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Replaces %41 by A; a % that two digits do not follow stays.
std::string percent_decode(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escaped = text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0;
    out += escaped ? static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2])) : text[i];
    if (escaped) i += 2;
  }
  return out;
}

/// "http" of "http://x"; empty for a relative reference.
std::string_view uri_scheme(std::string_view uri) {
  const std::size_t end = uri.find_first_of(":/?#");
  if (end == std::string_view::npos || uri[end] != ':') return {};
  return uri.substr(0, end + 1);
}

}  // namespace

Bytes read_file(const std::string& path, MemoryBudget& memory) {
  try {
    // Not blocking: opening a FIFO must not wait for a writer.
    const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (file < 0) throw Error(errno == ENOENT ? "no such file" : std::strerror(errno));
    const auto status = require_regular(file);
    return read_all(file, static_cast<std::size_t>(status.st_size), memory);
  } catch (const Error& error) {
    throw Error(printable(path) + ": " + error.what());
  }
}

Folder::Folder(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  descriptor_ = open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) throw Error(printable(folder) + ": " + std::strerror(errno));
}

Folder::~Folder() { close(descriptor_); }

Bytes Folder::read_uri(std::string_view uri, MemoryBudget& memory) {
  const std::string_view scheme = uri_scheme(uri);
  const std::string path = percent_decode(uri);
  if (!scheme.empty()) throw Error("only files beside the model are read, not " + quoted(scheme, 20));
  if (path.empty()) throw Error("the name of the file is empty");
  if (path.find('\0') != std::string::npos) throw Error("the name of the file holds a zero byte");
  if (path.front() == '/') throw Error("is an absolute path; only files in the model's folder are read");

  // First without opening it: opening a device may have an effect.
  const Descriptor place(open_beneath(descriptor_, path, O_PATH | O_CLOEXEC));
  if (place < 0 && (errno == EXDEV || errno == ELOOP)) throw Error("leads out of the model's folder");
  if (place < 0) throw Error(errno == ENOENT ? "no such file" : std::strerror(errno));
  require_regular(place);

  const Descriptor file(open_beneath(descriptor_, path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (file < 0) throw Error(std::strerror(errno));
  const auto status = require_regular(file);
  Bytes& bytes = read_[{status.st_dev, status.st_ino}];
  if (bytes.data == nullptr) bytes = read_all(file, static_cast<std::size_t>(status.st_size), memory);
  return bytes;
}

// ---------------------------------------------------------------- data URIs

bool is_data_uri(std::string_view uri) { return uri.starts_with("data:"); }

namespace {

constexpr std::array<std::int8_t, 256> make_base64_values() {
  std::array<std::int8_t, 256> values{};
  values.fill(-1);
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kAlphabet.size(); ++i)
    values[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::int8_t>(i);
  return values;
}
constexpr auto kBase64Values = make_base64_values();

Bytes decode_base64(std::string_view text, MemoryBudget& memory) {
  for (int i = 0; i < 2 && text.ends_with('='); ++i) text.remove_suffix(1);
  if (text.size() % 4 == 1) throw Error("the base64 text is cut short");
  const std::size_t size = text.size() / 4 * 3 + text.size() % 4 * 3 / 4;
  memory.claim(static_cast<double>(size), "the data URI");
  Bytes bytes = allocate(size);
  std::uint32_t bits = 0;
  int held = 0;
  std::size_t out = 0;
  for (const char c : text) {
    const int value = kBase64Values[static_cast<unsigned char>(c)];
    if (value < 0) throw Error("the base64 text holds the character " + quoted({&c, 1}));
    bits = (bits << 6 | static_cast<std::uint32_t>(value)) & 0xffffff;
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes.data[out++] = static_cast<std::uint8_t>(bits >> held);
    }
  }
  return bytes;
}

}  // namespace

Bytes decode_data_uri(std::string_view uri, MemoryBudget& memory) {
  constexpr std::size_t kLongestHeader = 256;
  const std::size_t comma = uri.substr(0, kLongestHeader).find(',');
  if (comma == std::string_view::npos) throw Error("is not a data URI: the comma is missing");
  std::string_view header = uri.substr(5, comma - 5);
  const std::string_view data = uri.substr(comma + 1);

  // header: [type/subtype] {;attribute=value} [;base64]
  const bool is_base64 = header == "base64" || header.ends_with(";base64");
  if (is_base64) header.remove_suffix(std::min(header.size(), std::string_view(";base64").size()));
  for (std::size_t at = header.find(';'); at != std::string_view::npos;) {
    const std::size_t next = header.find(';', at + 1);
    const std::string_view parameter = header.substr(at + 1, next - at - 1);
    if (parameter.find('=') == std::string_view::npos)
      throw Error("is not a data URI: " + quoted(header, 60) + " has a parameter without '='");
    at = next;
  }
  if (is_base64) return decode_base64(data, memory);
  memory.claim(static_cast<double>(data.size()), "the data URI");
  const std::string decoded = percent_decode(data);
  Bytes bytes = allocate(decoded.size());
  std::copy(decoded.begin(), decoded.end(), bytes.data.get());
  return bytes;
}

// ---------------------------------------------------------------- GLB

namespace {

std::uint32_t little_endian(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] | bytes[at + 1] << 8 | bytes[at + 2] << 16 | static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

}  // namespace

bool is_glb(const Bytes& file) { return file.text().starts_with("glTF"); }

Glb split_glb(const Bytes& file) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
  auto bytes = file.span();
  if (!is_glb(file)) throw Error("is not a binary glTF file: it does not begin with \"glTF\"");
  if (bytes.size() < kHeader) throw Error("is cut short: the GLB header is not complete");
  const std::uint32_t version = little_endian(bytes, 4), length = little_endian(bytes, 8);
  if (version != 2) throw Error("is a GLB file of version " + std::to_string(version) + "; only 2 is supported");
  if (length > bytes.size())
    throw Error("is cut short: the GLB header says " + std::to_string(length) + " bytes, the file has " +
                std::to_string(bytes.size()));
  if (length < kHeader + kChunkHeader)
    throw Error("the GLB header says " + std::to_string(length) + " bytes, too few for any content");

  Glb glb;
  glb.has_extra_data = length < bytes.size();
  bytes = bytes.first(length);
  std::size_t at = kHeader;
  for (int chunk = 0; at < bytes.size(); ++chunk) {
    if (bytes.size() - at < kChunkHeader) throw Error("the header of GLB chunk " + std::to_string(chunk) + " is cut short");
    const std::uint32_t size = little_endian(bytes, at), type = little_endian(bytes, at + 4);
    at += kChunkHeader;
    if (size > bytes.size() - at)
      throw Error("GLB chunk " + std::to_string(chunk) + " says " + std::to_string(size) + " bytes, " +
                  std::to_string(bytes.size() - at) + " are left");
    const auto content = bytes.subspan(at, size);
    at += std::min<std::size_t>((static_cast<std::size_t>(size) + 3) / 4 * 4, bytes.size() - at);
    if (chunk == 0 && type != kJson) throw Error("the first GLB chunk is not JSON");
    if (chunk != 0 && type == kJson) throw Error("there is a second JSON chunk in the GLB file");
    if (chunk != 1 && type == kBinary) throw Error("the binary GLB chunk is not the second one");
    if (chunk == 0 && size == 0) throw Error("the JSON chunk of the GLB file is empty");
    if (chunk == 0) {
      glb.json = {reinterpret_cast<const char*>(content.data()), content.size()};
      // Some exporters fill up with zeros instead of blanks.
      while (glb.json.ends_with('\0')) glb.json.remove_suffix(1);
    }
    if (chunk == 1 && type == kBinary) {
      glb.binary = content;
      glb.has_binary = true;
    }
  }
  return glb;
}

}  // namespace ln::gltf
