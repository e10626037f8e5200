#include "io/meshes/vtk_xml.h"

#include <fmt/format.h>

namespace tagrid {
namespace {

/// In text, VTK has the bytes of a string as numbers, with a 0 at the end.
std::string string_array(std::string_view name, std::string_view text) {
  std::string numbers;
  for (const char c : text) numbers += fmt::format("{} ", static_cast<unsigned char>(c));
  return fmt::format(
      "      <DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}0</DataArray>\n",
      name, numbers);
}

std::string number_array(std::string_view name, double number) {
  return fmt::format(
      "      <DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n",
      name, number);
}

}  // namespace

std::string vtk_field_data(const MeshNotes& notes) {
  std::string arrays;
  if (!notes.space.empty()) arrays += string_array("SPACE", notes.space);
  if (notes.has_rescale())
    arrays += number_array("rescale_slope", notes.rescale.slope) +
              number_array("rescale_intercept", notes.rescale.intercept);
  if (!notes.rescale.units.empty()) arrays += string_array("rescale_units", notes.rescale.units);
  return arrays.empty() ? "" : "    <FieldData>\n" + arrays + "    </FieldData>\n";
}

}  // namespace tagrid
