#include <cerrno>
#include <csignal>
#include <string>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/on_windows.h"
#include "io/system/signals.h"

namespace tagrid {
namespace {

void (*end_handler)(int) = nullptr;

/// Windows calls it in a separate thread.
BOOL WINAPI on_control(DWORD event) {
  const auto handler = std::exchange(end_handler, nullptr);
  if (handler == nullptr) return FALSE;
  handler(event == CTRL_C_EVENT || event == CTRL_BREAK_EVENT ? SIGINT : SIGTERM);
  return TRUE;
}

}  // namespace

void catch_end_signals(void (*handler)(int)) {
  end_handler = handler;
  SetConsoleCtrlHandler(on_control, TRUE);
}

void in_handler::rename(const char* from, const char* to) noexcept { files_of_system().rename(from, to); }
void in_handler::unlink(const char* path) noexcept { files_of_system().unlink(path); }
void in_handler::remove_folder(const char* path) noexcept { files_of_system().remove_folder(path); }
void in_handler::remove_with_files(const char* folder) noexcept { tagrid::remove_with_files(folder); }

void in_handler::say(const char* text, std::size_t size) noexcept {
  DWORD count = 0;
  WriteFile(GetStdHandle(STD_ERROR_HANDLE), text, static_cast<DWORD>(size), &count, nullptr);
}

// Nothing else runs: threads that still hold locks would keep a friendlier end waiting.
void in_handler::exit(int code) noexcept {
  TerminateProcess(GetCurrentProcess(), static_cast<UINT>(code));
  std::abort();
}

void in_handler::end_by(int) noexcept { TerminateProcess(GetCurrentProcess(), STATUS_CONTROL_C_EXIT); }

struct EndSignals::Kept {};
EndSignals::EndSignals() { throw WorldError("tagrid does not wait for the end of a server on Windows yet"); }
EndSignals::~EndSignals() = default;
int EndSignals::descriptor() const { return -1; }
void EndSignals::let_through() {}
bool EndSignals::start_program(const char*, const char*) const { return false; }

}  // namespace tagrid
