// What the metadata of an array says about its samples.
#pragma once

#include <string>

#include "io/formats/zarr/reader/image.h"
#include "io/formats/zarr/reader/places.h"
#include "io/programs/serve_reader.h"

namespace tagrid {

/// For messages.
std::string shown_path(const ZarrImage& image);

/// Sets the header lines of a volume, whose dimensions and type are set, its scale and its doubts, and adds warnings.
/// Throws BrokenInput, WorldError.
void describe_image(const ZarrStore& store, const ZarrImage& image, const SpaceAxes& space,
                    ServedVolume& volume);

}  // namespace tagrid
