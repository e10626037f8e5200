// The environment of programs that read and write formats.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// The variables with which such programs are started, each as NAME=VALUE: those that they need to
/// start, to find their parts and to write temporary files, and LC_ALL=C. docs/readers.md lists
/// them. Other variables of this process, such as cloud keys and tokens, are not passed on, because
/// these programs open untrusted files.
std::vector<std::string> environment_of_programs();

}  // namespace tagrid
