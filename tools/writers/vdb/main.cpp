// tagrid-write-vdb: writes volumes as grids of OpenVDB files.

#include "tools/vdb/openvdb_library.h"
#include "tools/writers/vdb/vdb_output.h"

int main() {
  const tagrid::OpenVdbLibrary library;
  return tagrid::serve_writer("vdb", tagrid::begin_vdb);
}
