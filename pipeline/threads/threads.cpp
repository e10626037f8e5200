#include "pipeline/threads/threads.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_group.h>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "pipeline/threads/pool.h"

namespace tagrid {
namespace {

using Context = oneapi::tbb::task_group_context;

// The limit for all objects of this process. A run may have threads in two arenas, of which one works at a
// time.
int most_others() {
  using Control = oneapi::tbb::global_control;
  const std::size_t allowed = Control::active_value(Control::max_allowed_parallelism);
  return 2 * static_cast<int>(std::min(allowed, std::size_t{1} << 16)) - 2;
}

}  // namespace

struct Threads::Others final : PoolWork {
  explicit Others(oneapi::tbb::task_arena& of_threads) : arena(of_threads) { open.reserve_wait(); }
  ~Others() override {
    open.release_wait();
    std::unique_lock lock(mutex);
    left.wait(lock, [&] { return inside == 0; });
  }
  Others(const Others&) = delete;
  Others& operator=(const Others&) = delete;

  bool add() {
    const std::lock_guard lock(mutex);
    if (!run_in_pool(*this, most_others())) return false;
    ++inside;
    ++count;
    return true;
  }

  void run() noexcept override {
    try {
      arena.execute([&] { open.wait_for_all(); });
    } catch (...) {
      // There is no memory for a thread to enter the arena: the other threads do its work.
    }
  }
  void leave() noexcept override {
    const std::lock_guard lock(mutex);
    --inside;
    left.notify_all();
  }

  oneapi::tbb::task_arena& arena;
  Context context{Context::isolated, Context::default_traits | Context::concurrent_wait};
  oneapi::tbb::flow::graph open{context};  ///< without nodes; waiting for it ends with this object
  std::mutex mutex;
  std::condition_variable left;
  int inside = 0, count = 0;
};

Threads::Threads(int count) : arena_(count, static_cast<unsigned>(count)) {
  if (count == 1) return;
  // A graph waits in the arena in which it was made.
  arena_.execute([&] { others_ = std::make_unique<Others>(arena_); });
  while (this->count() < count && others_->add()) {
  }
}

Threads::~Threads() = default;

int Threads::count() const { return others_ ? 1 + others_->count : 1; }

}  // namespace tagrid
