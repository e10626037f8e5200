#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

#include "io/system/files.h"
#include "io/system/on_windows.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

using windows::fail;
using windows::find;
using windows::native;
using windows::opened;
using windows::OpenFile;
using windows::random_digits;

constexpr DWORD shared_by_all = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
constexpr std::size_t most_at_once = std::size_t{1} << 30;

// Windows counts units of 100 ns since 1601: so many a second, and so many seconds until 1970.
constexpr std::int64_t units = 10'000'000, until_1970 = 11'644'473'600;

FileTime time_of(const FILETIME& time) {
  const std::int64_t since_1601 = static_cast<std::int64_t>(time.dwHighDateTime) << 32 | time.dwLowDateTime;
  return {since_1601 / units - until_1970, since_1601 % units * 100};
}

FILETIME filetime_of(const FileTime& time) {
  const std::int64_t since_1601 = (time.seconds + until_1970) * units + time.nanoseconds / 100;
  return {static_cast<DWORD>(since_1601 & 0xFFFFFFFF), static_cast<DWORD>(since_1601 >> 32)};
}

FileType type_of(DWORD attributes, DWORD tag) {
  const bool is_link = (attributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0 &&
                       (tag == IO_REPARSE_TAG_SYMLINK || tag == IO_REPARSE_TAG_MOUNT_POINT);
  if (is_link) return FileType::link;
  return (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0 ? FileType::folder : FileType::regular;
}

bool status_from(HANDLE handle, FileStatus& status) {
  status = {};
  status.mode = 0666;
  if (GetFileType(handle) != FILE_TYPE_DISK) return true;
  BY_HANDLE_FILE_INFORMATION found;
  if (GetFileInformationByHandle(handle, &found) == 0) {
    // Of a file of Linux that a shell redirects to a program, Wine knows the size only.
    LARGE_INTEGER size;
    if (GetFileSizeEx(handle, &size) == 0) return fail();
    status.type = FileType::regular;
    status.size = static_cast<std::uint64_t>(size.QuadPart);
    // Not the same file as any other.
    status.device = std::numeric_limits<std::uint64_t>::max();
    status.number = reinterpret_cast<std::uintptr_t>(handle);
    return true;
  }
  FILE_ATTRIBUTE_TAG_INFO tag = {};
  GetFileInformationByHandleEx(handle, FileAttributeTagInfo, &tag, sizeof tag);
  FILE_STANDARD_INFO standard = {};
  GetFileInformationByHandleEx(handle, FileStandardInfo, &standard, sizeof standard);
  status.type = type_of(found.dwFileAttributes, tag.ReparseTag);
  status.size = std::uint64_t{found.nFileSizeHigh} << 32 | found.nFileSizeLow;
  // What others may do is not said here: nothing that would make it less safe than it is.
  status.mode = status.type == FileType::folder                           ? 0755
                : (found.dwFileAttributes & FILE_ATTRIBUTE_READONLY) != 0 ? 0444
                                                                          : 0644;
  status.accessed = time_of(found.ftLastAccessTime);
  status.modified = time_of(found.ftLastWriteTime);
  // Windows tells no time of other changes to programs.
  status.changed = status.modified;
  status.device = found.dwVolumeSerialNumber;
  status.number = std::uint64_t{found.nFileIndexHigh} << 32 | found.nFileIndexLow;
  status.links = found.nNumberOfLinks;
  status.stored = static_cast<std::uint64_t>(standard.AllocationSize.QuadPart);
  return true;
}

bool is_folder_at(const std::wstring& path) {
  const DWORD attributes = GetFileAttributesW(path.c_str());
  return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
}

OVERLAPPED place(std::uint64_t position) {
  OVERLAPPED at = {};
  at.Offset = static_cast<DWORD>(position & 0xFFFFFFFF);
  at.OffsetHigh = static_cast<DWORD>(position >> 32);
  return at;
}

// Locks of Windows keep others from reading and writing; nobody reads or writes here.
OVERLAPPED place_of_lock() { return place(std::uint64_t{1} << 62); }

/// Makes a call that changes a name, again for two seconds while another program holds the file: a scanner of viruses
/// does so with new files for a moment. `also_if_denied`: Windows says so of a directory in which a file is held.
template <class Call>
bool retried_while_held(const Call& call, bool also_if_denied = false) {
  constexpr int most_tries = 40;
  constexpr DWORD pause_ms = 50;
  for (int tries = 1; !call(); ++tries) {
    const DWORD error = GetLastError();
    const bool is_held = error == ERROR_SHARING_VIOLATION || (also_if_denied && error == ERROR_ACCESS_DENIED);
    if (!is_held || tries == most_tries || windows::is_ending) return fail(error);
    Sleep(pause_ms);
  }
  return true;
}

bool move_file(const std::wstring& from, const std::wstring& to, DWORD flags, bool also_if_denied) {
  return retried_while_held(
      [&] { return MoveFileExW(from.c_str(), to.c_str(), flags | MOVEFILE_WRITE_THROUGH); }, also_if_denied);
}

class SystemFiles final : public FileSystem {
 public:
  int open(const std::string& path, const Opening& how) override {
    const std::wstring name = native(path);
    if (name.empty()) return -1;
    const DWORD access = (how.read || !how.write ? GENERIC_READ : 0) | (how.write ? GENERIC_WRITE : 0);
    const DWORD way = how.creates && how.is_new    ? CREATE_NEW
                      : how.creates && how.empties ? CREATE_ALWAYS
                      : how.creates                ? OPEN_ALWAYS
                      : how.empties                ? TRUNCATE_EXISTING
                                                   : OPEN_EXISTING;
    const DWORD flags = FILE_ATTRIBUTE_NORMAL | (how.follows_link ? 0 : FILE_FLAG_OPEN_REPARSE_POINT);
    const HANDLE handle = CreateFileW(name.c_str(), access, shared_by_all, nullptr, way, flags, nullptr);
    if (handle == INVALID_HANDLE_VALUE) {
      const DWORD error = GetLastError();
      fail(error);
      if (error == ERROR_ACCESS_DENIED && is_folder_at(name)) errno = EISDIR;
      return -1;
    }
    FileStatus status;
    if (!how.follows_link && status_from(handle, status) && status.is_link()) {
      CloseHandle(handle);
      errno = ELOOP;
      return -1;
    }
    return windows::add(opened(handle));
  }
  int open_folder(const std::string& path) override {
    const std::wstring name = native(path);
    if (name.empty()) return -1;
    const HANDLE handle = CreateFileW(name.c_str(), GENERIC_READ, shared_by_all, nullptr, OPEN_EXISTING,
                                      FILE_FLAG_BACKUP_SEMANTICS, nullptr);
    if (handle == INVALID_HANDLE_VALUE) return fail(), -1;
    if (!is_folder_at(name)) {
      CloseHandle(handle);
      errno = ENOTDIR;
      return -1;
    }
    return windows::add({.handle = handle, .is_folder = true});
  }
  int open_nameless(const std::string& folder) override {
    // It has a name, and goes when it is closed.
    const std::string digits = random_digits();
    if (digits.empty()) return -1;
    const HANDLE handle =
        CreateFileW(native(folder + "/.tagrid.spool" + digits).c_str(), GENERIC_READ | GENERIC_WRITE | DELETE,
                    shared_by_all, nullptr, CREATE_NEW,
                    FILE_ATTRIBUTE_TEMPORARY | FILE_ATTRIBUTE_HIDDEN | FILE_FLAG_DELETE_ON_CLOSE, nullptr);
    return handle == INVALID_HANDLE_VALUE ? (fail(), -1) : windows::add(opened(handle));
  }
  int duplicate(int number) override {
    const OpenFile* const file = find(number);
    if (file == nullptr) return -1;
    OpenFile twin{
        .has_position = file->has_position, .is_folder = file->is_folder, .position = file->position};
    const HANDLE own = GetCurrentProcess();
    if (DuplicateHandle(own, file->handle, own, &twin.handle, 0, FALSE, DUPLICATE_SAME_ACCESS) == 0)
      return fail(), -1;
    return windows::add(std::move(twin));
  }
  bool close(int number) override {
    OpenFile file = windows::take(number);
    if (file.stream == nullptr && file.handle == INVALID_HANDLE_VALUE) return refuse(EBADF);
    return file.stream != nullptr || CloseHandle(file.handle) != 0 || fail();
  }

  std::ptrdiff_t read(int number, std::span<std::byte> to) override {
    OpenFile* const file = find(number);
    if (file == nullptr) return -1;
    if (file->stream != nullptr) return file->stream->read(to);
    if (!file->has_position) return read_from(file->handle, nullptr, to);
    const std::ptrdiff_t count = read_at(number, file->position, to);
    if (count > 0) file->position += static_cast<std::uint64_t>(count);
    return count;
  }
  std::ptrdiff_t read_at(int number, std::uint64_t position, std::span<std::byte> to) override {
    const OpenFile* const file = find(number);
    if (file == nullptr) return -1;
    if (!file->has_position) {
      errno = file->is_folder ? EISDIR : ESPIPE;
      return -1;
    }
    OVERLAPPED at = place(position);
    return read_from(file->handle, &at, to);
  }
  std::ptrdiff_t write(int number, std::span<const std::byte> bytes) override {
    OpenFile* const file = find(number);
    if (file == nullptr) return -1;
    if (file->stream != nullptr) return file->stream->write(bytes);
    OVERLAPPED at = place(file->position);
    DWORD count = 0;
    const auto most = static_cast<DWORD>(std::min(bytes.size(), most_at_once));
    if (WriteFile(file->handle, bytes.data(), most, &count, file->has_position ? &at : nullptr) == 0)
      return fail(), -1;
    file->position += count;
    return count;
  }
  bool write_at(int number, std::uint64_t position, std::span<const std::byte> bytes) override {
    const OpenFile* const file = find(number);
    while (file != nullptr && !bytes.empty()) {
      OVERLAPPED at = place(position);
      DWORD count = 0;
      const auto most = static_cast<DWORD>(std::min(bytes.size(), most_at_once));
      if (WriteFile(file->handle, bytes.data(), most, &count, &at) == 0) return fail();
      bytes = bytes.subspan(count);
      position += count;
    }
    return file != nullptr;
  }
  std::int64_t position(int number) override {
    const OpenFile* const file = find(number);
    if (file == nullptr) return -1;
    if (!file->has_position) errno = ESPIPE;
    return file->has_position ? static_cast<std::int64_t>(file->position) : -1;
  }
  bool seek(int number, std::uint64_t position) override {
    OpenFile* const file = find(number);
    if (file == nullptr) return false;
    if (!file->has_position) errno = ESPIPE;
    if (file->has_position) file->position = position;
    return file->has_position;
  }
  void reads_in_order(int) override {}
  bool resize(int number, std::uint64_t size) override {
    const OpenFile* const file = find(number);
    if (file == nullptr) return false;
    FILE_END_OF_FILE_INFO end = {};
    end.EndOfFile.QuadPart = static_cast<LONGLONG>(size);
    return SetFileInformationByHandle(file->handle, FileEndOfFileInfo, &end, sizeof end) != 0 || fail();
  }
  bool sync(int number) override {
    const OpenFile* const file = find(number);
    if (file == nullptr) return false;
    // NTFS writes changes of directories to its journal, in their order.
    return file->is_folder || FlushFileBuffers(file->handle) != 0 || fail();
  }

  bool status(int number, FileStatus& status) override {
    const OpenFile* const file = find(number);
    return file != nullptr && status_from(file->handle, status);
  }
  bool status(const std::string& path, bool follows_link, FileStatus& status) override {
    const std::wstring name = native(path);
    if (name.empty()) return false;
    // Not opened: serial lines wait, and a console may be missing.
    if (name.starts_with(L"\\\\.\\")) {
      status = {};
      return true;
    }
    const HANDLE handle =
        CreateFileW(name.c_str(), FILE_READ_ATTRIBUTES, shared_by_all, nullptr, OPEN_EXISTING,
                    FILE_FLAG_BACKUP_SEMANTICS | (follows_link ? 0 : FILE_FLAG_OPEN_REPARSE_POINT), nullptr);
    if (handle == INVALID_HANDLE_VALUE) return fail();
    const bool is_known = status_from(handle, status);
    CloseHandle(handle);
    return is_known;
  }
  bool is_executable(const std::string& path) override {
    FileStatus found;
    return status(path, true, found) && found.is_file();
  }
  // Owners and groups of POSIX have no counterpart.
  bool set_owner(int, std::uint32_t) override { return refuse(EPERM); }
  bool set_group(int, std::uint32_t) override { return refuse(EPERM); }
  bool set_mode(int number, unsigned mode) override {
    const OpenFile* const file = find(number);
    FILE_BASIC_INFO info = {};
    if (file == nullptr) return false;
    if (GetFileInformationByHandleEx(file->handle, FileBasicInfo, &info, sizeof info) == 0) return fail();
    info.FileAttributes = with_mode(info.FileAttributes, mode);
    return SetFileInformationByHandle(file->handle, FileBasicInfo, &info, sizeof info) != 0 || fail();
  }
  bool set_mode(const std::string& path, unsigned mode) override {
    const std::wstring name = native(path);
    const DWORD attributes = GetFileAttributesW(name.c_str());
    if (attributes == INVALID_FILE_ATTRIBUTES) return fail();
    return SetFileAttributesW(name.c_str(), with_mode(attributes, mode)) != 0 || fail();
  }
  bool set_times(int number, FileTime accessed, FileTime modified) override {
    const OpenFile* const file = find(number);
    const FILETIME of_access = filetime_of(accessed), of_change = filetime_of(modified);
    return file != nullptr && (SetFileTime(file->handle, nullptr, &of_access, &of_change) != 0 || fail());
  }

  bool lock(int number, bool waits) override {
    const OpenFile* const file = find(number);
    if (file == nullptr) return false;
    OVERLAPPED at = place_of_lock();
    const DWORD flags = LOCKFILE_EXCLUSIVE_LOCK | (waits ? 0 : LOCKFILE_FAIL_IMMEDIATELY);
    return LockFileEx(file->handle, flags, 0, 1, 0, &at) != 0 || fail();
  }
  bool is_local(int number) override {
    // Servers of Windows and Samba keep locks for all their clients. Directories have none.
    const OpenFile* const file = find(number);
    return file != nullptr && !file->is_folder;
  }

  bool rename(const std::string& from, const std::string& to) override {
    const std::wstring source = native(from), target = native(to);
    if (source.empty() || target.empty()) return false;
    // Windows would remove one of two names of a file.
    FileStatus of_source, of_target;
    if (status(from, false, of_source) && of_source.links > 1 && status(to, false, of_target) &&
        of_source.is_same_file(of_target))
      return true;
    if (rename_as_posix(source, target)) return true;
    if (move_file(source, target, MOVEFILE_REPLACE_EXISTING, is_folder_at(source))) return true;
    const bool may_be_open = errno == EACCES &&
                             GetFileAttributesW(target.c_str()) != INVALID_FILE_ATTRIBUTES &&
                             !is_folder_at(target);
    return may_be_open && rename_over_open(source, target);
  }
  bool rename_to_new(const std::string& from, const std::string& to) override {
    const std::wstring source = native(from);
    return move_file(source, native(to), 0, is_folder_at(source));
  }
  bool exchange(const std::string&, const std::string&) override { return refuse(ENOSYS); }
  bool link(const std::string& from, const std::string& to) override {
    // While another program holds the file, the second name could not be removed again.
    const std::wstring name = native(from);
    HANDLE held = INVALID_HANDLE_VALUE;
    const bool is_free = retried_while_held([&] {
      held = CreateFileW(name.c_str(), DELETE, shared_by_all, nullptr, OPEN_EXISTING,
                         FILE_FLAG_OPEN_REPARSE_POINT, nullptr);
      return held != INVALID_HANDLE_VALUE;
    });
    if (!is_free) return false;
    CloseHandle(held);
    return CreateHardLinkW(native(to).c_str(), name.c_str(), nullptr) != 0 || fail();
  }
  bool unlink(const std::string& path) override {
    const std::wstring name = native(path);
    const DWORD attributes = GetFileAttributesW(name.c_str());
    if (attributes == INVALID_FILE_ATTRIBUTES) return fail();
    if ((attributes & FILE_ATTRIBUTE_DIRECTORY) != 0) {
      // A link to a directory is removed as a link.
      if ((attributes & FILE_ATTRIBUTE_REPARSE_POINT) == 0) return refuse(EISDIR);
      return RemoveDirectoryW(name.c_str()) != 0 || fail();
    }
    // POSIX also removes read-only files.
    if ((attributes & FILE_ATTRIBUTE_READONLY) != 0) SetFileAttributesW(name.c_str(), FILE_ATTRIBUTE_NORMAL);
    return retried_while_held([&] { return DeleteFileW(name.c_str()); });
  }
  bool make_folder(const std::string& path, unsigned) override {
    return CreateDirectoryW(native(path).c_str(), nullptr) != 0 || fail();
  }
  bool remove_folder(const std::string& path) override {
    return RemoveDirectoryW(native(path).c_str()) != 0 || fail();
  }
  bool list(const std::string& folder, std::vector<FolderEntry>& entries) override {
    entries.clear();
    const std::wstring name = native(folder);
    if (name.empty()) return false;
    WIN32_FIND_DATAW found;
    const HANDLE search = FindFirstFileW((name + (name.ends_with(L'\\') ? L"*" : L"\\*")).c_str(), &found);
    // The root of an empty drive has no "." either.
    if (search == INVALID_HANDLE_VALUE)
      return (GetLastError() == ERROR_FILE_NOT_FOUND && is_folder_at(name)) || fail();
    do {
      const std::string entry = windows::text(found.cFileName);
      if (entry != "." && entry != "..")
        entries.push_back({entry, type_of(found.dwFileAttributes, found.dwReserved0)});
    } while (FindNextFileW(search, &found) != 0);
    const DWORD error = GetLastError();
    FindClose(search);
    return error == ERROR_NO_MORE_FILES || fail(error);
  }
  bool resolve(const std::string& path, std::string& resolved) override {
    const std::wstring name = native(path);
    if (name.empty()) return false;
    const HANDLE handle = CreateFileW(name.c_str(), FILE_READ_ATTRIBUTES, shared_by_all, nullptr,
                                      OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
    if (handle == INVALID_HANDLE_VALUE) return fail();
    std::wstring final_name(32768, L'\0');
    const DWORD size =
        GetFinalPathNameByHandleW(handle, final_name.data(), static_cast<DWORD>(final_name.size()), 0);
    if (size == 0) fail();
    CloseHandle(handle);
    if (size == 0) return false;
    final_name.resize(size);
    resolved = windows::text(final_name);
    return true;
  }
  bool room(const std::string& folder, Room& room) override {
    ULARGE_INTEGER bytes;
    if (GetDiskFreeSpaceExW(native(folder).c_str(), &bytes, nullptr, nullptr) == 0) return fail();
    room = {bytes.QuadPart, false};
    return true;
  }

 private:
  static bool refuse(int error) {
    errno = error;
    return false;
  }
  /// A file that is open loses its name, and is removed when it is closed. Windows 10 and 11 do this on NTFS.
  static bool rename_as_posix(const std::wstring& from, const std::wstring& to) {
    constexpr auto rename_ex = static_cast<FILE_INFO_BY_HANDLE_CLASS>(22);  // FileRenameInfoEx
    constexpr DWORD replaces = 1, as_posix = 2, also_read_only = 0x40;
    // Written through: what is removed on another disk afterwards may depend on it.
    const HANDLE file = CreateFileW(
        from.c_str(), DELETE, shared_by_all, nullptr, OPEN_EXISTING,
        FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_OPEN_REPARSE_POINT | FILE_FLAG_WRITE_THROUGH, nullptr);
    if (file == INVALID_HANDLE_VALUE) return false;
    std::vector<std::byte> bytes(sizeof(FILE_RENAME_INFO) + to.size() * sizeof(wchar_t));
    auto* const info = new (bytes.data()) FILE_RENAME_INFO{};
    // The flags lie where the older call has its only one.
    const DWORD flags = replaces | as_posix | also_read_only;
    std::memcpy(info, &flags, sizeof flags);
    info->FileNameLength = static_cast<DWORD>(to.size() * sizeof(wchar_t));
    std::memcpy(info->FileName, to.data(), to.size() * sizeof(wchar_t));
    const bool is_renamed =
        SetFileInformationByHandle(file, rename_ex, info, static_cast<DWORD>(bytes.size())) != 0;
    CloseHandle(file);
    return is_renamed;
  }
  /// Elsewhere, the file that is open gets another name first, and keeps it if this fails or the program ends here.
  static bool rename_over_open(const std::wstring& from, const std::wstring& to) {
    const std::string digits = random_digits();
    if (digits.empty()) return false;
    std::wstring aside = to.substr(0, to.find_last_of(L'\\') + 1) + L".tagrid.replaced";
    aside.append(digits.begin(), digits.end());
    if (!move_file(to, aside, 0, false)) return false;
    if (!move_file(from, to, 0, false)) {
      const int error = errno;
      move_file(aside, to, 0, true);
      return refuse(error);
    }
    SetFileAttributesW(aside.c_str(), FILE_ATTRIBUTE_NORMAL);
    DeleteFileW(aside.c_str());
    return true;
  }
  static DWORD with_mode(DWORD attributes, unsigned mode) {
    constexpr unsigned owner_writes = 0200;
    return (mode & owner_writes) != 0 ? attributes & ~static_cast<DWORD>(FILE_ATTRIBUTE_READONLY)
                                      : attributes | FILE_ATTRIBUTE_READONLY;
  }
  static std::ptrdiff_t read_from(HANDLE handle, OVERLAPPED* at, std::span<std::byte> to) {
    DWORD count = 0;
    if (ReadFile(handle, to.data(), static_cast<DWORD>(std::min(to.size(), most_at_once)), &count, at) != 0)
      return count;
    const DWORD error = GetLastError();
    if (error == ERROR_HANDLE_EOF || error == ERROR_BROKEN_PIPE) return 0;
    return fail(error), -1;
  }
};

}  // namespace

namespace windows {

bool fail(DWORD error) {
  struct Same {
    DWORD windows;
    int posix;
  };
  constexpr Same all[] = {{ERROR_FILE_NOT_FOUND, ENOENT},
                          {ERROR_PATH_NOT_FOUND, ENOENT},
                          {ERROR_INVALID_NAME, ENOENT},
                          {ERROR_BAD_PATHNAME, ENOENT},
                          {ERROR_BAD_NETPATH, ENOENT},
                          {ERROR_DIRECTORY, ENOTDIR},
                          {ERROR_ACCESS_DENIED, EACCES},
                          {ERROR_WRITE_PROTECT, EROFS},
                          {ERROR_SHARING_VIOLATION, EBUSY},
                          {ERROR_LOCK_VIOLATION, EWOULDBLOCK},
                          {ERROR_IO_PENDING, EWOULDBLOCK},
                          {ERROR_FILE_EXISTS, EEXIST},
                          {ERROR_ALREADY_EXISTS, EEXIST},
                          {ERROR_DIR_NOT_EMPTY, ENOTEMPTY},
                          {ERROR_DISK_FULL, ENOSPC},
                          {ERROR_HANDLE_DISK_FULL, ENOSPC},
                          {ERROR_NOT_ENOUGH_MEMORY, ENOMEM},
                          {ERROR_OUTOFMEMORY, ENOMEM},
                          {ERROR_NO_SYSTEM_RESOURCES, ENOMEM},
                          {ERROR_TOO_MANY_OPEN_FILES, EMFILE},
                          {ERROR_FILENAME_EXCED_RANGE, ENAMETOOLONG},
                          {ERROR_NOT_SAME_DEVICE, EXDEV},
                          {ERROR_BROKEN_PIPE, EPIPE},
                          {ERROR_NO_DATA, EPIPE},
                          {ERROR_PRIVILEGE_NOT_HELD, EPERM},
                          {ERROR_NOT_SUPPORTED, ENOTSUP},
                          {ERROR_INVALID_FUNCTION, EINVAL},
                          {ERROR_INVALID_PARAMETER, EINVAL},
                          {ERROR_INVALID_HANDLE, EBADF}};
  const auto* const same = std::ranges::find(all, error, &Same::windows);
  errno = same != std::end(all) ? same->posix : EIO;
  return false;
}

std::wstring native(std::string_view path) {
  std::wstring given;
  try {
    given = path_of(path).native();
  } catch (const std::system_error&) {
    // It is not UTF-8.
  }
  std::wstring full(32768, L'\0');
  const DWORD size =
      given.empty() || given.find(L'\0') != given.npos
          ? 0
          : GetFullPathNameW(given.c_str(), static_cast<DWORD>(full.size()), full.data(), nullptr);
  if (size == 0 || size >= full.size()) {
    errno = size == 0 ? ENOENT : ENAMETOOLONG;
    return {};
  }
  full.resize(size);
  // Devices, and paths that are long already.
  if (full.starts_with(L"\\\\.\\") || full.starts_with(L"\\\\?\\")) return full;
  return full.starts_with(L"\\\\") ? L"\\\\?\\UNC\\" + full.substr(2) : L"\\\\?\\" + full;
}

std::string utf8(std::wstring_view wide) {
  const auto size = static_cast<int>(wide.size());
  std::string text(3 * wide.size(), '\0');
  text.resize(static_cast<std::size_t>(WideCharToMultiByte(CP_UTF8, 0, wide.data(), size, text.data(),
                                                           static_cast<int>(text.size()), nullptr, nullptr)));
  return text;
}

std::string text(std::wstring_view path) {
  std::wstring plain(path);
  if (plain.starts_with(L"\\\\?\\UNC\\"))
    plain.replace(0, 8, L"\\\\");
  else if (plain.starts_with(L"\\\\?\\"))
    plain.erase(0, 4);
  std::ranges::replace(plain, L'\\', L'/');
  return utf8(plain);
}

}  // namespace windows

FileSystem& files_of_system() {
  // Never destroyed: files may be closed when the process ends.
  static FileSystem& all = *new SystemFiles;
  return all;
}

unsigned mode_of_new_folders() { return 0777; }

std::string path_of_open_file(int file) {
  std::wstring name(32768, L'\0');
  name.resize(
      GetFinalPathNameByHandleW(windows::handle_of(file), name.data(), static_cast<DWORD>(name.size()), 0));
  return windows::text(name);
}

}  // namespace tagrid
