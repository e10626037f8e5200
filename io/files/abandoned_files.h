// Finds what killed runs leave beside their outputs: temporary files that no running process holds any more.
// Only on local file systems: on network file systems, a lock may be visible on one machine only, or may
// forbid reading.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tagrid {

/// True if an open file or folder is on a local file system.
bool is_local(int descriptor);

/// Holds a new temporary file until its descriptor is closed. Returns false if another process has just taken
/// it for abandoned and removed it; the caller must then create another one.
bool hold_temporary(int descriptor);

/// Removes the files with a temporary_name() beside each of `outputs` that would have become that output and
/// that no process holds. Searches each folder once. Returns the number of removed files; files that cannot
/// be removed are left.
std::size_t remove_abandoned_files(const std::vector<std::string>& outputs);
/// The same for hidden folders; see StagingFolder. Older files in them are left.
std::size_t remove_abandoned_folders(const std::vector<std::string>& outputs);

}  // namespace tagrid
