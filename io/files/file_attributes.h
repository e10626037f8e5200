// Attributes of files: identity, owner, permissions and times; and whether they change.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/system/files.h"

namespace tagrid {

/// The attributes that a file inherits when it replaces another one.
struct FileAttributes {
  unsigned mode = 0;  ///< the permissions: lowest nine bits
  std::uint32_t owner = 0, group = 0;
  FileTime accessed = {}, modified = {};
};

/// The attributes of a regular file; nothing for "-", missing files, devices and pipes.
std::optional<FileAttributes> attributes_of(const std::string& path);

/// Gives a new and empty file the owner, if that is allowed, and the permissions. If the group cannot be set,
/// the group gets no more permissions than everybody.
void set_permissions(int descriptor, const FileAttributes& attributes);

/// Gives a file the times. If they cannot be set, the file is still good.
void set_times(int descriptor, const FileAttributes& attributes);

/// True if `path` is a regular file or a declared source, or "-" and the standard input is a regular file:
/// open_source() reads it in any order.
bool is_regular_input(const std::string& path);

/// True if `path` is a directory; throws if that cannot be known.
bool is_folder(const std::string& path);

/// The path without links; nothing if there is no file. Throws WorldError.
std::optional<std::filesystem::path> without_links(const std::filesystem::path& path);
/// The absolute path without links, as far as it exists; what follows has no "..". Throws WorldError if nobody can look.
std::filesystem::path real_path(const std::filesystem::path& path);
/// The same, or the absolute path as it is given if nobody can look.
std::filesystem::path real_path_if_known(const std::filesystem::path& path);
/// True if the path begins with that of the folder. Compares names alone; see without_links().
bool is_below(const std::filesystem::path& path, const std::filesystem::path& folder);

/// True if `path` is a regular file or a directory: something that can be opened again and gives the same.
bool is_file_or_folder(const std::string& path);

/// Bytes of all of these that are regular files; others count as none.
std::uint64_t size_of_files(const std::vector<std::string>& files);

/// True if `path` is, or would become, a regular file: not "-", a device or a pipe.
bool is_regular_output(const std::string& path);

/// Throws UsageError if writing to `output` would write to `input`: if both have the same device and inode,
/// whatever their names. "-" stands for the standard streams.
void refuse_same_file(const std::string& input, const std::string& output);

/// A file that was changed less than so many seconds before somebody looked at it may change again without getting
/// other times: these have steps, and clocks of file servers may be slow.
inline constexpr std::int64_t doubt_of_times = 3;

/// True if it is still this file, and has not changed, not even its time of a change (ctime). Throws WorldError.
bool is_untouched(const std::string& path, const FileStatus& was);

/// Files that must not change while they are read: their sizes, times and inodes.
class UnchangedFiles {
 public:
  /// Ignores the standard input ("-"), pipes and devices, whose times say nothing. Throws WorldError.
  explicit UnchangedFiles(const std::vector<std::string>& files);

  /// Bytes of memory that this class needs for these files, with a copy of their names.
  static std::uint64_t memory(const std::vector<std::string>& files);

  /// Throws BrokenInput if one of the files has changed.
  void require() const;

  /// The same for a last look: it opens the files, as network file systems need not ask their server otherwise.
  void require_opened() const;

  /// The first file that was written, linked or given other rights since, although its size, time and inode
  /// are the same: a program may have set its time back. Returns "" if no file was touched.
  std::string touched() const;
  /// True if is_untouched() is, for all of them.
  bool are_untouched() const;
  std::vector<std::string> paths() const;
  /// When the last one of them was changed or touched, in seconds since 1970; 0 if there are none.
  std::int64_t last_change() const;

 private:
  struct Known {
    std::string path;
    FileStatus status;
  };
  std::vector<Known> files_;
};

}  // namespace tagrid
