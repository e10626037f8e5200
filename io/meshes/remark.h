// What a file for a solver says in a comment.
#pragma once

#include <string>

#include "io/meshes/material_mesh.h"

namespace tagrid {

/// "Tetrahedra with materials; SPACE=LPS; unit=mm", as far as it is known. It has no line ends, and nothing that ends a
/// comment.
inline std::string remark_of(const MaterialMesh& mesh) {
  std::string remark = "Tetrahedra with materials";
  if (!mesh.notes.space.empty()) remark += "; " + space_comment(mesh.notes);
  if (!mesh.unit.empty()) remark += "; unit=" + mesh.unit;
  for (char& c : remark) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || c == '<' || c == '>' || c == '&') c = '_';
  }
  // Two of them end comments of XML.
  for (std::size_t at = 0; (at = remark.find("--", at)) != remark.npos;) remark[at + 1] = '_';
  return remark;
}

}  // namespace tagrid
