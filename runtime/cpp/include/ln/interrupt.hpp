#pragma once
// Ctrl-C and SIGTERM: the first asks for an early end with a picture, the second ends the program at once.

#include <atomic>
#include <csignal>

namespace ln {

namespace detail {
extern std::atomic<int> interrupt_signal;  // 0: none so far
}

/// Installs the handlers. A signal that was ignored when the program started (nohup) stays ignored. Broken pipes and the
/// file size limit become errors of the write that meets them.
void install_interrupt_handlers();

/// True after the first SIGINT or SIGTERM; cheap enough to ask per pixel.
inline bool interrupt_requested() { return detail::interrupt_signal.load(std::memory_order_relaxed) != 0; }

}  // namespace ln
