// The ranks of processes that mpirun started.
#pragma once

#include <memory>

#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Starts MPI. The returned object ends it, and must not outlive main().
std::unique_ptr<Ranks> start_mpi();

/// Ends the processes of all ranks at once, this one with `code`, if they can no longer agree.
[[noreturn]] void abort_mpi(int code);

}  // namespace tagrid
