// What the sources of this room for Windows share. Not for other rooms.
#pragma once

#define WIN32_LEAN_AND_MEAN
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace tagrid::windows {

/// Sets errno to the number of POSIX that says the same as an error of Windows. Returns false.
bool fail(DWORD error);
/// The same for the error of the last call.
inline bool fail() { return fail(GetLastError()); }

/// A path as the calls of Windows take it: absolute, and so that it may be longer than 260 letters. Empty, with
/// errno, if it can be none.
std::wstring native(std::string_view path);
/// A text in UTF-8. Half characters, which names may have, become U+FFFD.
std::string utf8(std::wstring_view wide);
/// A path of Windows as a text with slashes.
std::string text(std::wstring_view path);

/// 32 hexadecimal digits that nobody can guess, for a new name. Empty, with errno, if the system gives none.
std::string random_digits();

/// True once this process is about to end: then nothing waits for files that others hold.
inline std::atomic<bool> is_ending = false;

/// Ends all programs that processes() has started, so that files that they have open can be removed.
void end_programs();

/// A handle that is closed at the end.
struct Closes {
  using pointer = HANDLE;
  void operator()(HANDLE handle) const { CloseHandle(handle); }
};
using Handle = std::unique_ptr<HANDLE, Closes>;

/// Something open that is not a file of Windows, and which wait_for() knows. Its destructor closes it.
class Stream {
 public:
  virtual ~Stream() = default;
  /// As those of FileSystem.
  virtual std::ptrdiff_t read(std::span<std::byte> to);
  virtual std::ptrdiff_t write(std::span<const std::byte> bytes);
  /// From now on, nothing is written.
  virtual void end_writing() {}
  /// An event that is set while a call of it need not wait.
  virtual HANDLE readiness() const = 0;
};

/// Windows has no positions that a read elsewhere leaves alone, so files have their own. Pipes and terminals have none.
struct OpenFile {
  HANDLE handle = INVALID_HANDLE_VALUE;
  bool has_position = false;
  bool is_folder = false;
  std::uint64_t position = 0;
  std::unique_ptr<Stream> stream = nullptr;  ///< instead of a handle
};
OpenFile opened(HANDLE handle);

/// The table of what files() has open. A number for something open:
int add(OpenFile file);
/// What has this number; nullptr and errno if nothing has. The pointer is valid until it is closed.
OpenFile* find(int number);
/// Takes it out of the table.
OpenFile take(int number);
/// The handle of an open file, or INVALID_HANDLE_VALUE.
HANDLE handle_of(int file);
/// The stream with this number; nullptr and errno if there is none.
Stream* stream_of(int number);

}  // namespace tagrid::windows
