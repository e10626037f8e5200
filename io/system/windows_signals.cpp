#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/on_windows.h"
#include "io/system/signals.h"
#include "io/text/paths.h"
// After <windows.h>, which it needs.
#include <shellapi.h>

namespace tagrid {
namespace {

void (*end_handler)(int) = nullptr;

/// Windows calls it in a separate thread.
BOOL WINAPI on_control(DWORD event) {
  const auto handler = std::exchange(end_handler, nullptr);
  if (handler == nullptr) return FALSE;
  windows::is_ending = true;
  handler(event == CTRL_C_EVENT || event == CTRL_BREAK_EVENT ? SIGINT : SIGTERM);
  return TRUE;
}

/// Set when an end signal has come.
HANDLE end_event = nullptr;

BOOL WINAPI on_awaited_control(DWORD event) {
  SetEvent(end_event);
  // When a console is closed, Windows ends the process as soon as this returns, or after some seconds.
  if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT) Sleep(INFINITE);
  return TRUE;
}

class EndEvent final : public windows::Stream {
 public:
  HANDLE readiness() const override { return end_event; }
};

}  // namespace

void catch_end_signals(void (*handler)(int)) {
  end_handler = handler;
  SetConsoleCtrlHandler(on_control, TRUE);
}

void in_handler::rename(const char* from, const char* to) noexcept { files_of_system().rename(from, to); }
void in_handler::unlink(const char* path) noexcept {
  FileStatus status;
  files_of_system().unlink(path);
  if (!files_of_system().status(path, false, status)) return;
  // A program that fills it has it open.
  windows::end_programs();
  files_of_system().unlink(path);
}
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

struct EndSignals::Kept {
  Descriptor descriptor;
};

EndSignals::EndSignals() {
  if (end_event == nullptr) end_event = CreateEventW(nullptr, TRUE, FALSE, nullptr);
  if (end_event == nullptr || SetConsoleCtrlHandler(on_awaited_control, TRUE) == 0) {
    windows::fail();
    throw WorldError("signals cannot be waited for: {}", std::strerror(errno));
  }
  kept_ = std::make_unique<Kept>(windows::add({.stream = std::make_unique<EndEvent>()}));
}

EndSignals::~EndSignals() = default;

int EndSignals::descriptor() const { return kept_->descriptor; }

void EndSignals::let_through() { SetConsoleCtrlHandler(on_awaited_control, FALSE); }

std::string EndSignals::open_in_browser(const std::string& address) const {
  const std::wstring wide = path_of(address).native();
  // The number stands for an error if it is small.
  const auto result = reinterpret_cast<std::intptr_t>(
      ShellExecuteW(nullptr, L"open", wide.c_str(), nullptr, nullptr, SW_SHOWNORMAL));
  return result > 32 ? "" : "Windows knows none";
}

}  // namespace tagrid
