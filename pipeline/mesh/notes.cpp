#include "pipeline/mesh/notes.h"

#include "io/nrrd/geometry.h"
#include "io/nrrd/rescale.h"
#include "io/nrrd/spaces.h"

namespace tagrid {

MeshNotes notes_of(const TagHeader& header) {
  return {short_name_of_space(geometry_of(header.nrrd_fields).space), rescale_of(header.nrrd_fields)};
}

}  // namespace tagrid
