// A program that parses untrusted files with large libraries confines itself before it opens the first one.
// If a malicious file takes it over, it cannot write, connect, start a program, or read other files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// False if the environment says TAGRID_SANDBOX=off.
bool sandbox_is_on();

/// The parts of the sandbox on this machine, for users: "Landlock 7, seccomp".
std::string sandbox_in_words();

/// What a reader may open besides its source: regular files in the same directory that are not
/// hidden.
struct FilesBeside {
  /// True if the file called `own` may need the one called `other`. None if it is null.
  bool (*may_need)(std::string_view own, std::string_view other) = nullptr;
  /// True if the reader searches for these files, and must therefore be able to list the directory.
  bool are_listed = false;
  /// True if a file of this name names files anywhere below its directory.
  bool (*names_a_tree)(std::string_view own) = nullptr;
};

/// Confines this process for the rest of its life, with all threads that it starts. It can then
/// read only what libraries need, `path`, and what is `beside` it. If `path` is a directory, it can
/// read everything in it except hidden entries; those of Zarr (.zarray) can be read. If one of
/// these files is a link, its target can also be read, and in a directory also the links in
/// directories that its links lead to. If only the directory `part` of `path` is read, links in
/// other directories are not followed: finding them takes long where many parts are read, each by
/// its own process. Has no effect if the sandbox is off; without Landlock (Linux 5.13), files are
/// not protected. Throws WorldError if the system refuses, and on Windows. REQUIRES: this process has one thread.
void confine_to(const std::string& path, const FilesBeside& beside, const std::string& part = "");

/// The version of Landlock, which decides what files a process can open
/// (https://docs.kernel.org/userspace-api/landlock.html); 0 if it has none, or if it is switched off.
int landlock_version();

/// What a process can open, only for reading. Paths that are missing are skipped.
struct Readable {
  std::vector<std::string> paths;   ///< files, and directories with all that is below them
  std::vector<std::string> listed;  ///< directories that can be listed, with those below them
};

/// From now on, this thread can open only what is `readable`. It cannot change a directory, execute a file, or reach
/// TCP ports and processes outside. Has no effect if landlock_version() is 0. Throws WorldError.
void allow_reading_only(const Readable& readable);

/// Seccomp: from now on, this process and its threads can make only the system calls for reading files,
/// computing and answering: no sockets, no processes, no programs, no changes to directories. Any other call
/// fails with ENOSYS. Throws WorldError.
void allow_calls_of_readers();

}  // namespace tagrid
