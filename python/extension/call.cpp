#include "call.h"

#include <cxxabi.h>
#include <pthread.h>
#include <pythread.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

namespace tagrid_python {
namespace {

constexpr std::chrono::milliseconds between_looks(50);
// A call whose callback sleeps does not end.
constexpr std::chrono::milliseconds longest_end(500);

[[noreturn]] void sleep_for_ever() {
  while (true) pause();
}

// Takes the GIL. pthread_exit() is an exception that nothing can swallow, so its handler never returns.
template <class Take>
void take_or_sleep(Take take) noexcept {
  try {
    take();
  } catch (const abi::__forced_unwind&) {
    sleep_for_ever();
  }
}

bool is_main_thread() {
  const py::object main = py::module_::import("threading").attr("main_thread")();
  return main.attr("ident").cast<unsigned long>() == PyThread_get_thread_ident();
}

// The running calls. Never destroyed: threads may be at work when the process ends.
struct Running {
  std::mutex mutex;
  std::condition_variable ended;
  std::multiset<Call*> calls;  // an encoder may be used by several threads
};
Running* running = new Running;

// A forked process has none of the threads of this one, and its copy of the mutex may be locked.
void forget_running() { running = new Running; }

// Ends calls that still run when the interpreter has ended, and waits for them briefly: the end of the process
// destroys what they use. Their threads sleep then.
void end_calls() {
  std::unique_lock lock(running->mutex);
  for (Call* call : running->calls) call->stop();
  running->ended.wait_for(lock, longest_end, [] { return running->calls.empty(); });
}

Outcome counted(Call& call, const std::function<Outcome()>& work) {
  struct Registered {
    Running& all;
    Call& call;
    Registered(Running& running_calls, Call& running_call) : all(running_calls), call(running_call) {
      const std::lock_guard lock(all.mutex);
      all.calls.insert(&call);
    }
    ~Registered() {
      const std::lock_guard lock(all.mutex);
      all.calls.erase(all.calls.find(&call));
      all.ended.notify_all();
    }
    Registered(const Registered&) = delete;
    Registered& operator=(const Registered&) = delete;
  } const registered(*running, call);
  return work();
}

const char* class_of(tagrid_status status) {
  switch (status) {
    case TAGRID_INVALID_ARGUMENT:
      return "ArgumentError";
    case TAGRID_BROKEN_INPUT:
      return "DamagedError";
    case TAGRID_NEWER_FORMAT:
      return "NewerFormatError";
    case TAGRID_IO_ERROR:
      return "InputError";
    case TAGRID_MEMORY_LIMIT:
    case TAGRID_OUT_OF_MEMORY:
      return "MemoryLimitError";
    default:
      return "Error";
  }
}

[[noreturn]] void raise_error(const char* name, const std::string& message) {
  const py::object type = py::module_::import("tagrid._errors").attr(name);
  // Messages name files, whose bytes need not be UTF-8.
  const py::object text = py::reinterpret_steal<py::object>(
      PyUnicode_DecodeUTF8(message.data(), static_cast<Py_ssize_t>(message.size()), "backslashreplace"));
  PyErr_SetObject(type.ptr(), text.ptr());
  throw py::error_already_set();
}

}  // namespace

bool python_is_ending() {
#if PY_VERSION_HEX >= 0x030D0000
  return Py_IsFinalizing() != 0 || Py_IsInitialized() == 0;
#else
  return _Py_IsFinalizing() != 0 || Py_IsInitialized() == 0;
#endif
}

WithoutGil::~WithoutGil() {
  take_or_sleep([this] { PyEval_RestoreThread(state_); });
}

WithGil::WithGil() {
  // An interpreter that has ended has no GIL.
  if (python_is_ending()) sleep_for_ever();
  take_or_sleep([this] { state_ = PyGILState_Ensure(); });
}

void Raised::keep(const py::error_already_set& error) {
  if (value_) return;
  value_ = error.value();
  if (error.trace()) PyException_SetTraceback(value_.ptr(), error.trace().ptr());
}

void Raised::raise() const {
  if (!value_) return;
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(value_.ptr())), value_.ptr());
  throw py::error_already_set();
}

thread_local const Call* Call::calling_back = nullptr;

Call::Call(int threads, std::uint64_t memory_limit, py::object progress) : progress_(std::move(progress)) {
  tagrid_call_init(&call_);
  if (threads < 0) raise_argument_error("threads must be 0, for all processors, or more");
  call_.threads = threads;
  call_.memory_limit = memory_limit;
  call_.progress = tell;
  call_.progress_user = this;
}

void Call::interrupt() {
  raised_.keep(py::error_already_set());
  stop_ = true;
}

int Call::tell(void* self, std::uint64_t done, std::uint64_t total) noexcept {
  auto* call = static_cast<Call*>(self);
  if (call->stop_) return 1;
  if (call->progress_.is_none()) return 0;
  const WithGil gil;
  const CallingBack mark(*call);
  try {
    call->progress_(done, total);
    return 0;
  } catch (const py::error_already_set& error) {
    call->raised_.keep(error);
    call->stop_ = true;
    return 1;
  } catch (...) {
    return 1;
  }
}

Outcome run_without_gil(Call& call, const std::function<Outcome()>& work) {
  // Callbacks would wait forever.
  if (python_is_ending()) raise_error("Error", "the interpreter of Python is ending");
  std::future<Outcome> background;
  if (is_main_thread()) {
    try {
      background = std::async(std::launch::async, [&] { return counted(call, work); });
    } catch (const std::system_error&) {
      // There is no thread left: signals have to wait.
    }
  }
  if (!background.valid()) {
    const WithoutGil released;
    return counted(call, work);
  }
  while (true) {
    bool ended = false;
    {
      const WithoutGil released;
      ended = background.wait_for(between_looks) == std::future_status::ready;
    }
    if (ended) return background.get();
    if (PyErr_CheckSignals() != 0) call.interrupt();
  }
}

void end_calls_with_python() {
  Py_AtExit(end_calls);
  pthread_atfork(nullptr, nullptr, forget_running);
}

void raise_unless_ok(const Outcome& outcome) {
  if (outcome.status == TAGRID_OK) return;
  raise_error(class_of(outcome.status),
              outcome.message.empty() ? tagrid_status_text(outcome.status) : outcome.message);
}

void raise_argument_error(const std::string& message) { raise_error("ArgumentError", message); }

}  // namespace tagrid_python
