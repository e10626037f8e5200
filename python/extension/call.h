// Calls of libtagrid from Python: without the lock of the interpreter (GIL), with signals and exceptions.
//
// When the interpreter ends, it ends each Python thread that waits for the GIL by pthread_exit(), which runs
// destructors on the thread's stack and calls terminate() at the first one that is noexcept, as those of
// pybind11's guards are. The guards here let such a thread sleep until the process has ended, as Python 3.14
// does.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "tagrid/tagrid.h"

namespace tagrid_python {

namespace py = pybind11;

/// Whether the interpreter ends or has ended: only the thread that ends it may then take the GIL.
bool python_is_ending();

/// Releases the GIL for as long as it lives. REQUIRES: this thread has the GIL.
class WithoutGil {
 public:
  WithoutGil() : state_(PyEval_SaveThread()) {}
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;
  ~WithoutGil();

 private:
  PyThreadState* state_;
};

/// Has the GIL for as long as it lives, on any thread. If the interpreter is ending, the thread sleeps.
class WithGil {
 public:
  WithGil();
  WithGil(const WithGil&) = delete;
  WithGil& operator=(const WithGil&) = delete;
  ~WithGil() { PyGILState_Release(state_); }

 private:
  PyGILState_STATE state_ = PyGILState_UNLOCKED;
};

/// The first Python exception that a callback raised on a thread of the library. REQUIRES: the GIL, for every
/// function.
class Raised {
 public:
  /// Keeps the exception that is being handled; later ones are dropped until it is taken or cleared.
  void keep(const py::error_already_set& error);
  /// Raises it, if there is one.
  void raise() const;
  void clear() { value_ = py::object(); }

 private:
  py::object value_;
};

/// The limits of a call, and what may end it: the caller's progress function, or a signal such as Ctrl-C.
class Call {
 public:
  /// `progress`: None, or a function of two numbers: the bytes of samples that are done, and their total.
  Call(int threads, std::uint64_t memory_limit, py::object progress);
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  const tagrid_call* get() const { return &call_; }
  /// Ends the call soon, with the exception that is set.
  void interrupt();
  bool is_interrupted() const { return stop_; }
  /// Ends the call soon, from any thread, without the GIL.
  void stop() { stop_ = true; }
  /// Whether this thread is in a callback of the call, which would wait for itself if it used the same
  /// encoder.
  bool is_calling_back() const { return calling_back == this; }

  /// Marks this thread as being in a callback of a call.
  class CallingBack {
   public:
    explicit CallingBack(const Call& call) : before_(calling_back) { calling_back = &call; }
    CallingBack(const CallingBack&) = delete;
    CallingBack& operator=(const CallingBack&) = delete;
    ~CallingBack() { calling_back = before_; }

   private:
    const Call* before_;
  };
  const Raised& raised() const { return raised_; }

 private:
  static thread_local const Call* calling_back;
  static int tell(void* self, std::uint64_t done, std::uint64_t total) noexcept;

  tagrid_call call_;
  py::object progress_;
  std::atomic<bool> stop_ = false;
  Raised raised_;
};

/// How a call of the library ended.
struct Outcome {
  tagrid_status status = TAGRID_OK;
  std::string message = {};
};

/// Does the work without the GIL. On Python's main thread, which alone handles signals, another thread works
/// while this one looks for signals. The work must not use Python without taking the GIL.
Outcome run_without_gil(Call& call, const std::function<Outcome()>& work);

/// Lets calls that still run when the interpreter has ended come to an end before the process does. Once, at
/// the start.
void end_calls_with_python();

/// Raises the exception of tagrid.Error's family that belongs to an outcome; returns if it is TAGRID_OK.
void raise_unless_ok(const Outcome& outcome);

/// Raises tagrid.ArgumentError.
[[noreturn]] void raise_argument_error(const std::string& message);

}  // namespace tagrid_python
