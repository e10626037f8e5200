// The threads of a run.
#pragma once

#include <oneapi/tbb/task_arena.h>

#include <memory>

namespace tagrid {

/// Threads that carry out tasks of oneTBB: that of the caller, and others from a pool.
///
/// oneTBB makes its own threads when it first needs them, while tasks run. If the system refuses one then, the process is
/// lost: the exception leaves a thread that nobody watches, or half of a flow graph. So no thread of oneTBB is used: each of
/// these threads waits in the arena for something that ends with this object, and carries out tasks meanwhile.
class Threads {
 public:
  /// `count` threads, the caller's included. They are fewer if the system gives no more, by its limits on processes or on
  /// memory, or if all objects of the process together would have more than twice those that oneTBB may have
  /// (max_allowed_parallelism). At least the caller's. REQUIRES: count > 0.
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

  oneapi::tbb::task_arena arena_;
  std::unique_ptr<Others> others_;
};

}  // namespace tagrid
