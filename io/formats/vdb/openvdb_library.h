// OpenVDB's headers, and what both programs need of its settings.
#pragma once

// The library's headers cause warnings that we do not fix.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>
#pragma GCC diagnostic pop
#include <tbb/global_control.h>

#include <cstdlib>

namespace tagrid {

/// Prepares the library; must live as long as it is used.
class OpenVdbLibrary {
 public:
  OpenVdbLibrary() {
    // Leaves are read when they are needed, and files say where these are, whatever the user's environment
    // says.
    unsetenv("OPENVDB_DISABLE_DELAYED_LOAD");
    openvdb::initialize();
  }

 private:
  // tagrid uses the cores; and each thread would take memory of its own.
  tbb::global_control one_thread_{tbb::global_control::max_allowed_parallelism, 1};
};

}  // namespace tagrid
