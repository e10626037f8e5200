// Seccomp: which calls of the system a process can make.
#pragma once

namespace tagrid {

/// From now on, this process and its threads can make only those calls that reading files, computing and
/// answering takes: no sockets, no processes, no programs, no changes of folders. Any other call fails as if
/// the system did not know it. Throws WorldError.
void allow_calls_of_readers();

}  // namespace tagrid
