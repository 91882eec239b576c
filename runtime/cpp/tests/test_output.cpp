// Every way in which writing can fail or be cut short leaves the old file or the complete new one, and nothing else.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "ln/error.hpp"
#include "ln/exr_film.hpp"
#include "ln/film.hpp"
#include "ln/output_file.hpp"
#include "ln/preview.hpp"
#include "ln/program.hpp"

// The system calls that a file's way to the disk consists of, counted; the k-th one fails, or the process dies in its place.
namespace faults {
int calls = 0;
int fail_at = 0;  // 0: never
int error = 0;    // 0: die
bool hit() {
  if (fail_at == 0 || ++calls != fail_at) return false;
  if (error == 0) kill(getpid(), SIGKILL);
  errno = error;
  return true;
}
void arm(int at, int error_number) { calls = 0, fail_at = at, error = error_number; }
void disarm() { fail_at = 0; }
}  // namespace faults

extern "C" {
ssize_t pwrite(int file, const void* data, size_t size, off_t offset) {
  if (faults::hit()) return -1;
  return syscall(SYS_pwrite64, file, data, size, offset);
}
int fsync(int file) { return faults::hit() ? -1 : static_cast<int>(syscall(SYS_fsync, file)); }
int rename(const char* from, const char* to) noexcept {
  return faults::hit() ? -1 : static_cast<int>(syscall(SYS_rename, from, to));
}
int close(int file) {
  const bool fail = faults::hit();  // the descriptor is gone even if close fails
  const int error_number = errno;
  const int result = static_cast<int>(syscall(SYS_close, file));
  if (!fail) return result;
  errno = error_number;
  return -1;
}
}

namespace {

using namespace ln;
namespace fs = std::filesystem;

struct Folder {
  fs::path path = make();
  ~Folder() {
    fs::permissions(path, fs::perms::owner_all);
    fs::remove_all(path);
  }
  std::string file(const char* name) const { return (path / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }

  static fs::path make() {
    std::string name = (fs::temp_directory_path() / "ln_output_XXXXXX").string();
    REQUIRE(mkdtemp(name.data()));
    return name;
  }
};

std::string read(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The message of the Error that `action` throws, or an empty string.
std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Runs `action` in a child; returns what waitpid says.
int in_child(const std::function<void()>& action) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    int status = 0;
    try {
      action();
    } catch (const Error&) {
      status = 1;
    } catch (...) {
      status = 2;
    }
    _exit(status);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return status;
}

std::unique_ptr<Film> small_film() {
  auto film = std::make_unique<Film>(300, 200);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 300; ++x) film->add(x, y, 0, Color(static_cast<float>(x * y) * 0.7f, 1, 2));
  }
  return film;
}

const ProgramInfo kProgram{"test", "test.ln", "LDE"};

TEST_CASE("a new file, an old one replaced, and seeks back") {
  const Folder folder;
  const std::string path = folder.file("a.bin");
  write_output_file(path, "first");
  CHECK(read(path) == "first");
  OutputFile file(path);
  file.write("0123456789");
  file.seek(2);
  file.write("AB");
  file.seek(12);
  file.write("x");
  CHECK(read(path) == "first");
  file.commit();
  CHECK(read(path) == std::string("01AB456789\0\0x", 13));
  CHECK(folder.entries() == 1);

  const std::string large(5'000'001, 'y');
  write_output_file(path, large);
  CHECK(read(path) == large);
  write_output_file(path, "");
  CHECK(read(path).empty());
}

TEST_CASE("without commit nothing changes") {
  const Folder folder;
  write_output_file(folder.file("a"), "old");
  {
    OutputFile file(folder.file("a"));
    file.write(std::string(3'000'000, 'x'));
  }
  check_output(folder.file("a"));
  check_output(folder.file("b"));
  CHECK(read(folder.file("a")) == "old");
  CHECK(folder.entries() == 1);
}

