// What almost every volume of DICOM loses in other formats.
#pragma once

#include <string>

#include "io/formats/table/formats.h"

namespace tagrid {

/// A sentence on the attributes of DICOM that a file of this format has no place for; "" if there are none.
/// They are not among losses(), as nobody who chooses the format expects them there.
std::string lost_attributes(const Format& format, const VolumeInfo& info);

}  // namespace tagrid
