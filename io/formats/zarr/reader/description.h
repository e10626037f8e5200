// What the metadata of an array says about its samples, and positions of samples from arrays and attributes
// next to them, other than those of OME-Zarr.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/axes/axes.h"
#include "io/formats/nifti/header.h"
#include "io/formats/zarr/reader/image.h"
#include "io/programs/serve_reader.h"
#include "stages/grid/box.h"

namespace tagrid {

/// The axes x, y and z of an array; nothing for a z that is missing.
using SpaceAxes = std::array<std::optional<std::size_t>, 3>;
inline constexpr std::size_t axis_of_x = 0, axis_of_y = 1, axis_of_z = 2;

/// Coordinates as xarray writes them: arrays of one axis, in the group of the array, with the names of its axes. Nothing
/// without any. Throws BrokenInput, WorldError.
std::optional<PlacesOfAxes> coordinates_of(const ZarrStore& store, const ZarrImage& image,
                                           const SpaceAxes& space, const Index3& dims);

/// The header of NIfTI-Zarr in the array "nifti" of the group of levels; nothing without one. `why_not` becomes a
/// sentence if there is such an array, and it is not the header of a volume of these dimensions. Throws WorldError.
std::optional<NiftiHeader> nifti_header_of(const ZarrStore& store, const ZarrImage& image, const Index3& dims,
                                           std::string& why_not);

/// The names of attributes of the array and of the groups around it that may say where samples lie. Throws BrokenInput,
/// WorldError.
std::vector<std::string> unread_geometry(const ZarrStore& store, const ZarrImage& image);

/// For messages.
std::string shown_path(const ZarrImage& image);

/// Sets the header lines of a volume, whose dimensions and type are set, its scale and its doubts, and adds warnings.
/// Throws BrokenInput, WorldError.
void describe_image(const ZarrStore& store, const ZarrImage& image, const SpaceAxes& space,
                    ServedVolume& volume);

}  // namespace tagrid
