// What killed runs leave beside their outputs: temporaries that no running process holds any more. Only of
// local file systems: on those of a network a lock may be seen by one machine only, or forbid reading.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tagrid {

/// Whether an open file, or folder, is on a local file system.
bool is_local(int descriptor);

/// Holds a new temporary until its descriptor is closed. False where it was taken for an abandoned one at
/// this moment, and removed: another one has to be made.
bool hold_temporary(int descriptor);

/// Removes the files of temporary_name() beside each of `outputs` that would have become that output, and
/// that no process holds. Looks at each folder once. Returns how many; what cannot be removed is left.
std::size_t remove_abandoned_files(const std::vector<std::string>& outputs);

}  // namespace tagrid
