// What the samples of a data set mean: their scale, and what other conventions say about them.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

#include "io/programs/serve_reader.h"
#include "stages/grid/box.h"

namespace tagrid {

/// Sets the scale, or the doubt about it, and adds what users should know. Returns the attributes that
/// `rescale` says now. The scale is that of the attributes rescale_slope and rescale_intercept, otherwise of
/// scale_factor and add_offset (https://cfconventions.org), otherwise of the fields scaling_factor and offset
/// of the signal's NeXus group.
std::vector<std::string> set_scale(hid_t file, const std::string& path, const std::string& name,
                                   ServedVolume& volume);

/// What a data set says about its samples and tagrid does not apply, a sentence each: names of axes
/// in another order than z, y, x, numbers of colors, white as zero, other names of a scale,
/// unsigned numbers that are stored as signed ones (BigDataViewer), or a smaller image than the
/// data set (Imaris). `object` is for messages. Throws BrokenInput if samples are parts of colors.
/// `are_axes_placed`: if axes have another order, the directions describe them.
std::vector<std::string> other_meanings(hid_t file, const std::string& name, const std::string& object,
                                        Index3 dims, bool are_axes_placed);

/// True if the file names each axis of the data set.
bool has_names_of_axes(hid_t file, const std::string& name);

}  // namespace tagrid
