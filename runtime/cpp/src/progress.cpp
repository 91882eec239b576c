#include "ln/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>
#include <atomic>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "ln/stats.hpp"

namespace ln {

namespace {

constexpr double kBarInterval = 0.1, kJsonInterval = 0.5, kPlainInterval = 5;  // [s]

/// Guards the terminal and `present`. Recursive calls do not occur.
std::mutex mutex;
Progress* present = nullptr;
std::atomic<int> notes_off = 0;

/// Straight to the descriptor: nothing is buffered when a program ends in a hurry. What cannot be said is not said.
void put(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// Bytes of the well-formed UTF-8 character that `text` begins with, or 0; `code` is its code point.
std::size_t decode_utf8(std::string_view text, std::uint32_t& code) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])); };
  const std::uint32_t lead = byte(0);
  const std::size_t length = lead < 0x80 ? 1 : lead < 0xc2 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : lead < 0xf5 ? 4 : 0;
  if (length == 0 || length > text.size()) return 0;
  code = length == 1 ? lead : lead & (0x7fu >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3f);
  }
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kSmallest[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return 0;
  return length;
}

/// Controls, and what changes the direction or the lines of the text around it.
bool steers_terminal(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x061c || (code >= 0x200e && code <= 0x200f) ||
         (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
}

/// One harmless line. Text that is one already is left alone, so that escaping twice does no harm.
std::string one_line(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    std::uint32_t code = 0;
    const std::size_t length = decode_utf8(text, code);
    char escape[16];
    if (length == 0) {
      std::snprintf(escape, sizeof escape, "\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(text[0])));
      result += escape;
    } else if (code == '\n' || code == '\t') {
      result += code == '\n' ? "\\n" : "\\t";
    } else if (steers_terminal(code)) {
      std::snprintf(escape, sizeof escape, code < 0x100 ? "\\x%02x" : "\\u%04x", static_cast<unsigned>(code));
      result += escape;
    } else {
      result += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : one_line(text)) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string number(double value, int digits = 4) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

/// "0.42 s", "12 s", "3:07 min", "2:05 h".
std::string duration(double seconds) {
  char text[40];
  if (seconds < 9.95) {
    std::snprintf(text, sizeof text, "%.1f s", seconds);
  } else if (seconds < 119.5) {
    std::snprintf(text, sizeof text, "%.0f s", seconds);
  } else if (seconds < 2 * 3600) {
    const long whole = std::lround(seconds);
    std::snprintf(text, sizeof text, "%ld:%02ld min", whole / 60, whole % 60);
  } else {
    const long minutes = std::lround(std::min(seconds, 1e12) / 60);
    std::snprintf(text, sizeof text, "%ld:%02ld h", minutes / 60, minutes % 60);
  }
  return text;
}

int terminal_width() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

bool is_terminal() {
  const char* kind = std::getenv("TERM");
  return isatty(STDERR_FILENO) && kind && *kind && std::strcmp(kind, "dumb") != 0;
}

/// Seconds until the phase ends, below 0 if that cannot be told yet.
double seconds_left(double fraction, double elapsed) {
  return fraction > 0.001 && elapsed > 0.2 ? elapsed * (1 - std::min(fraction, 1.0)) / fraction : -1;
}

}  // namespace

void say(std::string_view kind, std::string_view message) {
  const std::lock_guard lock(mutex);
  if (present && present->form_ == Progress::Form::json) {
    put("{\"event\": " + quoted(kind) + ", \"message\": " + quoted(message) + "}\n");
    return;
  }
  if (present) present->clear_bar();
  put(one_line(std::string(kind) + ": " + std::string(message)) + "\n");
}

void note(std::string_view message) {
  if (notes_off == 0) say("note", message);
}
NotesOff::NotesOff() { ++notes_off; }
NotesOff::~NotesOff() { --notes_off; }

void warning(std::string_view message) { say("warning", message); }

void note_skipped(std::string_view node, std::string_view reason) {
  {
    const std::lock_guard lock(mutex);
    if (present && present->form_ == Progress::Form::json) {
      put("{\"event\": \"skipped\", \"node\": " + quoted(node) + ", \"reason\": " + quoted(reason) + "}\n");
      return;
    }
  }
  note(std::string(node) + ": skipped, " + std::string(reason));
}

void report_error(std::string_view program, std::string_view message) {
  {
    const std::lock_guard lock(mutex);
    if (present && present->form_ == Progress::Form::json) {
      put("{\"event\": \"error\", \"message\": " + quoted(message) + "}\n");
      return;
    }
  }
  say(std::string(program) + ": error", message);
}

void progress_heartbeat() {
  const std::unique_lock lock(mutex, std::try_to_lock);
  if (!lock || !present || !present->due()) return;
  present->show(wall_seconds());
}

Progress::Progress(ProgressMode mode)
    : form_(mode == ProgressMode::none    ? Form::none
            : mode == ProgressMode::json  ? Form::json
            : mode == ProgressMode::plain ? Form::plain
            : is_terminal()               ? Form::bar
                                          : Form::plain) {
  const std::lock_guard lock(mutex);
  present = this;
}

Progress::~Progress() {
  const std::lock_guard lock(mutex);
  clear_bar();
  if (present == this) present = nullptr;
}

void Progress::clear_bar() {
  if (bar_shown_) put("\r\x1b[K");
  bar_shown_ = false;
}

void Progress::phase(std::string_view name, std::string_view detail) {
  const std::lock_guard lock(mutex);
  const double now = wall_seconds();
  phase_ = name;
  detail_ = detail;
  state_ = {};
  phase_start_ = now;
  if (form_ == Form::json) {
    show(now);
  } else if (form_ == Form::bar) {
    next_update_ = now + kBarInterval;
    if (bar_shown_) show(now);
  } else {
    next_update_ = now + kPlainInterval;
  }
}

bool Progress::due() const { return form_ != Form::none && wall_seconds() >= next_update_.load(std::memory_order_relaxed); }

void Progress::update(const State& state) {
  const std::lock_guard lock(mutex);
  state_ = state;
  show(wall_seconds());
}

void Progress::show(double now) {
  const double elapsed = now - phase_start_;
  const double left = seconds_left(state_.fraction, elapsed);
  const bool known = state_.fraction >= 0;
  const double fraction = std::clamp(state_.fraction, 0.0, 1.0);
  if (form_ == Form::none) return;

  if (form_ == Form::json) {
    next_update_ = now + kJsonInterval;
    std::string line = "{\"event\": \"progress\", \"phase\": " + quoted(phase_);
    if (!detail_.empty()) line += ", \"node\": " + quoted(detail_);
    if (known) line += ", \"fraction\": " + number(fraction);
    if (state_.samples) line += ", \"samples\": " + std::to_string(*state_.samples);
    if (state_.error && std::isfinite(*state_.error)) line += ", \"error\": " + number(*state_.error);
    line += ", \"seconds\": " + number(elapsed);
    if (left >= 0) line += ", \"seconds_left\": " + number(left);
    put(line + "}\n");
    return;
  }

  std::string line = one_line(detail_.empty() ? phase_ : phase_ + " " + detail_);
  std::string facts = duration(elapsed);
  if (state_.samples) facts += ", " + std::to_string(*state_.samples) + (*state_.samples == 1 ? " sample" : " samples");
  if (state_.error && std::isfinite(*state_.error)) facts += ", error " + number(*state_.error, 2);
  if (left >= 0) facts += ", " + duration(left) + " left";
  char percent[16] = "";
  if (known) std::snprintf(percent, sizeof percent, "%3.0f%%", 100 * fraction);

  if (form_ == Form::plain) {
    next_update_ = now + kPlainInterval;
    put(line + (known ? std::string(percent) : "") + ": " + facts + "\n");
    return;
  }

  next_update_ = now + kBarInterval;
  if (known) {
    constexpr int kLength = 30;
    const int filled = static_cast<int>(std::lround(fraction * kLength));
    line += " [" + std::string(static_cast<std::size_t>(filled), '#') +
            std::string(static_cast<std::size_t>(kLength - filled), '-') + "] " + percent;
  }
  line += "  " + facts;
  const auto width = static_cast<std::size_t>(std::max(terminal_width() - 1, 10));
  if (line.size() > width) line.resize(width);
  put("\r" + line + "\x1b[K");
  bar_shown_ = true;
}

void Progress::finish(std::string_view summary) {
  const std::lock_guard lock(mutex);
  clear_bar();
  phase_.clear();
  if (form_ == Form::none) return;
  if (form_ == Form::json) {
    put("{\"event\": \"done\", \"message\": " + quoted(summary) + ", \"seconds\": " + number(seconds_since_start()) + "}\n");
  } else {
    put(one_line(summary) + "\n");
  }
}

}  // namespace ln
