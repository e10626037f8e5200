#include "io/system/on_windows.h"
// After <windows.h>, which it needs.
#include <psapi.h>
#define RtlGenRandom SystemFunction036
#include <winioctl.h>
extern "C" BOOLEAN NTAPI RtlGenRandom(PVOID bytes, ULONG size);

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <limits>
#include <thread>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

double seconds_of(const FILETIME& kernel, const FILETIME& user) {
  const auto count = [](const FILETIME& time) {
    return static_cast<double>(std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime);
  };
  return 1e-7 * (count(kernel) + count(user));
}

PROCESS_MEMORY_COUNTERS_EX memory_now() {
  PROCESS_MEMORY_COUNTERS_EX now = {};
  GetProcessMemoryInfo(GetCurrentProcess(), reinterpret_cast<PROCESS_MEMORY_COUNTERS*>(&now), sizeof now);
  return now;
}

}  // namespace

int process_number() { return static_cast<int>(GetCurrentProcessId()); }

std::string host_name() {
  std::array<char, MAX_COMPUTERNAME_LENGTH + 1> host = {};
  auto size = static_cast<DWORD>(host.size());
  GetComputerNameA(host.data(), &size);
  return host.data();
}

std::optional<std::filesystem::path> program_path() {
  std::wstring name(32768, L'\0');
  const DWORD size = GetModuleFileNameW(nullptr, name.data(), static_cast<DWORD>(name.size()));
  if (size == 0 || size == name.size()) return std::nullopt;
  name.resize(size);
  return std::filesystem::path(name);
}

// Windows has no fork().
void call_after_fork(void (*)()) {}

bool start_lasting_thread(void* (*work)(void*), void* given) {
  try {
    std::thread(work, given).detach();
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

bool is_terminal(int stream) {
  DWORD mode = 0;
  return GetConsoleMode(windows::handle_of(stream), &mode) != 0;
}

std::size_t columns_of_terminal() {
  CONSOLE_SCREEN_BUFFER_INFO info;
  if (GetConsoleScreenBufferInfo(windows::handle_of(standard_error), &info) == 0) return std::string::npos;
  return static_cast<std::size_t>(info.srWindow.Right - info.srWindow.Left + 1);
}

// Memory is the limit.
std::size_t most_open_files() { return 8192; }

bool fill_with_random(std::span<unsigned char> bytes) {
  if (RtlGenRandom(bytes.data(), static_cast<ULONG>(bytes.size())) != 0) return true;
  errno = EIO;
  return false;
}

std::string windows::random_digits() {
  std::array<unsigned char, 16> random;
  std::string digits;
  if (fill_with_random(random))
    for (const unsigned char byte : random) digits += fmt::format("{:02x}", byte);
  return digits;
}

double processor_seconds_of_thread() {
  FILETIME begin, end, kernel, user;
  return GetThreadTimes(GetCurrentThread(), &begin, &end, &kernel, &user) != 0 ? seconds_of(kernel, user) : 0;
}

double processor_seconds() {
  FILETIME begin, end, kernel, user;
  return GetProcessTimes(GetCurrentProcess(), &begin, &end, &kernel, &user) != 0 ? seconds_of(kernel, user)
                                                                                 : 0;
}

bool to_local_time(std::time_t time, std::tm& parts) { return localtime_s(&parts, &time) == 0; }

int usable_processors() {
  DWORD_PTR own = 0, all = 0;
  if (GetProcessAffinityMask(GetCurrentProcess(), &own, &all) == 0) return 1;
  return std::max(1, std::popcount(std::uint64_t{own}));
}

std::uint64_t memory_of_machine() {
  MEMORYSTATUSEX status = {};
  status.dwLength = sizeof status;
  return GlobalMemoryStatusEx(&status) != 0 ? status.ullTotalPhys : 0;
}

std::uint64_t memory_of_this_process() { return memory_now().PrivateUsage; }
std::uint64_t peak_memory() { return memory_now().PeakWorkingSetSize; }

char* MappedFile::map(int file, std::size_t size) {
  // The view keeps the mapping.
  const windows::Handle mapping(
      CreateFileMappingW(windows::handle_of(file), nullptr, PAGE_READONLY, 0, 0, nullptr));
  void* const mapped = mapping ? MapViewOfFile(mapping.get(), FILE_MAP_READ, 0, 0, size) : nullptr;
  if (mapped == nullptr) windows::fail();
  return static_cast<char*>(mapped);
}

MappedFile::~MappedFile() {
  if (bytes_ != nullptr) UnmapViewOfFile(bytes_);
}

namespace {

constexpr std::string_view name_for_libraries = ".tagrid.plain";

/// Programs that were killed leave theirs. Those that are open stay, and young ones, which may not be open yet.
void remove_forgotten(const std::string& folder) {
  const std::string beginning = fmt::format("{}/{}", folder, name_for_libraries);
  WIN32_FIND_DATAW found;
  const HANDLE search = FindFirstFileW(windows::native(beginning).append(L"*").c_str(), &found);
  if (search == INVALID_HANDLE_VALUE) return;
  FILETIME now;
  GetSystemTimeAsFileTime(&now);
  const auto ticks = [](FILETIME time) {
    return std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime;
  };
  constexpr std::uint64_t hour = std::uint64_t{36'000'000'000};
  do {
    const std::wstring_view name = found.cFileName;
    if (name.size() == name_for_libraries.size() + 32 && ticks(found.ftLastWriteTime) + hour < ticks(now))
      DeleteFileW(windows::native(fmt::format("{}/{}", folder, windows::utf8(found.cFileName))).c_str());
  } while (FindNextFileW(search, &found) != 0);
  FindClose(search);
}

}  // namespace

FileForLibrary::FileForLibrary() : FileForLibrary(folder_for_temporaries(), "a copy for a library") {}

// It has a name. It is not open here: libraries do not open what somebody may delete. Nor is it hidden: a hidden file
// cannot be opened anew.
FileForLibrary::FileForLibrary(const std::string& folder, const std::string& whose) {
  remove_forgotten(folder);
  const std::string digits = windows::random_digits();
  path_ = fmt::format("{}/{}{}", folder, name_for_libraries, digits);
  const HANDLE file = digits.empty() ? INVALID_HANDLE_VALUE
                                     : CreateFileW(windows::native(path_).c_str(), GENERIC_WRITE, 0, nullptr,
                                                   CREATE_NEW, FILE_ATTRIBUTE_TEMPORARY, nullptr);
  if (file == INVALID_HANDLE_VALUE) {
    if (!digits.empty()) windows::fail();
    throw world_error("cannot create a temporary file in " + folder, whose, errno);
  }
  CloseHandle(file);
}
FileForLibrary::~FileForLibrary() { DeleteFileW(windows::native(path_).c_str()); }
bool FileForLibrary::has_name() { return true; }
bool FileForLibrary::leave_holes() const {
  const windows::Handle file(CreateFileW(windows::native(path_).c_str(), GENERIC_WRITE,
                                         FILE_SHARE_READ | FILE_SHARE_WRITE, nullptr, OPEN_EXISTING, 0,
                                         nullptr));
  DWORD unused = 0;
  return file.get() != INVALID_HANDLE_VALUE &&
         DeviceIoControl(file.get(), FSCTL_SET_SPARSE, nullptr, 0, nullptr, 0, &unused, nullptr) != 0;
}

}  // namespace tagrid
