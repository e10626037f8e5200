// Descriptions of volumes and files in the types of the library.
#pragma once

#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_info.h"
#include "tagrid/tagrid.h"

namespace tagrid::library {

tagrid_geometry geometry_of_volume(const Geometry& geometry);
/// The lines of an NRRD header with the same content; "" if nothing is known.
std::string nrrd_fields_of(const tagrid_geometry& geometry);

tagrid_info info_of(const TagHeader& header, const TagIndex& index, const TagSizes& sizes);

}  // namespace tagrid::library
