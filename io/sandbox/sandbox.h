// A program that parses untrusted files with large libraries confines itself before it opens the first one.
// If a malicious file takes it over, it cannot write, connect, start a program, or read other files.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// False if the environment says TAGRID_SANDBOX=off.
bool sandbox_is_on();

/// The parts of the sandbox on this machine, for users: "Landlock 7, seccomp".
std::string sandbox_in_words();

/// What a reader may open besides the file that it is given: regular files of the same directory whose names are not
/// hidden.
struct FilesBeside {
  /// True if the file called `own` may need the one called `other`. None if it is empty.
  std::function<bool(std::string_view own, std::string_view other)> may_need = {};
  /// The reader looks for them, so it may list the directory.
  bool are_listed = false;
  /// True if a file of this name names files anywhere below its directory.
  std::function<bool(std::string_view own)> names_a_tree = {};
};

/// Confines this process for the rest of its life, with all threads that it starts. It can then read only `path` and
/// what is `beside` it, or all of `path` if that is a directory, the targets of links among these and, of a directory,
/// of links behind links to directories, and what libraries need. Entries of a directory whose names are hidden are no
/// part of a scan, except those of Zarr (.zarray). If only the directory `part` of `path` is read, links in other ones
/// are not looked for, which would take long where many parts are read one after another. Has no effect if the sandbox
/// is off; without Landlock (Linux 5.13), files are not protected. Throws WorldError if the system refuses. REQUIRES:
/// this process has one thread.
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
