// tagrid-write-hdf5: writes volumes as data sets of HDF5 and VTKHDF files, and meshes as VTKHDF files.

#include <hdf5.h>

#include "tools/formats/hdf5/writer/hdf5_mesh.h"
#include "tools/formats/hdf5/writer/hdf5_output.h"

int main() {
  // At the end of the program, version 1.10 of the library crashes on a file that it could not close.
  H5dont_atexit();
  return tagrid::serve_writer("hdf5", tagrid::begin_hdf5, tagrid::begin_hdf5_mesh);
}
