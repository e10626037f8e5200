// What files of meshes and surfaces of a .tag file say besides their arrays.
#pragma once

#include "io/meshes/mesh_notes.h"
#include "io/tag/header.h"

namespace tagrid {

/// The space of the coordinates and the meaning of values, as far as the header says them.
MeshNotes notes_of(const TagHeader& header);

}  // namespace tagrid
