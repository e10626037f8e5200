#include "tools/formats/hdf5/sample_types.h"

#include <fmt/format.h>

namespace tagrid {
namespace {

std::string member_name(hid_t type, unsigned number) {
  char* const name = H5Tget_member_name(type, number);
  const std::string text = name == nullptr ? "" : name;
  H5free_memory(name);
  return text;
}

/// As h5py and others write them.
bool is_complex(hid_t type) {
  return H5Tget_nmembers(type) == 2 && member_name(type, 0) == "r" && member_name(type, 1) == "i";
}
bool is_of_ieee(hid_t type) {
  return stored_samples_of(type) || H5Tget_size(type) == 2 || H5Tget_size(type) > 8;
}
bool is_boolean(hid_t type) {
  return H5Tget_nmembers(type) == 2 && member_name(type, 0) == "FALSE" && member_name(type, 1) == "TRUE";
}

}  // namespace

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
  const std::size_t size = 8 * H5Tget_size(type), precision = H5Tget_precision(type);
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      return fmt::format("{}integers of {} bits{}", H5Tget_sign(type) == H5T_SGN_2 ? "" : "unsigned ",
                         precision, precision < size ? fmt::format(" in {}", size) : "");
    case H5T_FLOAT:
      return fmt::format("floats of {} bits{}", precision,
                         is_of_ieee(type) ? "" : " that are not those of IEEE 754");
    case H5T_STRING:
      return "texts";
    case H5T_BITFIELD:
      return fmt::format("fields of {} bits", precision);
    case H5T_OPAQUE:
      return "bytes without a meaning (an opaque type)";
    case H5T_COMPOUND:
      return is_complex(type) ? "complex numbers" : "several numbers each (a compound type)";
    case H5T_REFERENCE:
      return "references";
    case H5T_ENUM:
      return is_boolean(type) ? "booleans" : "values of a list (an enumeration)";
    case H5T_VLEN:
      return "lists of any length";
    case H5T_ARRAY:
      return "several numbers each (an array type)";
    default:
      return "a type that is not one of numbers";
  }
}

}  // namespace tagrid
