// Landlock: which files a process can open. https://docs.kernel.org/userspace-api/landlock.html
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// The version of the kernel's interface; 0 if it has none, or if it is switched off.
int landlock_version();

/// From now on, this thread can open only files at and below `paths`, and only for reading. It cannot change
/// a directory, execute a file, or reach TCP ports and processes outside. Missing paths are skipped. Has no
/// effect if landlock_version() is 0. Throws WorldError.
void allow_reading_only(const std::vector<std::string>& paths);

}  // namespace tagrid
