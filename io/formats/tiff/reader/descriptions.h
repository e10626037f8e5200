// What programs write into the description of the first page, besides OME-XML: ImageJ, and tifffile
// (https://github.com/cgohlke/tifffile). Lengths are those of OME-XML, too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/formats/tiff/reader/tiff_page.h"
#include "io/text/foreign_number.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// A distance along one axis.
struct GivenDistance {
  std::string name;  ///< of its field, for messages
  ForeignNumber number;
  std::string unit;
};

/// "um" for "micron" and the like, other units as they are.
std::string plain_unit(std::string_view unit);

/// The spacing, in the unit of the first axis that has one. It is unknown along an axis without a distance,
/// and along one whose distance or unit cannot be read, with a warning.
Geometry spacing_of(const std::array<GivenDistance, 3>& distances, TiffRemarks& remarks);

/// Planes follow each other by channel, then slice, then frame: channels change fastest.
struct ImageJ {
  std::int64_t images = 1, channels = 1, slices = 1, frames = 1;
  ForeignNumber spacing;            ///< between slices
  std::array<std::string, 3> unit;  ///< of lengths along x, y, z; "" if none is given
};

/// Nothing if the description is not ImageJ's. Throws BrokenInput if its numbers do not fit each other.
std::optional<ImageJ> image_j_of(std::string_view description);

/// The spacing of a stack whose first page is `first`. Resolutions are in ImageJ's unit; without one, and for inches,
/// they are those of the page.
Geometry spacing_of(const ImageJ& image_j, const TiffPage& first, TiffRemarks& remarks);

/// The spacing within a slice by its resolution in inches or centimeters, in mm; unknown along z.
/// Nothing if the resolution has no unit, or if it is a print resolution, such as 300 dpi, which
/// programs write into any image; a remark then reports this.
Geometry spacing_of(const TiffPage& page, TiffRemarks& remarks);

/// Analyze > Calibrate: a value is a function of a number of at least 0.
struct ImageJCalibration {
  std::string function;  ///< its number as it is written; "0": c0 + c1 * number
  ForeignNumber c0, c1;
  std::string unit;  ///< of values; "" if none is given

  bool operator==(const ImageJCalibration& other) const {
    return function == other.function && c0.text == other.c0.text && c1.text == other.c1.text &&
           unit == other.unit;
  }
};

/// Nothing if the description of an image is not ImageJ's, or has no calibration.
std::optional<ImageJCalibration> calibration_of(std::string_view description);

/// What a description in the form of ImageJ's says of an earlier loss, as files that tagrid writes do; "" if
/// nothing.
std::string loss_in(std::string_view description);

/// The effect of a calibration on samples.
struct CalibratedSamples {
  SampleType type = SampleType::uint8;
  std::int32_t add = 0;  ///< to each integer
  Rescale rescale;
  std::string warning;         ///< of a coefficient that is written in an unusual way; "" if none is
  std::string not_understood;  ///< what the calibration is, if it has no effect; "" if it has
  std::string scale_doubt;     ///< what of it cannot be read; "" if all can
};

/// Signed numbers, which ImageJ keeps as unsigned ones with c0 = -32768, become signed samples. Other
/// straight lines are a slope and an intercept.
CalibratedSamples calibrated(const ImageJCalibration& calibration, SampleType type);

struct TiffShape {
  std::size_t images = 1;  ///< the product of all axes but the last two
  bool is_of_slices =
      true;  ///< One of these axes is longer than 1 at most, and not called channels or the like.
  bool is_truncated = false;  ///< Only the first image has a page.
  std::string text;           ///< those axes: "2 x 3"
};

/// One image if the description has no shape.
TiffShape shape_in(std::string_view description);

}  // namespace tagrid
