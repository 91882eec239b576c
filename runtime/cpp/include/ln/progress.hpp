#pragma once
// Everything that a program says while it runs, on standard error.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "ln/options.hpp"

namespace ln {

/// "note: ..." and "warning: ..." on standard error (a JSON line with --progress json). Safe from any thread; a bar on the
/// terminal is not torn. Control characters, bidirectional overrides and bytes that are not UTF-8 are escaped here, at the last
/// moment: whatever a file holds, it cannot steer a terminal, and a message stays one line.
void note(std::string_view message);
void warning(std::string_view message);

/// While one exists, nothing is noted: for work that is done again and again.
class NotesOff {
 public:
  NotesOff();
  ~NotesOff();
  NotesOff(const NotesOff&) = delete;
  NotesOff& operator=(const NotesOff&) = delete;
};

/// "note: caustic: skipped, REASON"; with --progress json an event of its own.
void note_skipped(std::string_view node, std::string_view reason);

/// The last line of a program that failed: "network: error: ...".
void report_error(std::string_view program, std::string_view message);

/// Refreshes what the present Progress shows, if it is time for that. Long loops of the calling thread call it (Workers do).
void progress_heartbeat();

/// A bar on a terminal, plain lines at most every few seconds elsewhere, JSON lines on request. One at a time.
class Progress {
 public:
  explicit Progress(ProgressMode mode);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Begins a phase: load, build, prepare (with the node's name as detail), render, write.
  void phase(std::string_view name, std::string_view detail = {});

  struct State {
    double fraction = -1;                  // of the phase; below 0: unknown
    std::optional<std::uint32_t> samples;  // per pixel so far
    std::optional<double> error;           // estimated relMSE
  };
  /// True if it is time for an update; cheap, from any thread.
  bool due() const;
  void update(const State& state);

  /// Ends the bar and prints the last line.
  void finish(std::string_view summary);

 private:
  void clear_bar();
  void show(double now);

  enum class Form : std::uint8_t { bar, plain, json, none };
  friend void say(std::string_view kind, std::string_view message);
  friend void note_skipped(std::string_view node, std::string_view reason);
  friend void report_error(std::string_view program, std::string_view message);
  friend void progress_heartbeat();

  Form form_;
  bool bar_shown_ = false;
  std::string phase_, detail_;
  State state_;
  double phase_start_ = 0;
  std::atomic<double> next_update_{0};
};

}  // namespace ln
