// Threads that wait for work, and live as long as the process.
#pragma once

namespace tagrid {

/// What a thread of the pool does once.
class PoolWork {
 public:
  virtual ~PoolWork() = default;
  /// Called by a thread of the pool.
  virtual void run() noexcept = 0;
  /// Called by the same thread afterwards, when it can already be given other work. It then leaves the object alone.
  virtual void leave() noexcept = 0;
};

/// Lets a thread that waits run `work`, or makes one; false if the system gives no more threads, or if `most`
/// threads of the pool are at work. Threads are never ended: a program that one of them has started ends with
/// it (see io/programs/format_program.h). In a process that was forked, there are none at first.
bool run_in_pool(PoolWork& work, int most);

}  // namespace tagrid