TEST_CASE("permissions of a new file follow the umask, those of an old one stay") {
  const Folder folder;
  const mode_t mask = umask(022);
  write_output_file(folder.file("a"), "1");
  CHECK((fs::status(folder.file("a")).permissions() & fs::perms::mask) == fs::perms(0644));
  chmod(folder.file("a").c_str(), 0600);
  write_output_file(folder.file("a"), "2");
  CHECK((fs::status(folder.file("a")).permissions() & fs::perms::mask) == fs::perms(0600));
  umask(mask);
}

TEST_CASE("a symbolic link is followed, not replaced") {
  const Folder folder;
  fs::create_directory(folder.path / "real");
  write_output_file(folder.file("real/a"), "old");
  fs::create_symlink("real/a", folder.path / "link");
  write_output_file(folder.file("link"), "new");
  CHECK(fs::is_symlink(folder.path / "link"));
  CHECK(read(folder.file("real/a")) == "new");
}

TEST_CASE("names that cannot be written are refused with path and cause") {
  const Folder folder;
  write_output_file(folder.file("a"), "old");
  const auto refusal = [](const std::string& path) {
    const std::string message = error_of([&] { check_output(path); });
    CHECK(message == error_of([&] { write_output_file(path, "x"); }));
    CHECK(contains(message, path));
    return message;
  };
  CHECK(contains(refusal(folder.path.string()), "this is a folder"));
  CHECK(contains(refusal(folder.path.string() + "/"), "this is a folder"));
  CHECK(contains(refusal(folder.file("none/a")), "there is no folder"));
  CHECK(contains(refusal(folder.file("a/b")), "not a folder"));
  CHECK(contains(refusal(folder.file(std::string(300, 'n').c_str())), "shorter"));
  CHECK(contains(refusal(""), "no name"));
  REQUIRE(mkfifo(folder.file("pipe").c_str(), 0600) == 0);
  CHECK(contains(refusal(folder.file("pipe")), "not an ordinary file"));
  CHECK(folder.entries() == 2);
  // The longest name that a file may have.
  CHECK_NOTHROW(write_output_file(folder.file(std::string(255, 'n').c_str()), "x"));
}

TEST_CASE("a folder without permission") {
  const Folder folder;
  write_output_file(folder.file("a"), "old");
  fs::permissions(folder.path, fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read | fs::perms::others_exec);
  const int status = in_child([&] {
    constexpr uid_t kNobody = 65534;
    if (geteuid() == 0 && setuid(kNobody) != 0) _exit(3);
    const std::string message = error_of([&] { check_output(folder.file("a")); });
    if (!contains(message, "Permission denied") || !contains(message, folder.file("a"))) _exit(4);
    write_output_file(folder.file("a"), "new");
  });
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 1);
  CHECK(read(folder.file("a")) == "old");
}

TEST_CASE("devices are written in place") {
  CHECK_NOTHROW(write_output_file("/dev/null", std::string(3'000'000, 'x')));
  CHECK(contains(error_of([] { write_output_file("/dev/full", "x"); }), "/dev/full: cannot write: No space left on device"));
  CHECK(fs::is_character_file("/dev/null"));
  CHECK(contains(error_of([] { write_exr("/dev/full", *small_film(), kProgram, {}, 1); }), "No space left"));
}

TEST_CASE("the limit of file sizes") {
  const Folder folder;
  const int status = in_child([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) _exit(3);
    const std::string message = error_of([&] { write_exr(folder.file("a.exr"), *small_film(), kProgram, {}, 1); });
    if (!contains(message, "a.exr: cannot write: File too large")) _exit(4);
    write_output_file(folder.file("a"), std::string(100'001, 'x'));
  });
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 1);
  CHECK(folder.entries() == 0);
}

