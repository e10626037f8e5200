// tagrid-read-vdb: reads grids of OpenVDB files.

#include "tools/formats/vdb/openvdb_library.h"
#include "tools/formats/vdb/reader/vdb_volumes.h"

int main() {
  const tagrid::OpenVdbLibrary library;
  return tagrid::serve_volumes("vdb", tagrid::open_vdb);
}
