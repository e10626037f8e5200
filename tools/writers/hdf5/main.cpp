// tagrid-write-hdf5: writes volumes as data sets of HDF5 and VTKHDF files, and meshes as VTKHDF files.

#include "tools/writers/hdf5/hdf5_mesh.h"
#include "tools/writers/hdf5/hdf5_output.h"

int main() { return tagrid::serve_writer("hdf5", tagrid::begin_hdf5, tagrid::begin_hdf5_mesh); }
