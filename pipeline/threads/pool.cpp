#include "pipeline/threads/pool.h"

#include <pthread.h>
#include <sys/mman.h>

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

namespace tagrid {
namespace {

// As much as oneTBB gives its own threads, and assumes that others have. The guard below it is not accessible.
constexpr std::size_t stack_bytes = std::size_t{4} << 20, guard_bytes = std::size_t{1} << 16;

struct Waiter {
  std::mutex mutex;
  std::condition_variable called;
  PoolWork* work = nullptr;

  void call(PoolWork& next) {
    const std::lock_guard lock(mutex);
    work = &next;
    called.notify_one();
  }
};

struct Pool {
  std::mutex mutex;
  std::vector<Waiter*> waiting;
  std::size_t all = 0;
  int busy = 0;
};

// Never destroyed, as its threads wait in it until the process ends.
Pool* the_pool = nullptr;

Pool& pool() {
  static const bool is_made = [] {
    the_pool = new Pool;
    // Threads do not come along with a fork, and the lock may be held by one of them.
    pthread_atfork(nullptr, nullptr, [] { the_pool = new Pool; });
    return true;
  }();
  static_cast<void>(is_made);
  return *the_pool;
}

// Not a stack of the C library, which a forked process gives to its next threads: lists of oneTBB lead
// through the stacks of threads that slept when the process was forked.
void* map_stack() {
  void* mapped = mmap(nullptr, guard_bytes + stack_bytes, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
  if (mapped == MAP_FAILED) return nullptr;
  if (mprotect(mapped, guard_bytes, PROT_NONE) == 0) return mapped;
  munmap(mapped, guard_bytes + stack_bytes);
  return nullptr;
}

void* wait_and_work(void* given) {
  auto* self = static_cast<Waiter*>(given);
  for (;;) {
    PoolWork* work = nullptr;
    {
      std::unique_lock lock(self->mutex);
      self->called.wait(lock, [&] { return self->work != nullptr; });
      work = self->work;
      self->work = nullptr;
    }
    work->run();
    {
      Pool& others = pool();
      const std::lock_guard lock(others.mutex);
      others.waiting.push_back(self);  // there is room
      --others.busy;
    }
    work->leave();
  }
}

bool start(Waiter& waiter) {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return false;
  void* const mapped = map_stack();
  pthread_t thread;
  const bool made =
      mapped != nullptr &&
      pthread_attr_setstack(&attributes, static_cast<std::byte*>(mapped) + guard_bytes, stack_bytes) == 0 &&
      pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED) == 0 &&
      pthread_create(&thread, &attributes, wait_and_work, &waiter) == 0;
  pthread_attr_destroy(&attributes);
  if (!made && mapped != nullptr) munmap(mapped, guard_bytes + stack_bytes);
  return made;
}

}  // namespace

bool run_in_pool(PoolWork& work, int most) {
  Pool& all = pool();
  const std::lock_guard lock(all.mutex);
  if (all.busy >= most) return false;
  if (!all.waiting.empty()) {
    all.waiting.back()->call(work);
    all.waiting.pop_back();
    ++all.busy;
    return true;
  }
  try {
    all.waiting.reserve(all.all + 1);
    auto waiter = std::make_unique<Waiter>();
    waiter->work = &work;
    if (!start(*waiter)) return false;
    waiter.release();  // the thread has it
    ++all.all;
    ++all.busy;
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

}  // namespace tagrid
