#include "info.h"

#include <pybind11/pybind11.h>

#include <array>

namespace tagrid_python {
namespace {

struct TypeName {
  tagrid_type type;
  const char* name;
};
constexpr std::array type_names = {TypeName{TAGRID_UINT8, "uint8"},     TypeName{TAGRID_INT8, "int8"},
                                   TypeName{TAGRID_UINT16, "uint16"},   TypeName{TAGRID_INT16, "int16"},
                                   TypeName{TAGRID_UINT32, "uint32"},   TypeName{TAGRID_INT32, "int32"},
                                   TypeName{TAGRID_FLOAT32, "float32"}, TypeName{TAGRID_FLOAT64, "float64"}};

template <class T>
py::tuple three(const T* numbers) {
  return py::make_tuple(numbers[0], numbers[1], numbers[2]);
}

}  // namespace

py::dtype dtype_of(tagrid_type type) {
  for (const TypeName& known : type_names)
    if (known.type == type) return py::dtype(known.name);
  throw py::type_error("the file has samples of a type that this version does not know");
}

tagrid_type type_of(const py::dtype& dtype) {
  for (const TypeName& known : type_names)
    if (dtype.equal(py::dtype(known.name))) return known.type;
  throw py::type_error("there are no samples of the type " + dtype.attr("str").cast<std::string>());
}

py::dict dict_of(const tagrid_info& info) {
  const tagrid_geometry& g = info.geometry;
  py::dict d;
  d["dims"] = three(info.dims);
  d["dtype"] = dtype_of(info.type);
  d["spacing"] = three(g.spacing);
  d["origin"] = three(g.origin);
  d["directions"] = py::make_tuple(three(g.directions[0]), three(g.directions[1]), three(g.directions[2]));
  d["has_spacing"] = g.has_spacing != 0;
  d["has_origin"] = g.has_origin != 0;
  d["has_directions"] = g.has_directions != 0;
  d["grid_only"] = info.grid_only != 0;
  d["grid_derived"] = info.grid_derived != 0;
  d["max_error"] = info.max_error;
  d["surface_error"] = info.surface_error;
  d["mesh_error"] = info.mesh_error;
  d["cube"] = info.cube;
  d["levels"] = info.levels;
  d["accuracy"] = info.accuracy;
  d["field_scale"] = info.field_scale;
  d["range"] = py::make_tuple(info.range[0], info.range[1]);
  d["achieved_max_error"] = info.achieved_max_error;
  d["achieved_rmse"] = info.achieved_rmse;
  d["achieved_psnr"] = info.achieved_psnr;
  d["achieved_mesh_error"] = info.achieved_mesh_error;
  d["low"] = info.low;
  d["high"] = info.high;
  d["mean"] = info.mean;
  d["file_bytes"] = info.file_bytes;
  d["header_bytes"] = info.header_bytes;
  d["activity_bytes"] = info.activity_bytes;
  d["value_bytes"] = info.value_bytes;
  d["index_bytes"] = info.index_bytes;
  d["bricks"] = three(info.bricks);
  d["brick_edge"] = info.brick_edge;
  d["lead"] = info.lead;
  d["active_points"] = info.active_points;
  d["unknown_parts"] = info.unknown_parts;
  py::list thresholds;
  for (int i = 0; i < info.threshold_count; ++i)
    thresholds.append(py::dict(py::arg("value") = info.thresholds[i],
                               py::arg("at_least") = info.samples_at_least[i],
                               py::arg("moved") = info.samples_moved[i]));
  d["thresholds"] = thresholds;
  return d;
}

py::dict dict_of(const tagrid_brick& brick) {
  py::dict d;
  d["low_corner"] = three(brick.box.low);
  d["high_corner"] = three(brick.box.high);
  d["offset"] = brick.offset;
  d["bytes"] = brick.bytes;
  d["low"] = brick.low;
  d["high"] = brick.high;
  d["mean"] = brick.mean;
  return d;
}

}  // namespace tagrid_python
