#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstdio>
#include <cstdlib>

#include "io/system/files.h"

namespace tagrid {
namespace {

constexpr std::size_t most_at_once = std::size_t{1} << 30;

FileTime time_of(const timespec& time) { return {time.tv_sec, time.tv_nsec}; }
timespec timespec_of(const FileTime& time) {
  return {static_cast<time_t>(time.seconds), static_cast<long>(time.nanoseconds)};
}

FileStatus status_from(const struct stat& found) {
  constexpr std::uint64_t stat_block = 512;
  FileStatus status;
  status.type = S_ISREG(found.st_mode)   ? FileType::regular
                : S_ISDIR(found.st_mode) ? FileType::folder
                : S_ISLNK(found.st_mode) ? FileType::link
                                         : FileType::other;
  status.size = static_cast<std::uint64_t>(std::max<off_t>(found.st_size, 0));
  status.mode = found.st_mode & 0777;
  status.owner = found.st_uid;
  status.group = found.st_gid;
  status.accessed = time_of(found.st_atim);
  status.modified = time_of(found.st_mtim);
  status.changed = time_of(found.st_ctim);
  status.device = found.st_dev;
  status.number = found.st_ino;
  status.links = found.st_nlink;
  status.stored = static_cast<std::uint64_t>(found.st_blocks) * stat_block;
  return status;
}

FileType type_of(const std::string& folder, const dirent& entry) {
  if (entry.d_type == DT_REG) return FileType::regular;
  if (entry.d_type == DT_DIR) return FileType::folder;
  if (entry.d_type == DT_LNK) return FileType::link;
  struct stat found = {};
  if (entry.d_type != DT_UNKNOWN || lstat((folder + "/" + entry.d_name).c_str(), &found) != 0)
    return FileType::other;
  return status_from(found).type;
}

class SystemFiles final : public FileSystem {
 public:
  int open(const std::string& path, const Opening& how) override {
    const int flags = O_CLOEXEC |
                      (how.read && how.write ? O_RDWR
                       : how.write           ? O_WRONLY
                                             : O_RDONLY) |
                      (how.creates ? O_CREAT : 0) | (how.is_new ? O_EXCL : 0) | (how.empties ? O_TRUNC : 0) |
                      (how.follows_link ? 0 : O_NOFOLLOW) | (how.waits ? 0 : O_NONBLOCK);
    return uninterrupted([&] { return ::open(path.c_str(), flags, how.mode); });
  }
  int open_folder(const std::string& path) override {
    return uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
  }
  int open_nameless(const std::string& folder) override {
    const int file =
        uninterrupted([&] { return ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600); });
    if (file >= 0) return file;
    // Some network file systems have no nameless files: create one with a name, then remove the name.
    std::string path = folder + "/.tagrid.spoolXXXXXX";
    const int named = mkostemp(path.data(), O_CLOEXEC);
    if (named < 0 || ::unlink(path.c_str()) == 0) return named;
    const int error = errno;
    ::close(named);
    errno = error;
    return -1;
  }
  int duplicate(int file) override { return fcntl(file, F_DUPFD_CLOEXEC, 0); }
  bool close(int file) override { return ::close(file) == 0 || errno == EINTR; }

