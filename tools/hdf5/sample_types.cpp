#include "tools/hdf5/sample_types.h"

#include <fmt/format.h>

namespace tagrid {

hid_t hdf5_type_of(SampleType type) {
  switch (type) {
    case SampleType::uint8:
      return H5T_STD_U8LE;
    case SampleType::int8:
      return H5T_STD_I8LE;
    case SampleType::uint16:
      return H5T_STD_U16LE;
    case SampleType::int16:
      return H5T_STD_I16LE;
    case SampleType::uint32:
      return H5T_STD_U32LE;
    case SampleType::int32:
      return H5T_STD_I32LE;
    case SampleType::float32:
      return H5T_IEEE_F32LE;
    case SampleType::float64:
      return H5T_IEEE_F64LE;
  }
  return -1;
}

std::optional<StoredSamples> stored_samples_of(hid_t type) {
  const std::size_t size = H5Tget_size(type);
  const bool big = H5Tget_order(type) == H5T_ORDER_BE;
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_FLOAT) {
    for (const hid_t known : {H5T_IEEE_F32LE, H5T_IEEE_F32BE})
      if (H5Tequal(type, known) > 0) return StoredSamples{SampleType::float32, big};
    for (const hid_t known : {H5T_IEEE_F64LE, H5T_IEEE_F64BE})
      if (H5Tequal(type, known) > 0) return StoredSamples{SampleType::float64, big};
    return std::nullopt;
  }
  if (kind != H5T_INTEGER || H5Tget_precision(type) != 8 * size) return std::nullopt;
  const bool is_signed = H5Tget_sign(type) == H5T_SGN_2;
  switch (size) {
    case 1:
      return StoredSamples{is_signed ? SampleType::int8 : SampleType::uint8, big};
    case 2:
      return StoredSamples{is_signed ? SampleType::int16 : SampleType::uint16, big};
    case 4:
      return StoredSamples{is_signed ? SampleType::int32 : SampleType::uint32, big};
    default:
      return std::nullopt;
  }
}

std::string samples_in_words(hid_t type) {
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      return fmt::format("{}integers of {} bits", H5Tget_sign(type) == H5T_SGN_2 ? "" : "unsigned ",
                         H5Tget_precision(type));
    case H5T_FLOAT:
      return fmt::format("floats of {} bits", H5Tget_precision(type));
    case H5T_STRING:
      return "texts";
    case H5T_COMPOUND:
      return "several numbers each (a compound type)";
    case H5T_ENUM:
      return "values of a list (an enumeration)";
    default:
      return "a type that is not one of numbers";
  }
}

}  // namespace tagrid
