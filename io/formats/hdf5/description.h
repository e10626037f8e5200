// How the attributes of a data set describe a volume. docs/formats.md lists them.
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "io/metadata/metadata.h"

namespace tagrid {

struct Hdf5Attribute {
  std::string name;
  /// A text; or numbers, of which nine are three vectors.
  std::variant<std::string, std::vector<double>> value;
};

/// The NRRD header lines of the volume, as a text.
inline constexpr const char* hdf5_header_attribute = "nrrd_header";
/// Where the volume is in a file of ours, and in one of VTKHDF.
inline constexpr const char* hdf5_volume_path = "/volume";
inline constexpr const char* vtkhdf_volume_path = "/VTKHDF/PointData/value";

/// Everything that a file says of the volume, but its header lines: spacing, origin, directions (vectors of
/// the axes x, y, z, one after another), space, spacing_units, and the key-value pairs. Pairs that came from
/// attributes of an HDF5 file have their old names. Spacings that are not known are NaN.
std::vector<Hdf5Attribute> attributes_of(const Metadata& metadata);

/// What the header lines of the object say, if its attributes still say the same: somebody may have changed
/// them. Then `described` gets the names of these attributes.
std::optional<Metadata> header_of(hid_t object, std::vector<std::string>& described);

}  // namespace tagrid
