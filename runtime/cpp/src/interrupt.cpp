#include "ln/interrupt.hpp"

namespace ln {

std::atomic<int> detail::interrupt_signal{0};

namespace {

static_assert(std::atomic<int>::is_always_lock_free, "the handler may touch lock-free atomics only");

void on_signal(int number) {
  if (detail::interrupt_signal.exchange(number) == 0) return;
  // The second one: end as if there were no handler.
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void handle_unless_ignored(int number) {
  struct sigaction present{};
  if (sigaction(number, nullptr, &present) == 0 && present.sa_handler == SIG_IGN) return;
  struct sigaction action{};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(number, &action, nullptr);
}

}  // namespace

void install_interrupt_handlers() {
  handle_unless_ignored(SIGINT);
  handle_unless_ignored(SIGTERM);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace ln
