// What VTK's files call the types of samples.
#pragma once

#include <string_view>

#include "stages/sample/sample_type.h"

namespace tagrid {

constexpr std::string_view vtk_name_of(SampleType type) {
  switch (type) {
    case SampleType::uint8:
      return "UInt8";
    case SampleType::int8:
      return "Int8";
    case SampleType::uint16:
      return "UInt16";
    case SampleType::int16:
      return "Int16";
    case SampleType::uint32:
      return "UInt32";
    case SampleType::int32:
      return "Int32";
    case SampleType::float32:
      return "Float32";
    case SampleType::float64:
      return "Float64";
  }
  return "";
}

}  // namespace tagrid
