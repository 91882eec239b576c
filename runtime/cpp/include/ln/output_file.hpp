#pragma once
// The one writer for all outputs: whoever opens the name finds the old file or the complete new one, never a part.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ln {

/// A file that appears under its name only when `commit` has succeeded. It is written under a temporary name in the same
/// folder, synchronised, closed with a check and renamed; the folder is synchronised too. All functions throw Error with the
/// path and the cause ("out/a.exr: cannot write: No space left on device"). Without `commit` nothing is left behind. A symbolic
/// link is followed. A device (/dev/null) is written in place.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Position of the next byte; it can be moved back to overwrite and forward again.
  std::uint64_t position() const { return position_; }
  void seek(std::uint64_t position);
  void commit();
  const std::string& path() const { return path_; }

 private:
  void flush();
  [[noreturn]] void fail(const char* action, int error_number);

  std::string path_;       // as the user gave it, for messages
  std::string target_;     // links followed
  std::string temporary_;  // empty: written in place
  int file_ = -1;
  std::uint64_t position_ = 0;
  std::uint64_t buffer_start_ = 0;
  std::vector<char> buffer_;
  int failed_ = 0;  // the first errno; later calls fail with it too
};

/// Writes a whole file with OutputFile.
void write_output_file(const std::string& path, std::string_view bytes);

/// Throws Error if a file of this name could not be written now: no such folder, it is a folder itself, no permission,
/// read-only. Asked before the work begins.
void check_output(const std::string& path);

/// True if both names lead to the same existing file, or are the same name in the same folder.
bool same_file(const std::string& a, const std::string& b);

}  // namespace ln
