// What files are besides their bytes: which one, whose, of what time.
#pragma once

#include <sys/types.h>
#include <time.h>

#include <optional>
#include <string>

namespace tagrid {

/// What a file that takes another one's place takes over from it.
struct FileAttributes {
  mode_t mode = 0;  ///< the permissions: lowest nine bits
  uid_t owner = 0;
  gid_t group = 0;
  timespec accessed = {}, modified = {};
};

/// Those of a regular file; nothing for "-", for what does not exist, and for devices and pipes.
std::optional<FileAttributes> attributes_of(const std::string& path);

/// Gives a new and empty file the owner, where that is allowed, and the permissions. A group that cannot be
/// given gets no more than everybody.
void set_permissions(int descriptor, const FileAttributes& attributes);

/// Whether `path` is, or is going to be, a regular file: not "-", a device, a pipe.
bool is_regular_output(const std::string& path);

/// Throws UsageError if writing to `output` would write to `input`: the same device and inode, by whatever
/// names. "-" are the standard streams.
void refuse_same_file(const std::string& input, const std::string& output);

}  // namespace tagrid
