#include "gil.h"

#include <cxxabi.h>
#include <unistd.h>

namespace tagrid_python {
namespace {

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
  // An interpreter that is gone has no GIL.
  if (python_is_ending()) sleep_for_ever();
  take_or_sleep([this] { state_ = PyGILState_Ensure(); });
}

}  // namespace tagrid_python
