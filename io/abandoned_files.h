// What killed runs leave beside their outputs: files that no running process holds any more.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tagrid {

/// Holds a temporary file, open for writing, until its descriptor is closed. False where somebody else
/// removes it at this moment: another file has to be made. On a file system without locks nothing is held,
/// and nothing is ever removed.
bool hold_temporary(int descriptor);

/// Holds a file that is open for reading alike, as far as that is possible.
void hold_for_reading(int descriptor);

/// Removes the temporaries (see temporary_name()) beside each of `outputs` that would have become that
/// output, or were kept of the one before, and that no process holds. Looks at each folder once. Returns how
/// many; what cannot be removed is left.
std::size_t remove_abandoned_files(const std::vector<std::string>& outputs);

}  // namespace tagrid