TEST_CASE("a full disk") {
  const Folder folder;
  const int status = in_child([&] {
    // A tiny disk of our own, where the system lets us have one.
    constexpr int kNotPermitted = 77;
    if (unshare(CLONE_NEWNS) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) _exit(kNotPermitted);
    mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (mount("tmpfs", folder.path.c_str(), "tmpfs", 0, "size=64k") != 0) _exit(kNotPermitted);
    write_output_file(folder.file("a"), "old");
    const std::string message = error_of([&] { write_exr(folder.file("a"), *small_film(), kProgram, {}, 2); });
    if (!contains(message, "No space left on device")) _exit(4);
    if (read(folder.file("a")) != "old" || folder.entries() != 1) _exit(5);
  });
  REQUIRE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77) {
    MESSAGE("not tested: mounting is not permitted here");
  } else {
    CHECK(WEXITSTATUS(status) == 0);
  }
}

/// Fails each system call in turn; the file must be old or complete, and alone in its folder.
void check_all_faults(int error_number, const std::function<void(const std::string&)>& write) {
  const Folder folder;
  const std::string path = folder.file("a");
  write(path);
  const std::string complete = read(path);
  REQUIRE(!complete.empty());
  int failures = 0;
  for (int at = 1;; ++at) {
    write_output_file(path, "old");
    bool reached = false;
    std::string message;
    if (error_number == 0) {
      const int status = in_child([&] {
        faults::arm(at, 0);
        write(path);
      });
      reached = WIFSIGNALED(status);
    } else {
      faults::arm(at, error_number);
      message = error_of([&] { write(path); });
      reached = faults::calls >= at;
      faults::disarm();
      CHECK(folder.entries() == 1);
    }
    const std::string now = read(path);
    CHECK((now == "old" || now == complete));
    if (!reached) {
      CHECK(now == complete);
      break;
    }
    if (now == "old") ++failures;
    if (error_number != 0 && now == "old") CHECK(contains(message, path));
  }
  CHECK(failures >= 4);  // write, fsync, close, rename
}

TEST_CASE("an error of any system call") {
  const std::string text(3'500'000, 'z');
  for (const int error_number : {EIO, ENOSPC, EDQUOT}) {
    check_all_faults(error_number, [&](const std::string& path) { write_output_file(path, text); });
    check_all_faults(error_number, [&](const std::string& path) { write_exr(path, *small_film(), kProgram, {}, 1); });
    check_all_faults(error_number, [&](const std::string& path) { write_preview(path, *small_film()); });
  }
}

TEST_CASE("death at any system call") {
  const std::string text(3'500'000, 'z');
  check_all_faults(0, [&](const std::string& path) { write_output_file(path, text); });
  check_all_faults(0, [&](const std::string& path) { write_exr(path, *small_film(), kProgram, {}, 1); });
}

TEST_CASE("a reader sees complete files only, also when the writer is killed") {
  const Folder folder;
  const std::string path = folder.file("a");
  const std::string a(700'000, 'a'), b(900'000, 'b');
  write_output_file(path, a);
  for (int round = 0; round < 20; ++round) {
    const pid_t writer = fork();
    REQUIRE(writer >= 0);
    if (writer == 0) {
      for (int i = 0;; ++i) write_output_file(path, i % 2 ? a : b);
    }
    for (int look = 0; look < 5 + round; ++look) {
      const std::string now = read(path);
      REQUIRE((now == a || now == b));
    }
    kill(writer, SIGKILL);
    waitpid(writer, nullptr, 0);
    const std::string now = read(path);
    REQUIRE((now == a || now == b));
  }
}

TEST_CASE("same_file") {
  const Folder folder;
  write_output_file(folder.file("a"), "x");
  fs::create_symlink("a", folder.path / "link");
  CHECK(same_file(folder.file("a"), folder.file("link")));
  CHECK(same_file(folder.file("a"), folder.path.string() + "/./a"));
  CHECK(same_file(folder.file("new"), folder.path.string() + "/./new"));
  CHECK(!same_file(folder.file("a"), folder.file("b")));
  CHECK(!same_file("/dev/null", "/dev/null"));
}

}  // namespace
