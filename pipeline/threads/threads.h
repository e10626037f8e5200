// The threads of a run, and the flow graphs on them.
//
// oneTBB schedules all work: tasks, arenas and flow graphs are its own. Only the threads are made here. oneTBB
// makes its threads while tasks run, and no arena, observer or global_control changes what follows from that
// (seen with oneTBB 2021.8):
// - If the system refuses a thread (ulimit -u, ulimit -v), oneTBB throws on a thread without a handler, which
//   ends the process. Here all threads are there before the work begins, and a run goes on with those it got.
// - In a forked process, such as those of Python's multiprocessing, oneTBB counts on threads that no longer
//   exist, and one thread does all the work. Here it has new ones.
// - Threads of oneTBB end with the last thread that used it, and a program ends with the thread that started it
//   (io/programs/format_program.h). Here threads never end.
// All slots of an arena are reserved for threads that enter it, so oneTBB sends none of its own.
#pragma once

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace tagrid {

/// Threads that carry out tasks of oneTBB: that of the caller, and others from a pool, which wait in the
/// arena until this object ends.
class Threads {
 public:
  /// `count` threads, the caller's included. They are fewer if the system gives no more, by its limits on
  /// processes or on memory, or if all objects of the process together would have more than twice those that
  /// oneTBB may have (max_allowed_parallelism). At least the caller's. REQUIRES: count > 0.
  explicit Threads(int count);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  /// Calls `work`. Tasks that it makes, and waits for, are carried out by all threads.
  template <class Work>
  void run(Work work) {
    arena_.execute(work);
  }
  int count() const;

 private:
  struct Others;
  struct Pool;

  oneapi::tbb::task_arena arena_;
  std::unique_ptr<Others> others_;
};

/// Bytes that are worth a task of their own.
inline constexpr std::size_t bytes_of_task = std::size_t{1} << 18;

/// Calls work(first, count) for stretches of `rows` rows of `row_bytes` bytes, on the threads of this arena that have
/// nothing else to do; each but the last has a multiple of `group` rows. The caller begins no other task meanwhile, as
/// others may wait for what it does. An exception ends it.
template <class Work>
void share_rows(std::int64_t rows, std::size_t row_bytes, std::int64_t group, const Work& work) {
  const std::size_t groups = bytes_of_task / (row_bytes * static_cast<std::size_t>(group));
  const std::int64_t each = group * std::max(static_cast<std::int64_t>(groups), std::int64_t{1});
  oneapi::tbb::this_task_arena::isolate([&] {
    oneapi::tbb::parallel_for(std::int64_t{0}, (rows + each - 1) / each,
                              [&](std::int64_t i) { work(i * each, std::min(each, rows - i * each)); });
  });
}

/// Starts a flow graph at `first` and waits for it. Throws the exceptions of its nodes. When this returns or
/// throws, no task of the graph runs or waits any more, so that its nodes can be destroyed.
template <class Graph, class InputNode>
void run_graph(Graph& graph, InputNode& first) {
  try {
    first.activate();
    graph.wait_for_all();
  } catch (...) {
    // The exception may not be that of a node: oneTBB itself allocates memory.
    graph.cancel();
    try {
      graph.wait_for_all();
    } catch (...) {
      // The first exception says what happened.
    }
    throw;
  }
}

}  // namespace tagrid
