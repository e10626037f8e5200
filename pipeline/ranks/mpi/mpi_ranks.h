// Ranks that mpirun started.
#pragma once

#include <memory>

#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Starts MPI. What is returned ends it, and must not outlive main().
std::unique_ptr<Ranks> start_mpi();

/// Ends the processes of all ranks at once, this one with `code`: where they cannot agree any more.
[[noreturn]] void abort_mpi(int code);

}  // namespace tagrid
