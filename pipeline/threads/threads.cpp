#include "pipeline/threads/threads.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <new>
#include <vector>

#include "io/system/this_process.h"

namespace tagrid {

// What a thread of the pool does once: it waits in the arena of a Threads object, and does tasks meanwhile.
struct Threads::Others {
  explicit Others(oneapi::tbb::task_arena& of_threads) : arena(of_threads) {}
  ~Others() {
    std::unique_lock lock(mutex);
    for (oneapi::tbb::flow::graph& open : waits) open.release_wait();
    left.wait(lock, [&] { return inside == 0; });
  }
  Others(const Others&) = delete;
  Others& operator=(const Others&) = delete;

  bool add();

  // Called by a thread of the pool.
  void run() noexcept {
    try {
      arena.execute([&, &open = next_wait()] { open.wait_for_all(); });
    } catch (...) {
      // There is no memory for a thread to enter the arena: the other threads do its work.
    }
  }
  // Called by the same thread when it can already be given other work. It then leaves the object alone.
  void leave() noexcept {
    const std::lock_guard lock(mutex);
    --inside;
    left.notify_all();
  }

  oneapi::tbb::flow::graph& next_wait() {
    const std::lock_guard lock(mutex);
    return waits[taken++];
  }

  oneapi::tbb::task_arena& arena;
  /// Without nodes: waiting ends with this object. Each thread has its own, since a wait writes to it.
  std::deque<oneapi::tbb::flow::graph> waits;
  std::mutex mutex;
  std::condition_variable left;
  std::size_t taken = 0;
  int inside = 0;
};

// A pool of threads that wait for work. They never end, because a program that a thread has started ends with
// it (see io/programs/format_program.h). A forked process starts without threads.
struct Threads::Pool {
  // Runs `work` on a thread. Returns false if `most` threads work, or if the system gives no more.
  bool run(Others& work, int most);

  static Pool& instance();
  static void* wait_and_work(void* pool);

  std::mutex mutex;
  std::condition_variable called;
  std::vector<Others*> calls;  ///< that no thread has taken yet
  std::size_t idle = 0;        ///< threads that take a call, now or soon
  int busy = 0;                ///< threads that work, and calls

  // Never destroyed, as its threads wait in it until the process ends.
  static Pool* the_pool;
};

Threads::Pool* Threads::Pool::the_pool = nullptr;

Threads::Pool& Threads::Pool::instance() {
  static const bool is_made = [] {
    the_pool = new Pool;
    // Threads do not come along with a fork, and the lock may be held by one of them.
    call_after_fork([] { the_pool = new Pool; });
    return true;
  }();
  static_cast<void>(is_made);
  return *the_pool;
}

void* Threads::Pool::wait_and_work(void* given) {
  Pool& pool = *static_cast<Pool*>(given);
  for (;;) {
    Others* work = nullptr;
    {
      std::unique_lock lock(pool.mutex);
      pool.called.wait(lock, [&] { return !pool.calls.empty(); });
      work = pool.calls.back();
      pool.calls.pop_back();
      --pool.idle;
    }
    work->run();
    {
      const std::lock_guard lock(pool.mutex);
      ++pool.idle;
      --pool.busy;
    }
    work->leave();
  }
}

namespace {

// The limit for all objects of a process. A run may have threads in two arenas; one works at a time.
int most_others() {
  using Control = oneapi::tbb::global_control;
  const std::size_t allowed = Control::active_value(Control::max_allowed_parallelism);
  return 2 * static_cast<int>(std::min(allowed, std::size_t{1} << 16)) - 2;
}

}  // namespace

bool Threads::Pool::run(Others& work, int most) {
  const std::lock_guard lock(mutex);
  if (busy >= most) return false;
  try {
    calls.push_back(&work);
  } catch (const std::bad_alloc&) {
    return false;
  }
  if (calls.size() > idle) {
    if (!start_lasting_thread(wait_and_work, this)) {
      calls.pop_back();
      return false;
    }
    ++idle;
  }
  ++busy;
  called.notify_one();
  return true;
}

bool Threads::Others::add() {
  const std::lock_guard lock(mutex);
  try {
    // A graph waits in the arena in which it was made.
    arena.execute([&] { waits.emplace_back(); });
  } catch (const std::bad_alloc&) {
    return false;
  }
  waits.back().reserve_wait();
  if (!Pool::instance().run(*this, most_others())) {
    waits.back().release_wait();
    waits.pop_back();
    return false;
  }
  ++inside;
  return true;
}

Threads::Threads(int count) : arena_(count, static_cast<unsigned>(count)) {
  // Without memory for it, this throws. oneTBB would let a second try wait for ever.
  arena_.initialize();
  if (count == 1) return;
  others_ = std::make_unique<Others>(arena_);
  while (this->count() < count && others_->add()) {
  }
}

Threads::~Threads() = default;

int Threads::count() const { return others_ ? 1 + static_cast<int>(others_->waits.size()) : 1; }

}  // namespace tagrid
