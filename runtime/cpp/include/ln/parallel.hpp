#pragma once
// Work on all threads, with results that do not depend on how many there are.
//
// The range [0, n) is cut into chunks whose borders depend on `n` and the grain only. A body that writes to places of its own
// indices, or `reduce`, which combines in the order of chunks, gives the same bits for any number of threads.

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace ln {

/// A reference to something callable; it must outlive the call. No allocation, one indirect call.
template <class Signature>
class FunctionRef;

template <class Result, class... Arguments>
class FunctionRef<Result(Arguments...)> {
 public:
  template <class F>
    requires(!std::is_same_v<std::remove_cvref_t<F>, FunctionRef> && std::is_invocable_r_v<Result, F&, Arguments...>)
  FunctionRef(F&& function)  // implicit on purpose: pass a lambda or a function
      : object_(address(function)), call_([](void* object, Arguments... arguments) -> Result {
          using Pointer = std::add_pointer_t<std::remove_reference_t<F>>;
          if constexpr (std::is_function_v<std::remove_reference_t<F>>) {
            return reinterpret_cast<Pointer>(object)(std::forward<Arguments>(arguments)...);
          } else {
            return (*static_cast<Pointer>(object))(std::forward<Arguments>(arguments)...);
          }
        }) {}

  Result operator()(Arguments... arguments) const { return call_(object_, std::forward<Arguments>(arguments)...); }

 private:
  template <class F>
  static void* address(F& function) {
    if constexpr (std::is_function_v<F>) {
      return reinterpret_cast<void*>(&function);
    } else {
      return const_cast<void*>(static_cast<const void*>(std::addressof(function)));
    }
  }

  void* object_;
  Result (*call_)(void*, Arguments...);
};

/// A pool of threads that lives as long as the program runs. The calling thread is worker 0 and works too.
/// If the system refuses some threads, the pool is smaller.
class Workers {
 public:
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Number of workers, at least 1. Bodies are given a worker index in [0, count()) for scratch memory.
  int count() const;

  /// Calls `body(worker)` once on every worker and waits. Rethrows the exception of the lowest worker.
  /// From inside a body: runs on the calling worker alone.
  void run(FunctionRef<void(int worker)> body);

  /// Calls `body(begin, end, worker)` for each chunk of `grain` indices of [0, n) and waits. Chunks start in order. After an
  /// exception no further chunk starts, and that of the lowest chunk, always the same one, is rethrown. Throws Interrupted if
  /// the user asked to stop; then some chunks have not run. From inside a body: runs on the calling worker alone.
  void for_chunks(std::size_t n, std::size_t grain, FunctionRef<void(std::size_t begin, std::size_t end, int worker)> body);

  /// Calls `body(index)` for each index of [0, n), `grain` of them in a row.
  template <class Body>
  void parallel_for(std::size_t n, std::size_t grain, Body&& body) {
    for_chunks(n, grain, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    });
  }

  /// Combines `map(begin, end)` of all chunks from left to right, starting with `initial`.
  template <class T, class Map, class Combine>
  T reduce(std::size_t n, std::size_t grain, T initial, Map&& map, Combine&& combine) {
    if (n == 0) return initial;
    std::vector<T> parts((n - 1) / grain + 1, initial);
    for_chunks(n, grain, [&](std::size_t begin, std::size_t end, int) { parts[begin / grain] = map(begin, end); });
    for (T& part : parts) initial = combine(std::move(initial), std::move(part));
    return initial;
  }

 private:
  struct Pool;
  std::unique_ptr<Pool> pool_;
};

}  // namespace ln
