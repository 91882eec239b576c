#include "ln/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include "ln/error.hpp"
#include "ln/interrupt.hpp"
#include "ln/progress.hpp"

namespace ln {

namespace {

/// Worker that this thread is while it runs a body, -1 outside.
thread_local int present_worker = -1;

struct WorkerScope {
  explicit WorkerScope(int worker) { present_worker = worker; }
  ~WorkerScope() { present_worker = -1; }
};

}  // namespace

struct Workers::Pool {
  using Body = FunctionRef<void(int)>;

  std::mutex mutex;
  std::condition_variable work_ready, work_done;
  std::optional<Body> body;
  std::uint64_t generation = 0;  // counts calls of `run`
  int busy = 0;
  bool quitting = false;
  std::vector<std::exception_ptr> errors;  // of each worker
  std::vector<std::thread> threads;        // worker i + 1

  void work(int worker, const Body& task) {
    const WorkerScope scope(worker);
    try {
      task(worker);
    } catch (...) {
      errors[static_cast<std::size_t>(worker)] = std::current_exception();
    }
  }

  void serve(int worker) {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex);
    while (true) {
      work_ready.wait(lock, [&] { return quitting || generation != seen; });
      if (quitting) return;
      seen = generation;
      const Body task = *body;
      lock.unlock();
      work(worker, task);
      lock.lock();
      if (--busy == 0) work_done.notify_one();
    }
  }
};

Workers::Workers(int threads) : pool_(std::make_unique<Pool>()) {
  const auto wanted = static_cast<std::size_t>(std::max(threads, 1));
  pool_->errors.resize(wanted);
  pool_->threads.reserve(wanted - 1);
  for (std::size_t worker = 1; worker < wanted; ++worker) {
    try {
      pool_->threads.emplace_back([pool = pool_.get(), worker] { pool->serve(static_cast<int>(worker)); });
    } catch (const std::system_error&) {
      warning("the system grants only " + std::to_string(worker) + " of " + std::to_string(wanted) + " threads");
      break;
    }
  }
}

Workers::~Workers() {
  {
    const std::lock_guard lock(pool_->mutex);
    pool_->quitting = true;
  }
  pool_->work_ready.notify_all();
  for (std::thread& thread : pool_->threads) thread.join();
}

int Workers::count() const { return static_cast<int>(pool_->threads.size()) + 1; }

void Workers::run(FunctionRef<void(int worker)> body) {
  if (present_worker >= 0) return body(present_worker);
  {
    const std::lock_guard lock(pool_->mutex);
    pool_->body = body;
    pool_->busy = count() - 1;
    ++pool_->generation;
  }
  pool_->work_ready.notify_all();
  pool_->work(0, body);
  {
    std::unique_lock lock(pool_->mutex);
    pool_->work_done.wait(lock, [&] { return pool_->busy == 0; });
  }
  std::exception_ptr first;
  for (std::exception_ptr& error : pool_->errors) {
    if (error && !first) first = error;
    error = nullptr;
  }
  if (first) std::rethrow_exception(first);
}

void Workers::for_chunks(std::size_t n, std::size_t grain,
                         FunctionRef<void(std::size_t begin, std::size_t end, int worker)> body) {
  if (n == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = (n - 1) / grain + 1;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::size_t failed_chunk = std::numeric_limits<std::size_t>::max();
  std::exception_ptr error;

  const auto work = [&](int worker) {
    while (!stop.load(std::memory_order_relaxed) && !interrupt_requested()) {
      const std::size_t chunk = next.fetch_add(1, std::memory_order_relaxed);
      if (chunk >= chunks) return;
      try {
        body(chunk * grain, std::min(n, (chunk + 1) * grain), worker);
      } catch (...) {
        stop.store(true, std::memory_order_relaxed);
        const std::lock_guard lock(mutex);
        if (chunk < failed_chunk) {
          failed_chunk = chunk;
          error = std::current_exception();
        }
      }
      if (worker == 0) progress_heartbeat();
    }
  };
  if (chunks == 1 && present_worker < 0) {
    const WorkerScope scope(0);  // not worth waking the others
    work(0);
  } else {
    run(work);
  }
  if (error) std::rethrow_exception(error);
  if (next.load() < chunks) throw Interrupted{};
}

}  // namespace ln
