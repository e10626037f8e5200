// The module tagrid._tagrid: libtagrid as it is. The package around it is what people use.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "encoder.h"
#include "reader.h"
#include "tagrid/tagrid.h"

namespace {

namespace py = pybind11;
using namespace pybind11::literals;
using tagrid_python::Encoder;
using tagrid_python::Reader;

void bind_reader(py::module_& module) {
  py::class_<Reader>(module, "Reader")
      .def_static("of_path", &Reader::of_path, "path"_a)
      .def_static("of_buffer", &Reader::of_buffer, "buffer"_a, "name"_a)
      .def_static("of_object", &Reader::of_object, "read_at"_a, "size"_a, "name"_a)
      .def("close", &Reader::close)
      .def_property_readonly("closed", &Reader::is_closed)
      .def("info", &Reader::info)
      .def("metadata", &Reader::metadata)
      .def("brick", &Reader::brick, "number"_a)
      .def("overviews", &Reader::overviews)
      .def("overview", &Reader::overview, "factor"_a)
      .def("volumes", &Reader::volumes)
      .def("volume", &Reader::volume, "number"_a)
      .def("read", &Reader::read, "low"_a, "high"_a, "step"_a, py::arg("out").noconvert(), "threads"_a,
           "memory_limit"_a, "progress"_a)
      .def("verify", &Reader::verify, "threads"_a, "memory_limit"_a, "progress"_a)
      .def("levels", &Reader::levels, "threads"_a, "memory_limit"_a, "progress"_a)
      .def("mesh", &Reader::mesh, "level"_a, "padded"_a, "box"_a, "threads"_a, "memory_limit"_a, "progress"_a)
      .def("material_mesh", &Reader::material_mesh, "options"_a, "materials"_a, "box"_a, "threads"_a,
           "memory_limit"_a, "progress"_a)
      .def("surface", &Reader::surface, "iso"_a, "rescaled"_a, "level"_a, "close"_a, "box"_a, "threads"_a,
           "memory_limit"_a, "progress"_a);
}

void bind_encoder(py::module_& module) {
  py::class_<Encoder>(module, "Encoder")
      .def(py::init<const py::dict&, py::function, py::object, int, std::uint64_t, py::object>(), "options"_a,
           "write"_a, "read"_a, "threads"_a, "memory_limit"_a, "progress"_a)
      .def("write", &Encoder::write, py::arg("slices").noconvert())
      .def("finish", &Encoder::finish)
      .def("close", &Encoder::close);
}

}  // namespace

PYBIND11_MODULE(_tagrid, module) {
  module.doc() = "libtagrid as it is; use the package tagrid.";
  module.def("library_version", &tagrid_version);
  bind_reader(module);
  bind_encoder(module);
  tagrid_python::end_calls_with_python();
}
