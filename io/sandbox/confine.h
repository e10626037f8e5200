// A program that parses files of strangers locks itself up before it opens the first one: what a malicious
// file makes of it can neither write, nor connect, nor start a program, nor read other files.
#pragma once

#include <string>

namespace tagrid {

/// Confines this process for the rest of its life, with all threads that it starts. It can then open for
/// reading only the folder of `path` (or `path`, if it is a folder), what links in that folder lead to, and
/// what libraries need. Without effect if the sandbox is off; without Landlock (Linux 5.13), files are not
/// protected. Throws WorldError if the system refuses. REQUIRES: this process has one thread.
void confine_to(const std::string& path);

}  // namespace tagrid
