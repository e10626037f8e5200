// tagrid-read-hdf5: reads data sets of HDF5 files.

#include "tools/formats/hdf5/reader/hdf5_volumes.h"

int main() { return tagrid::serve_volumes("hdf5", tagrid::open_hdf5); }
