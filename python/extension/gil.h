// The lock of Python's interpreter (GIL), also while the interpreter ends.
//
// A thread of Python that waits for the GIL when the interpreter ends is ended by pthread_exit(), which runs
// destructors on its stack and calls terminate() at the first one that is noexcept: pybind11's guards are.
// These guards let such a thread sleep until the process is gone, as Python 3.14 does itself.
#pragma once

#include <pybind11/pybind11.h>

namespace tagrid_python {

/// Whether the interpreter ends or has ended: threads other than the one that ends it must not take the GIL
/// any more.
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

}  // namespace tagrid_python
