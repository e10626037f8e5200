// Tags of other programs that change which samples there are in a TIFF file, or what they mean.
#pragma once

#include <tiffio.h>

#include "tools/formats/tiff/directories.h"
#include "tools/formats/tiff/tiff_page.h"

namespace tagrid {

/// Reads the tags of GDAL of the current page: a scale of values, and the sample that stands for none
/// (https://gdal.org/drivers/raster/gtiff.html).
void look_at_values(TIFF* tiff, TiffPage& page, TiffRemarks& remarks);

/// Reports what the tags of other programs may change, and the tags that libtiff ignores. `page` is the image
/// with this directory. Throws BrokenInput, without the name of a file, if samples would be left out.
void look_at_other_tags(const TiffDirectory& directory, TiffPage& page, TiffRemarks& remarks);

}  // namespace tagrid
