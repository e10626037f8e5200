// tagrid-read-vdb: reads grids of OpenVDB files.

#include "tools/readers/vdb/vdb_volumes.h"
#include "tools/vdb/openvdb_library.h"

int main() {
  const tagrid::OpenVdbLibrary library;
  return tagrid::serve_volumes("vdb", tagrid::open_vdb);
}
