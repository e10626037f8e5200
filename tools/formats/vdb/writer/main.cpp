// tagrid-write-vdb: writes volumes as grids of OpenVDB files.

#include "tools/formats/vdb/openvdb_library.h"
#include "tools/formats/vdb/writer/vdb_output.h"

int main() {
  const tagrid::OpenVdbLibrary library;
  return tagrid::serve_writer("vdb", tagrid::begin_vdb);
}
