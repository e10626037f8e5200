// Threads that wait for work, and live as long as the process.
#pragma once

namespace tagrid {

/// What a thread of the pool does once.
class PoolWork {
 public:
  virtual ~PoolWork() = default;
  /// Called by a thread of the pool.
  virtual void run() noexcept = 0;
  /// Called by the same thread afterwards, when it can already be given other work. It then leaves the object
  /// alone.
  virtual void leave() noexcept = 0;
};

/// Runs `work` on a waiting thread or on a new one. Returns false if the system cannot create more threads,
/// or if `most` threads of the pool are at work. Threads never end, because a program that a thread has
/// started ends with it (see io/programs/format_program.h). A forked process starts without threads.
bool run_in_pool(PoolWork& work, int most);

}  // namespace tagrid
