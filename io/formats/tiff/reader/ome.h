// OME-XML in the description of the first page: https://docs.openmicroscopy.org/ome-model/
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/formats/tiff/reader/descriptions.h"

namespace tagrid {

/// Where some planes lie that follow each other in the order of dimensions: an element TiffData.
struct OmeData {
  std::int64_t z = 0, c = 0, t = 0;   ///< of the first one
  std::string file, uuid;             ///< "" and "": the file with the description
  std::int64_t page = 0;              ///< of the first one, among all directories of the file
  std::optional<std::int64_t> count;  ///< of planes; nothing: all pages of the file
};

/// Where a plane is.
struct OmePlane {
  const OmeData* data = nullptr;  ///< nothing says where it is
  std::int64_t page = 0;

  bool operator==(const OmePlane&) const = default;
};

/// An image with slices, channels and moments. Plane (z, c, t) is number z + slices * (c + channels * t).
struct OmeImage {
  std::string name;
  std::int64_t slices = 1, channels = 1, times = 1;
  std::string order;       ///< DimensionOrder: "XYZCT"
  std::string type, size;  ///< "uint16", "24 x 16"; "" if not given
  std::vector<OmeData> data;
  Geometry geometry;
  TiffRemarks remarks;
};

/// An entire description.
struct OmeXml {
  std::string uuid;           ///< of the file that it is in; "" if it says none
  std::string metadata_file;  ///< the file that has the description instead (BinaryOnly); "" if it is here
  std::vector<OmeImage> images;
};

/// Nothing if the text is not OME-XML. A number that cannot be read is an error if it says which samples
/// there are. Throws BrokenInput.
std::optional<OmeXml> ome_xml_of(std::string_view text);

/// The UUID that the beginning of a description gives its file; "" if there is none.
std::string uuid_of_ome(std::string_view text);

}  // namespace tagrid
