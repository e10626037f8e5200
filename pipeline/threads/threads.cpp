#include "pipeline/threads/threads.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <new>

#include "pipeline/threads/pool.h"

namespace tagrid {
namespace {

// The limit for all objects of this process. A run may have threads in two arenas, of which one works at a
// time.
int most_others() {
  using Control = oneapi::tbb::global_control;
  const std::size_t allowed = Control::active_value(Control::max_allowed_parallelism);
  return 2 * static_cast<int>(std::min(allowed, std::size_t{1} << 16)) - 2;
}

}  // namespace

struct Threads::Others final : PoolWork {
  explicit Others(oneapi::tbb::task_arena& of_threads) : arena(of_threads) {}
  ~Others() override {
    std::unique_lock lock(mutex);
    for (oneapi::tbb::flow::graph& open : waits) open.release_wait();
    left.wait(lock, [&] { return inside == 0; });
  }
  Others(const Others&) = delete;
  Others& operator=(const Others&) = delete;

  bool add() {
    const std::lock_guard lock(mutex);
    try {
      // A graph waits in the arena in which it was made.
      arena.execute([&] { waits.emplace_back(); });
    } catch (const std::bad_alloc&) {
      return false;
    }
    waits.back().reserve_wait();
    if (!run_in_pool(*this, most_others())) {
      waits.back().release_wait();
      waits.pop_back();
      return false;
    }
    ++inside;
    return true;
  }

  void run() noexcept override {
    try {
      arena.execute([&, &open = next_wait()] { open.wait_for_all(); });
    } catch (...) {
      // There is no memory for a thread to enter the arena: the other threads do its work.
    }
  }
  void leave() noexcept override {
    const std::lock_guard lock(mutex);
    --inside;
    left.notify_all();
  }

  oneapi::tbb::flow::graph& next_wait() {
    const std::lock_guard lock(mutex);
    return waits[taken++];
  }

  oneapi::tbb::task_arena& arena;
  /// Without nodes: waiting for one ends with this object. Each thread has its own, since a wait writes to it.
  std::deque<oneapi::tbb::flow::graph> waits;
  std::mutex mutex;
  std::condition_variable left;
  std::size_t taken = 0;
  int inside = 0;
};

Threads::Threads(int count) : arena_(count, static_cast<unsigned>(count)) {
  if (count == 1) return;
  others_ = std::make_unique<Others>(arena_);
  while (this->count() < count && others_->add()) {
  }
}

Threads::~Threads() = default;

int Threads::count() const { return others_ ? 1 + static_cast<int>(others_->waits.size()) : 1; }

}  // namespace tagrid
