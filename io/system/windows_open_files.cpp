#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <mutex>
#include <utility>

#include "io/system/files.h"
#include "io/system/on_windows.h"

namespace tagrid {
namespace windows {
namespace {

/// Numbers and what they stand for. The first three are the standard streams.
struct OpenFiles {
  OpenFiles() {
    for (const DWORD stream : {STD_INPUT_HANDLE, STD_OUTPUT_HANDLE, STD_ERROR_HANDLE}) {
      const HANDLE handle = GetStdHandle(stream);
      all.push_back(handle == nullptr || handle == INVALID_HANDLE_VALUE ? OpenFile{} : opened(handle));
    }
  }
  static bool is_open(const OpenFile& file) {
    return file.handle != INVALID_HANDLE_VALUE || file.stream != nullptr;
  }

  std::mutex mutex;
  std::deque<OpenFile> all;
};

OpenFiles& open_files() {
  static OpenFiles& files = *new OpenFiles;
  return files;
}

std::ptrdiff_t no_such_call() {
  errno = EBADF;
  return -1;
}

}  // namespace

std::ptrdiff_t Stream::read(std::span<std::byte>) { return no_such_call(); }
std::ptrdiff_t Stream::write(std::span<const std::byte>) { return no_such_call(); }

OpenFile opened(HANDLE handle) {
  OpenFile file{.handle = handle, .has_position = GetFileType(handle) == FILE_TYPE_DISK};
  LARGE_INTEGER position = {};
  if (file.has_position && SetFilePointerEx(handle, {}, &position, FILE_CURRENT) != 0)
    file.position = static_cast<std::uint64_t>(position.QuadPart);
  return file;
}

int add(OpenFile file) {
  OpenFiles& files = open_files();
  const std::lock_guard lock(files.mutex);
  const auto free = std::find_if_not(files.all.begin() + 3, files.all.end(), OpenFiles::is_open);
  const auto number = static_cast<int>(free - files.all.begin());
  if (free == files.all.end())
    files.all.push_back(std::move(file));
  else
    *free = std::move(file);
  return number;
}

OpenFile* find(int number) {
  OpenFiles& files = open_files();
  const std::lock_guard lock(files.mutex);
  const auto place = static_cast<std::size_t>(number);
  const bool is_open = number >= 0 && place < files.all.size() && OpenFiles::is_open(files.all[place]);
  if (!is_open) errno = EBADF;
  return is_open ? &files.all[place] : nullptr;
}

OpenFile take(int number) {
  OpenFile* const file = find(number);
  const std::lock_guard lock(open_files().mutex);
  return file == nullptr ? OpenFile{} : std::exchange(*file, {});
}

HANDLE handle_of(int file) {
  const OpenFile* const found = find(file);
  return found == nullptr ? INVALID_HANDLE_VALUE : found->handle;
}

Stream* stream_of(int number) {
  const OpenFile* const file = find(number);
  if (file != nullptr && file->stream == nullptr) errno = ENOTSOCK;
  return file == nullptr ? nullptr : file->stream.get();
}

}  // namespace windows

// Standard streams are always ready: what reads one waits, since Windows cannot wait for their bytes.
int wait_for(std::span<Awaited> all, int milliseconds) {
  constexpr std::size_t most = 8;
  std::array<HANDLE, most> events;
  std::array<Awaited*, most> waits;
  DWORD count = 0;
  int ready = 0;
  for (Awaited& one : all) {
    const windows::OpenFile* const file = one.file < 0 ? nullptr : windows::find(one.file);
    if (one.file >= 0 && file == nullptr) return -1;
    one.is_ready = file != nullptr && file->stream == nullptr;
    ready += one.is_ready ? 1 : 0;
    if (file == nullptr || file->stream == nullptr) continue;
    events[count] = file->stream->readiness();
    waits[count++] = &one;
  }
  const DWORD most_time = ready > 0 ? 0 : milliseconds < 0 ? INFINITE : static_cast<DWORD>(milliseconds);
  if (count == 0) {
    Sleep(most_time);
    return ready;
  }
  if (WaitForMultipleObjects(count, events.data(), FALSE, most_time) == WAIT_FAILED) {
    windows::fail();
    return -1;
  }
  for (DWORD i = 0; i < count; ++i) {
    waits[i]->is_ready = WaitForSingleObject(events[i], 0) == WAIT_OBJECT_0;
    ready += waits[i]->is_ready ? 1 : 0;
  }
  return ready;
}

}  // namespace tagrid
