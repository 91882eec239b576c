#include "ln/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <system_error>

#include "ln/error.hpp"

namespace ln {

namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 20;

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

std::string name_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

/// The path without symbolic links, or as it is where that cannot be told.
std::string real_path(const std::string& path) {
  const std::unique_ptr<char, decltype(&std::free)> resolved(::realpath(path.c_str(), nullptr), &std::free);
  return resolved ? resolved.get() : path;
}

/// What a user can do about it.
std::string advice(int error_number) {
  switch (error_number) {
    case EACCES:
    case EPERM:
    case EROFS: return "; write to a folder where you may, or change its permissions";
    case ENOSPC:
    case EDQUOT: return "; make room there or write elsewhere";
    case EFBIG: return "; the limit for file sizes (ulimit -f) is too low";
    case ENOTDIR: return "; a part of the path is not a folder";
    case ENAMETOOLONG: return "; choose a shorter name";
    default: return "";
  }
}

[[noreturn]] void throw_output_error(const std::string& path, const std::string& action, int error_number) {
  throw Error(path + ": cannot " + action + ": " + std::generic_category().message(error_number) + advice(error_number));
}

/// Where the bytes of `path` go.
struct Target {
  std::string path;       // links followed
  bool in_place = false;  // a device
  bool exists = false;
  mode_t mode = 0;
};

/// Throws Error for what is neither a file nor a device that takes bytes.
Target find_target(const std::string& path) {
  if (path.empty()) throw Error("an output has no name");
  struct stat status{};
  if (path.back() == '/') throw Error(path + ": cannot write: this is a folder; name a file in it");
  if (::stat(path.c_str(), &status) != 0) {
    if (errno != ENOENT) throw_output_error(path, "write", errno);
    const std::string folder = folder_of(path);
    if (::stat(folder.c_str(), &status) != 0) {
      if (errno == ENOENT) throw Error(path + ": cannot write: there is no folder '" + folder + "'; make it first");
      throw_output_error(path, "write", errno);
    }
    return {path};
  }
  if (S_ISDIR(status.st_mode)) throw Error(path + ": cannot write: this is a folder; name a file in it");
  if (S_ISCHR(status.st_mode)) return {path, true, true, status.st_mode};
  if (!S_ISREG(status.st_mode)) throw Error(path + ": cannot write: this is not an ordinary file");
  return {real_path(path), false, true, status.st_mode};
}

std::string random_suffix() {
  static constexpr char kLetters[] = "abcdefghijklmnopqrstuvwxyz0123456789";
  std::random_device random;
  std::string suffix(8, ' ');
  for (char& c : suffix) c = kLetters[random() % 36];
  return suffix;
}

/// Creates a file of a new name beside `target`. Returns -1 with errno where that fails.
int create_temporary(const std::string& target, std::string& temporary) {
  constexpr std::size_t kNamePart = 200;  // of the 255 bytes that a name may have
  for (int attempt = 0;; ++attempt) {
    temporary = folder_of(target) + "/." + name_of(target).substr(0, kNamePart) + "." + random_suffix() + ".tmp";
    const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0 || errno != EEXIST || attempt == 100) return file;
  }
}

/// Makes the rename durable. Some file systems cannot do it, which is no error of the file.
int synchronise_folder(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return 0;
  const int result = ::fsync(file) != 0 && errno == EIO ? EIO : 0;
  ::close(file);
  return result;
}

}  // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  const Target target = find_target(path_);
  target_ = target.path;
  if (target.in_place) {
    file_ = ::open(target_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  } else {
    file_ = create_temporary(target_, temporary_);
  }
  if (file_ < 0) {
    const int error_number = errno;
    temporary_.clear();
    throw_output_error(path_, "write", error_number);
  }
  if (target.exists && !target.in_place) (void)!::fchmod(file_, target.mode & 07777);
  buffer_.reserve(kBufferSize);
}

OutputFile::~OutputFile() {
  if (file_ >= 0) ::close(file_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void OutputFile::fail(const char* action, int error_number) {
  failed_ = error_number;
  throw_output_error(path_, action, error_number);
}

void OutputFile::write(const void* data, std::size_t size) {
  if (failed_) fail("write", failed_);
  if (size == 0) return;  // `data` may be null then
  const char* bytes = static_cast<const char*>(data);
  if (buffer_.size() + size > kBufferSize) flush();
  buffer_.insert(buffer_.end(), bytes, bytes + size);
  position_ += size;
}

void OutputFile::seek(std::uint64_t position) {
  if (position == position_) return;
  flush();
  position_ = buffer_start_ = position;
}

void OutputFile::flush() {
  if (failed_) fail("write", failed_);
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t written =
        ::pwrite(file_, buffer_.data() + done, buffer_.size() - done, static_cast<off_t>(buffer_start_ + done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("write", written < 0 ? errno : EIO);
    done += static_cast<std::size_t>(written);
  }
  buffer_start_ += buffer_.size();
  buffer_.clear();
}

void OutputFile::commit() {
  flush();
  const bool in_place = temporary_.empty();
  if (::fsync(file_) != 0 && !(in_place && errno != EIO && errno != ENOSPC)) fail("write", errno);
  const int file = file_;
  file_ = -1;
  if (::close(file) != 0 && errno != EINTR) fail("write", errno);
  if (in_place) return;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail("rename the finished file", errno);
  temporary_.clear();
  if (const int error_number = synchronise_folder(folder_of(target_))) fail("write", error_number);
}

void write_output_file(const std::string& path, std::string_view bytes) {
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

void check_output(const std::string& path) { const OutputFile file(path); }

bool same_file(const std::string& a, const std::string& b) {
  struct stat status_a{}, status_b{};
  const bool have_a = ::stat(a.c_str(), &status_a) == 0, have_b = ::stat(b.c_str(), &status_b) == 0;
  if (have_a != have_b) return false;
  if (have_a) return status_a.st_dev == status_b.st_dev && status_a.st_ino == status_b.st_ino && !S_ISCHR(status_a.st_mode);
  return name_of(a) == name_of(b) && real_path(folder_of(a)) == real_path(folder_of(b));
}

}  // namespace ln
