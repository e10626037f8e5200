// What the library says of a file, as dictionaries, and the types of samples as those of numpy.
#pragma once

#include <pybind11/numpy.h>

#include <string>

#include "tagrid/tagrid.h"

namespace tagrid_python {

namespace py = pybind11;

/// The keys are the members of tagrid_info; numbers of three axes are tuples x, y, z.
py::dict dict_of(const tagrid_info& info);
py::dict dict_of(const tagrid_brick& brick);

py::dtype dtype_of(tagrid_type type);
/// Raises TypeError if the library has no such type of samples, or if the bytes are swapped.
tagrid_type type_of(const py::dtype& dtype);

}  // namespace tagrid_python
