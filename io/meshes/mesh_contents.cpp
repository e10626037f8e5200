#include "io/meshes/mesh_contents.h"

#include <algorithm>
#include <utility>

#include "io/meshes/mesh_files.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

template <class T>
bool holds_all(const std::vector<MaterialElements>& materials) {
  return std::ranges::all_of(
      materials, [](const MaterialElements& material) { return std::in_range<T>(material.label); });
}

SampleType type_of_labels(const std::vector<MaterialElements>& materials) {
  return holds_all<std::int32_t>(materials)    ? SampleType::int32
         : holds_all<std::uint32_t>(materials) ? SampleType::uint32
                                               : SampleType::float64;
}

}  // namespace

MeshContents contents_of(MaterialMesh& mesh) {
  MeshField names{"material_names", {}, {}}, labels{"material_labels", {}, {}};
  for (const MaterialElements& material : mesh.materials) {
    names.texts.push_back(material.name);
    labels.numbers.push_back(material.label);
  }
  MeshContents contents = {
      .notes = mesh.notes,
      .fields = {},
      .nodes = mesh.nodes_of_element(),
      .points = mesh.point_count(),
      .cells = mesh.element_count(),
      .coordinates = &mesh.points,
      .connectivity = &mesh.nodes,
      .point_data = {},
      .cell_data = {{"material", type_of_labels(mesh.materials), MaterialNumbers{&mesh.materials}}}};
  if (!mesh.materials.empty()) contents.fields = {std::move(names), std::move(labels)};
  // As the program for HDF5 can be told it.
  if (!mesh.unit.empty() && is_utf8(mesh.unit)) contents.fields.push_back({"unit", {mesh.unit}, {}});
  // No array has samples.
  contents.notes.rescale = {};
  return contents;
}

MeshContents MeshFile::contents() {
  MeshContents contents = {.notes = notes_,
                           .fields = {},
                           .points = mesh_.points,
                           .cells = mesh_.tetrahedra,
                           .coordinates = &mesh_.coordinates,
                           .connectivity = &mesh_.connectivity,
                           .point_data = {{"value", mesh_.value_type, SpooledNumbers{&mesh_.values}}},
                           .cell_data = {{"level", SampleType::uint8, SpooledNumbers{&mesh_.levels}},
                                         {"type", SampleType::uint8, PrimitiveNumbers{&mesh_.levels}}}};
  if (notes_.has_rescale())
    contents.point_data.push_back(
        {"rescaled", SampleType::float64, RescaledNumbers{&mesh_.values, mesh_.value_type, notes_.rescale}});
  return contents;
}

}  // namespace tagrid
