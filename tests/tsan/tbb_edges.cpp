// What ThreadSanitizer must know of oneTBB. The library comes from Debian and is not instrumented: it is
// invisible that a task is handed from one thread to another inside it, and that waiting for a task ends
// after the task. So every value that goes along with a task would be reported. The functions below replace
// those of the library, do the same, and declare the order of events:
//
//   spawn, submit, enqueue     before   the task is executed, by whatever thread
//   the last task that ends    before   wait() returns
//   memory is allocated        before   it is freed (the library itself does both, in different threads)
//
// Everything else (how nodes pass messages, counters, locks) is in oneTBB's headers, and thus instrumented.
// Memory for tasks comes from malloc(), which ThreadSanitizer knows, and not from pools, which it does not. That the
// library frees its own memory, which is never ours, is not checked.
// Nothing is suppressed: race_check.cpp shows that a race in the pipeline is still found.
#include <dlfcn.h>
#include <oneapi/tbb/detail/_small_object_pool.h>
#include <oneapi/tbb/detail/_task.h>
#include <oneapi/tbb/task_arena.h>
#include <sanitizer/tsan_interface.h>

#include <atomic>
#include <cstdlib>
#include <new>

// ThreadSanitizer has them, without a header.
extern "C" void AnnotateIgnoreReadsBegin(const char* file, int line);
extern "C" void AnnotateIgnoreReadsEnd(const char* file, int line);

namespace tbb::detail {
namespace {

/// A task that knows who handed it over.
class HandedOver final : public d1::task {
 public:
  explicit HandedOver(d1::task& handed) : handed_(handed) { __tsan_release(this); }

  d1::task* execute(d1::execution_data& data) override {
    __tsan_acquire(this);
    d1::task* const next = handed_.execute(data);
    // Not after an exception: the library then cancels this task.
    delete this;
    return next;
  }
  d1::task* cancel(d1::execution_data& data) override {
    __tsan_acquire(this);
    d1::task* const next = handed_.cancel(data);
    delete this;
    return next;
  }

