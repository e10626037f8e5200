// Files, directories and pipes of the operating system. Whatever writes a user's files calls files(), which
// tests replace.
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tagrid {

class BrokenInput;

constexpr int standard_input = 0, standard_output = 1, standard_error = 2;

struct FileTime {
  std::int64_t seconds = 0, nanoseconds = 0;
  /// Since 1970.
  std::int64_t in_nanoseconds() const { return seconds * 1'000'000'000 + nanoseconds; }
  bool operator==(const FileTime&) const = default;
};

enum class FileType { regular, folder, link, other };

struct FileStatus {
  FileType type = FileType::other;
  std::uint64_t size = 0;
  unsigned mode = 0;  ///< the permissions: lowest nine bits
  std::uint32_t owner = 0, group = 0;
  FileTime accessed, modified, changed;
  std::uint64_t device = 0, number = 0;  ///< together: which file it is
  std::uint64_t links = 0;               ///< names that it has
  std::uint64_t stored = 0;              ///< bytes that it takes, without gaps

  bool is_file() const { return type == FileType::regular; }
  bool is_folder() const { return type == FileType::folder; }
  bool is_link() const { return type == FileType::link; }
  bool is_same_file(const FileStatus& other) const {
    return device == other.device && number == other.number;
  }
};

/// Something in a directory; `type` is that of a link itself.
struct FolderEntry {
  std::string name;
  FileType type = FileType::other;
};

/// How a file is opened.
struct Opening {
  bool read = false, write = false;
  bool creates = false;  ///< if it does not exist
  bool is_new = false;   ///< with `creates`: fails with EEXIST if it exists
  bool empties = false;
  bool follows_link = true;
  bool waits = true;  ///< for the other end of a pipe
  unsigned mode = 0666;
};

/// Room for files.
struct Room {
  std::uint64_t bytes = 0;
  bool is_in_memory = false;  ///< Files there use memory.
};

/// The files of a system. An open file is a number, as in POSIX; negative: none. Calls that fail return a
/// negative number or false, and errno says why. They repeat what a signal interrupts. Several threads may
/// use it.
class FileSystem {
 public:
  virtual ~FileSystem() = default;

  virtual int open(const std::string& path, const Opening& how) = 0;
  virtual int open_folder(const std::string& path) = 0;
  /// A new file in a folder that has no name.
  virtual int open_nameless(const std::string& folder) = 0;
  virtual int duplicate(int file) = 0;
  /// The file is closed also on failure: network file systems report some failed writes only here.
  virtual bool close(int file) = 0;

  /// Reads from the position of the file on; returns the number of bytes, 0 at the end. EAGAIN: there are
  /// none yet.
  virtual std::ptrdiff_t read(int file, std::span<std::byte> to) = 0;
  /// Reads anywhere; returns the number of bytes, 0 at the end.
  virtual std::ptrdiff_t read_at(int file, std::uint64_t position, std::span<std::byte> to) = 0;
  /// Writes at the position of the file; returns the number of bytes.
  virtual std::ptrdiff_t write(int file, std::span<const std::byte> bytes) = 0;
  /// Writes all of `bytes`, anywhere.
  virtual bool write_at(int file, std::uint64_t position, std::span<const std::byte> bytes) = 0;
  /// The position of a file, or -1.
  virtual std::int64_t position(int file) = 0;
  virtual bool seek(int file, std::uint64_t position) = 0;
  /// Says that the file will be read from its beginning to its end.
  virtual void reads_in_order(int file) = 0;
  virtual bool resize(int file, std::uint64_t size) = 0;
  /// Makes the bytes of a file, or the names in a directory, durable.
  virtual bool sync(int file) = 0;

  virtual bool status(int file, FileStatus& status) = 0;
  /// That of a symbolic link itself unless it `follows_link`.
  virtual bool status(const std::string& path, bool follows_link, FileStatus& status) = 0;
  virtual bool is_executable(const std::string& path) = 0;
  virtual bool set_owner(int file, std::uint32_t owner) = 0;
  virtual bool set_group(int file, std::uint32_t group) = 0;
  virtual bool set_mode(int file, unsigned mode) = 0;
  virtual bool set_mode(const std::string& path, unsigned mode) = 0;
  virtual bool set_times(int file, FileTime accessed, FileTime modified) = 0;

  /// Locks a file for this opening alone until it is closed. Without waiting: EWOULDBLOCK if another has it.
  virtual bool lock(int file, bool waits) = 0;
  /// True if locks are seen by all who can open the file.
  virtual bool is_local(int file) = 0;

  /// Replaces a file that has the new name.
  virtual bool rename(const std::string& from, const std::string& to) = 0;
  /// Fails with EEXIST if something has the new name.
  virtual bool rename_to_new(const std::string& from, const std::string& to) = 0;
  /// Exchanges two names. EINVAL or ENOSYS if the file system cannot.
  virtual bool exchange(const std::string& a, const std::string& b) = 0;
  /// Gives a file a second name.
  virtual bool link(const std::string& from, const std::string& to) = 0;
  virtual bool unlink(const std::string& path) = 0;
  virtual bool make_folder(const std::string& path, unsigned mode = 0777) = 0;
  /// Removes an empty directory.
  virtual bool remove_folder(const std::string& path) = 0;
  /// Replaces `entries` by those of a directory, in any order.
  virtual bool list(const std::string& folder, std::vector<FolderEntry>& entries) = 0;
  /// The path without links, dots and double dots.
  virtual bool resolve(const std::string& path, std::string& resolved) = 0;
  virtual bool room(const std::string& folder, Room& room) = 0;
};

FileSystem& files_of_system();
/// The files of this process: those of the system, unless a FilesInstead exists.
FileSystem& files();

/// For tests: while it exists, files() is another one.
class FilesInstead {
 public:
  explicit FilesInstead(FileSystem& files);
  ~FilesInstead();
  FilesInstead(const FilesInstead&) = delete;
  FilesInstead& operator=(const FilesInstead&) = delete;

 private:
  FileSystem* before_;
};

/// An open file, which the destructor closes. It stands for its number in calls; negative: none.
class Descriptor {
 public:
  Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    reset();
    number_ = other.release();
    return *this;
  }
  ~Descriptor() { reset(); }

  operator int() const { return number_; }
  /// The caller must close the file.
  int release() { return std::exchange(number_, -1); }
  void reset();

 private:
  int number_;
};

/// The folder of a path: "." if the path names none.
std::string folder_of(const std::string& path);

/// The status of a file. Returns nothing if no file has this path, or can have it, or if its links lead nowhere or in a
/// circle. Throws WorldError if the system cannot tell: nobody may take such a name for a free one.
std::optional<FileStatus> status_of(const std::string& path);
/// The same, but of a symbolic link itself, not of the file that it leads to.
std::optional<FileStatus> status_of_name(const std::string& path);
/// True if it is a regular file, or a directory. False also if the system cannot tell.
bool is_file(const std::string& path) noexcept;
bool is_file(const std::string& folder, const FolderEntry& entry) noexcept;
bool is_folder(const std::string& folder, const FolderEntry& entry) noexcept;
/// True if both paths lead to one file. False also if the system cannot tell.
bool is_same_file(const std::string& a, const std::string& b) noexcept;

/// True for a symbolic link that leads to no file, or in a circle. Throws WorldError if the system cannot tell.
bool is_dead_link(const std::string& path);
/// What to say about such a link as an input: git-annex and DataLad leave them where they keep no content.
BrokenInput dead_link(const std::string& path);

/// Makes the names in a directory survive a crash of the machine. Returns 0 or an errno. It is not a failure
/// if folders cannot be opened or synced, as on some file systems.
int sync_folder(const std::string& folder);

/// Removes a directory with all that is in it. Returns false if anything stays.
bool remove_with_files(const std::string& folder);

/// The permissions of a new directory.
unsigned mode_of_new_folders();
/// A path under which this process and its children can open an open file that may have no name.
std::string path_of_open_file(int file);

/// Makes a call of the system, and repeats it if a signal interrupts it: for the sources of this room, whose
/// own calls repeat. Not for close(), which closes the file anyway.
template <class Call>
auto uninterrupted(Call call) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

/// What is waited for: bytes of a pipe or socket, or room in it.
struct Awaited {
  int file = -1;  ///< negative: nothing
  bool is_room = false;
  bool is_ready = false;  ///< Set by wait_for(): also if there is an error, or nothing will come.
};
/// Waits until one of them is ready, for at most so many milliseconds; negative: for ever. Returns the number
/// of those that are ready, or -1; EINTR after a signal.
int wait_for(std::span<Awaited> all, int milliseconds);

}  // namespace tagrid
