// The environment of programs that read and write formats.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// What such programs are started with, each as NAME=VALUE: what they need to start, to find their parts and to write
/// temporary files, and LC_ALL=C. Other variables of this process, such as keys of clouds and tokens, are no business
/// of a program that opens untrusted files. docs/readers.md lists them.
std::vector<std::string> environment_of_programs();

}  // namespace tagrid
