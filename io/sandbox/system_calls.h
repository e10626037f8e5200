// Seccomp: which system calls a process can make.
#pragma once

namespace tagrid {

/// From now on, this process and its threads can make only the system calls for reading files, computing and
/// answering: no sockets, no processes, no programs, no changes to directories. Any other call fails with
/// ENOSYS. Throws WorldError.
void allow_calls_of_readers();

}  // namespace tagrid