  std::ptrdiff_t read(int file, std::span<std::byte> to) override {
    return uninterrupted([&] { return ::read(file, to.data(), std::min(to.size(), most_at_once)); });
  }
  std::ptrdiff_t read_at(int file, std::uint64_t position, std::span<std::byte> to) override {
    return uninterrupted([&] {
      return pread(file, to.data(), std::min(to.size(), most_at_once), static_cast<off_t>(position));
    });
  }
  std::ptrdiff_t write(int file, std::span<const std::byte> bytes) override {
    return uninterrupted([&] { return ::write(file, bytes.data(), std::min(bytes.size(), most_at_once)); });
  }
  bool write_at(int file, std::uint64_t position, std::span<const std::byte> bytes) override {
    while (!bytes.empty()) {
      const auto count = uninterrupted([&] {
        return pwrite(file, bytes.data(), std::min(bytes.size(), most_at_once), static_cast<off_t>(position));
      });
      if (count < 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      position += static_cast<std::uint64_t>(count);
    }
    return true;
  }
  std::int64_t position(int file) override { return lseek(file, 0, SEEK_CUR); }
  bool seek(int file, std::uint64_t position) override {
    return lseek(file, static_cast<off_t>(position), SEEK_SET) >= 0;
  }
  void reads_in_order(int file) override { posix_fadvise(file, 0, 0, POSIX_FADV_SEQUENTIAL); }
  bool resize(int file, std::uint64_t size) override {
    return uninterrupted([&] { return ftruncate(file, static_cast<off_t>(size)); }) == 0;
  }
  bool sync(int file) override {
    return uninterrupted([&] { return fsync(file); }) == 0;
  }

  bool status(int file, FileStatus& status) override {
    struct stat found = {};
    if (fstat(file, &found) != 0) return false;
    status = status_from(found);
    return true;
  }
  bool status(const std::string& path, bool follows_link, FileStatus& status) override {
    struct stat found = {};
    if ((follows_link ? stat(path.c_str(), &found) : lstat(path.c_str(), &found)) != 0) return false;
    status = status_from(found);
    return true;
  }
  bool is_executable(const std::string& path) override { return access(path.c_str(), X_OK) == 0; }
  bool set_owner(int file, std::uint32_t owner) override {
    return fchown(file, owner, static_cast<gid_t>(-1)) == 0;
  }
  bool set_group(int file, std::uint32_t group) override {
    return fchown(file, static_cast<uid_t>(-1), group) == 0;
  }
  bool set_mode(int file, unsigned mode) override { return fchmod(file, mode) == 0; }
  bool set_mode(const std::string& path, unsigned mode) override { return chmod(path.c_str(), mode) == 0; }
  bool set_times(int file, FileTime accessed, FileTime modified) override {
    const timespec times[2] = {timespec_of(accessed), timespec_of(modified)};
    return futimens(file, times) == 0;
  }

  bool lock(int file, bool waits) override {
    return uninterrupted([&] { return flock(file, waits ? LOCK_EX : LOCK_EX | LOCK_NB); }) == 0;
  }
  bool is_local(int file) override {
    constexpr std::uint32_t zfs = 0x2FC12FC1;
    constexpr std::array<std::uint32_t, 7> local = {
        EXT4_SUPER_MAGIC, XFS_SUPER_MAGIC,       BTRFS_SUPER_MAGIC, F2FS_SUPER_MAGIC, zfs,
        TMPFS_MAGIC,      OVERLAYFS_SUPER_MAGIC,
    };
    struct statfs found = {};
    return fstatfs(file, &found) == 0 &&
           std::ranges::count(local, static_cast<std::uint32_t>(found.f_type)) > 0;
  }

  bool rename(const std::string& from, const std::string& to) override {
    return std::rename(from.c_str(), to.c_str()) == 0;
  }
  bool rename_to_new(const std::string& from, const std::string& to) override {
    if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
    if (errno != EINVAL && errno != ENOSYS) return false;
    if (!link(from, to)) return false;
    if (unlink(from)) return true;
    const int error = errno;
    unlink(to);
    errno = error;
    return false;
  }
  bool exchange(const std::string& a, const std::string& b) override {
    return renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0;
  }
  bool link(const std::string& from, const std::string& to) override {
    return ::link(from.c_str(), to.c_str()) == 0;
  }
  bool unlink(const std::string& path) override { return ::unlink(path.c_str()) == 0; }
  bool make_folder(const std::string& path, unsigned mode) override { return mkdir(path.c_str(), mode) == 0; }
  bool remove_folder(const std::string& path) override { return rmdir(path.c_str()) == 0; }
  bool list(const std::string& folder, std::vector<FolderEntry>& entries) override {
    entries.clear();
    DIR* const opened = opendir(folder.c_str());
    if (opened == nullptr) return false;
    errno = 0;
    while (const dirent* entry = readdir(opened)) {
      const std::string_view name = entry->d_name;
      if (name != "." && name != "..") entries.push_back({std::string(name), type_of(folder, *entry)});
      errno = 0;
    }
    const int error = errno;
    closedir(opened);
    errno = error;
    return error == 0;
  }
  bool resolve(const std::string& path, std::string& resolved) override {
    char* const found = realpath(path.c_str(), nullptr);
    if (found == nullptr) return false;
    resolved = found;
    std::free(found);
    return true;
  }
  bool room(const std::string& folder, Room& room) override {
    struct statfs found = {};
    if (statfs(folder.c_str(), &found) != 0) return false;
    room.bytes = static_cast<std::uint64_t>(found.f_bavail) * static_cast<std::uint64_t>(found.f_bsize);
    const auto type = static_cast<std::uint32_t>(found.f_type);
    room.is_in_memory = type == TMPFS_MAGIC || type == RAMFS_MAGIC;
    return true;
  }
};

}  // namespace

FileSystem& files_of_system() {
  // Never destroyed: files may be closed when the process ends.
  static FileSystem& all = *new SystemFiles;
  return all;
}

unsigned mode_of_new_folders() {
  const mode_t mask = umask(0);
  umask(mask);
  return 0777u & ~mask;
}

std::string path_of_open_file(int file) { return fmt::format("/proc/{}/fd/{}", getpid(), file); }

int wait_for(std::span<Awaited> all, int milliseconds) {
  std::array<pollfd, 8> polled = {};
  for (std::size_t i = 0; i < all.size(); ++i)
    polled[i] = {all[i].file, static_cast<short>(all[i].is_room ? POLLOUT : POLLIN), 0};
  const int count = poll(polled.data(), all.size(), milliseconds);
  for (std::size_t i = 0; i < all.size(); ++i) all[i].is_ready = count > 0 && polled[i].revents != 0;
  return count;
}

}  // namespace tagrid
