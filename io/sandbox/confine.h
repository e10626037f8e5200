// A program that parses untrusted files confines itself before it opens the first one. If a malicious file
// takes it over, it cannot write, connect, start a program, or read other files.
#pragma once

#include <string>

namespace tagrid {

/// Confines this process for the rest of its life, with all threads that it starts. It can then read only the
/// directory of `path` (or `path`, if it is a directory), the targets of links in that directory, and what
/// libraries need. Has no effect if the sandbox is off; without Landlock (Linux 5.13), files are not
/// protected. Throws WorldError if the system refuses. REQUIRES: this process has one thread.
void confine_to(const std::string& path);

}  // namespace tagrid
