// A program that parses untrusted files with large libraries confines itself before it opens the first one.
// If a malicious file takes it over, it cannot write, connect, start a program, or read other files.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// False if the environment says TAGRID_SANDBOX=off.
bool sandbox_is_on();

/// The parts of the sandbox on this machine, for users: "Landlock 7, seccomp".
std::string sandbox_in_words();

/// Confines this process for the rest of its life, with all threads that it starts. It can then read only the
/// directory of `path` (or `path`, if it is a directory), the targets of links in that directory, and what
/// libraries need. Has no effect if the sandbox is off; without Landlock (Linux 5.13), files are not
/// protected. Throws WorldError if the system refuses. REQUIRES: this process has one thread.
void confine_to(const std::string& path);

/// The version of Landlock, which decides what files a process can open
/// (https://docs.kernel.org/userspace-api/landlock.html); 0 if it has none, or if it is switched off.
int landlock_version();

/// From now on, this thread can open only files at and below `paths`, and only for reading. It cannot change
/// a directory, execute a file, or reach TCP ports and processes outside. Missing paths are skipped. Has no
/// effect if landlock_version() is 0. Throws WorldError.
void allow_reading_only(const std::vector<std::string>& paths);

/// Seccomp: from now on, this process and its threads can make only the system calls for reading files,
/// computing and answering: no sockets, no processes, no programs, no changes to directories. Any other call
/// fails with ENOSYS. Throws WorldError.
void allow_calls_of_readers();

}  // namespace tagrid
