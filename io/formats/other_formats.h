// Files that are not volumes to tagrid, but that people have: what to do with them.
#pragma once

#include <cstddef>
#include <string_view>

#include "io/files/errors.h"

namespace tagrid {

inline constexpr std::size_t other_formats_peek = 352;

struct OtherFormat {
  std::string_view
      what;  ///< "is a DICOM file", and what to do with it outside of tagrid; "" if it is not known
  Problem problem = Problem::none;  ///< if tagrid can read its samples
};

/// Of the file that begins so. `beginning`: the first other_formats_peek bytes, or all there are.
OtherFormat other_format(std::string_view beginning);

}  // namespace tagrid