 private:
  ~HandedOver() override = default;
  d1::task& handed_;
};

template <class Function>
Function library_function(const char* mangled) {
  void* const found = dlsym(RTLD_NEXT, mangled);
  if (found == nullptr) std::abort();  // another version of oneTBB
  return reinterpret_cast<Function>(found);
}

void* allocate_lines(std::size_t size) {
  constexpr std::size_t line = 128;
  void* const memory = std::aligned_alloc(line, (size + line - 1) / line * line);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

/// What the library frees for itself, such as arenas of threads: what orders that after the last use is invisible.
/// While this exists, freeing is not compared with earlier uses if `caller` is in the library.
class Unseen {
 public:
  explicit Unseen(const void* caller) : in_library_(library_of(caller) == library_of_tbb()) {
    if (in_library_) AnnotateIgnoreReadsBegin(__FILE__, __LINE__);
  }
  ~Unseen() {
    if (in_library_) AnnotateIgnoreReadsEnd(__FILE__, __LINE__);
  }
  Unseen(const Unseen&) = delete;
  Unseen& operator=(const Unseen&) = delete;

 private:
  static const void* library_of(const void* address) {
    Dl_info found;
    return dladdr(address, &found) != 0 ? found.dli_fbase : nullptr;
  }
  static const void* library_of_tbb() {
    static const void* const tbb = library_of(dlsym(RTLD_NEXT, "TBB_runtime_version"));
    return tbb;
  }

  bool in_library_;
};

/// The end of waiting, also by an exception of a task: the last task to end has released the counter of
/// tasks.
class Waiting {
 public:
  explicit Waiting(d1::wait_context& tasks) : tasks_(tasks) {}
  ~Waiting() {
    static_assert(sizeof(d1::wait_context) == 2 * sizeof(std::uint64_t));
    __tsan_acquire(reinterpret_cast<std::uint64_t*>(&tasks_) + 1);
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

 private:
  d1::wait_context& tasks_;
};

}  // namespace

namespace r1 {

void spawn(d1::task& task, d1::task_group_context& context) {
  using Function = void (*)(d1::task&, d1::task_group_context&);
  static const auto original =
      library_function<Function>("_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextE");
  original(*new HandedOver(task), context);
}

void spawn(d1::task& task, d1::task_group_context& context, d1::slot_id slot) {
  using Function = void (*)(d1::task&, d1::task_group_context&, d1::slot_id);
  static const auto original =
      library_function<Function>("_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextEt");
  original(*new HandedOver(task), context, slot);
}

void submit(d1::task& task, d1::task_group_context& context, arena* to, std::uintptr_t as_critical) {
  using Function = void (*)(d1::task&, d1::task_group_context&, arena*, std::uintptr_t);
  static const auto original = library_function<Function>(
      "_ZN3tbb6detail2r16submitERNS0_2d14taskERNS2_18task_group_contextEPNS1_5arenaEm");
  original(*new HandedOver(task), context, to, as_critical);
}

void enqueue(d1::task& task, d1::task_arena_base* to) {
  using Function = void (*)(d1::task&, d1::task_arena_base*);
  static const auto original =
      library_function<Function>("_ZN3tbb6detail2r17enqueueERNS0_2d14taskEPNS2_15task_arena_baseE");
  original(*new HandedOver(task), to);
}

void enqueue(d1::task& task, d1::task_group_context& context, d1::task_arena_base* to) {
  using Function = void (*)(d1::task&, d1::task_group_context&, d1::task_arena_base*);
  static const auto original = library_function<Function>(
      "_ZN3tbb6detail2r17enqueueERNS0_2d14taskERNS2_18task_group_contextEPNS2_15task_arena_baseE");
  original(*new HandedOver(task), context, to);
}

void wait(d1::wait_context& tasks, d1::task_group_context& context) {
  using Function = void (*)(d1::wait_context&, d1::task_group_context&);
  static const auto original =
      library_function<Function>("_ZN3tbb6detail2r14waitERNS0_2d112wait_contextERNS2_18task_group_contextE");
  const Waiting waiting(tasks);
  original(tasks, context);
}

void execute_and_wait(d1::task& task, d1::task_group_context& task_context, d1::wait_context& tasks,
                      d1::task_group_context& wait_context) {
  using Function = void (*)(d1::task&, d1::task_group_context&, d1::wait_context&, d1::task_group_context&);
  static const auto original = library_function<Function>(
      "_ZN3tbb6detail2r116execute_and_waitERNS0_2d14taskERNS2_18task_group_contextERNS2_12wait_contextES6_");
  const Waiting waiting(tasks);
  original(task, task_context, tasks, wait_context);
}

void* cache_aligned_allocate(std::size_t size) {
  void* const memory = allocate_lines(size);
  __tsan_release(memory);
  return memory;
}
void cache_aligned_deallocate(void* memory) {
  __tsan_acquire(memory);
  const Unseen unseen(__builtin_return_address(0));
  std::free(memory);
}

void* allocate(d1::small_object_pool*& pool, std::size_t size) {
  static char no_pool;
  pool = reinterpret_cast<d1::small_object_pool*>(&no_pool);
  return allocate_lines(size);
}
void* allocate(d1::small_object_pool*& pool, std::size_t size, const d1::execution_data&) {
  return allocate(pool, size);
}
void deallocate(d1::small_object_pool&, void* object, std::size_t) { std::free(object); }
void deallocate(d1::small_object_pool&, void* object, std::size_t, const d1::execution_data&) {
  std::free(object);
}

}  // namespace r1
}  // namespace tbb::detail

// Masks of processors.
void operator delete[](void* array) noexcept {
  const tbb::detail::Unseen unseen(__builtin_return_address(0));
  operator delete(array);
}
void operator delete[](void* array, std::size_t) noexcept { operator delete(array); }
