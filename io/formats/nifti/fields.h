// The fields of NIfTI headers, and where they say that samples lie.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/metadata/fields.h"
#include "io/volume/volume_info.h"

namespace tagrid::nifti {

/// Where a field is, and of which type: 'c' text, 'b' byte, 's', 'i', 'l' integers of 2, 4, 8 bytes, 'f', 'd'
/// floats.
struct Place {
  std::size_t at = 0;
  char type = 0;
};

/// A field of both versions, and how many numbers or bytes it has.
struct Field {
  std::string_view name;
  Place first, second;
  std::size_t count = 1;
};

inline constexpr Field sizeof_hdr{"sizeof_hdr", {0, 'i'}, {0, 'i'}};
inline constexpr Field magic{"magic", {344, 'c'}, {4, 'c'}};
inline constexpr Field dim{"dim", {40, 's'}, {16, 'l'}, 8};
inline constexpr Field intent_code{"intent_code", {68, 's'}, {504, 'i'}};
inline constexpr Field bitpix{"bitpix", {72, 's'}, {14, 's'}};
inline constexpr Field datatype{"datatype", {70, 's'}, {12, 's'}};
inline constexpr Field vox_offset{"vox_offset", {108, 'f'}, {168, 'l'}};
inline constexpr Field pixdim{"pixdim", {76, 'f'}, {104, 'd'}, 8};
inline constexpr Field scl_slope{"scl_slope", {112, 'f'}, {176, 'd'}};
inline constexpr Field scl_inter{"scl_inter", {116, 'f'}, {184, 'd'}};
inline constexpr Field xyzt_units{"xyzt_units", {123, 'b'}, {500, 'i'}};
inline constexpr Field qform_code{"qform_code", {252, 's'}, {344, 'i'}};
inline constexpr Field sform_code{"sform_code", {254, 's'}, {348, 'i'}};
inline constexpr Field quatern{"quatern_bcd", {256, 'f'}, {352, 'd'}, 3};
inline constexpr Field qoffset{"qoffset_xyz", {268, 'f'}, {376, 'd'}, 3};
inline constexpr std::array srow = {Field{"srow_x", {280, 'f'}, {400, 'd'}, 4},
                                    Field{"srow_y", {296, 'f'}, {432, 'd'}, 4},
                                    Field{"srow_z", {312, 'f'}, {464, 'd'}, 4}};

/// Fields of which only the key-value pairs of a volume know.
inline constexpr Field descrip{"descrip", {148, 'c'}, {240, 'c'}, 80};
inline constexpr Field aux_file{"aux_file", {228, 'c'}, {320, 'c'}, 24};
inline constexpr Field intent_name{"intent_name", {328, 'c'}, {508, 'c'}, 16};
inline constexpr Field intent_p{"intent_p1_p2_p3", {56, 'f'}, {80, 'd'}, 3};
inline constexpr Field dim_info{"dim_info", {39, 'b'}, {524, 'b'}};
inline constexpr Field cal_min{"cal_min", {128, 'f'}, {200, 'd'}};
inline constexpr Field cal_max{"cal_max", {124, 'f'}, {192, 'd'}};
inline constexpr Field slice_start{"slice_start", {74, 's'}, {224, 'l'}};
inline constexpr Field slice_end{"slice_end", {120, 's'}, {232, 'l'}};
inline constexpr Field slice_code{"slice_code", {122, 'b'}, {496, 'i'}};
inline constexpr Field slice_duration{"slice_duration", {132, 'f'}, {208, 'd'}};
inline constexpr Field toffset{"toffset", {136, 'f'}, {216, 'd'}};

/// The values of `datatype` that are read and written.
inline constexpr std::array datatypes = {
    std::pair{2, SampleType::uint8},    std::pair{4, SampleType::int16},    std::pair{8, SampleType::int32},
    std::pair{16, SampleType::float32}, std::pair{64, SampleType::float64}, std::pair{256, SampleType::int8},
    std::pair{512, SampleType::uint16}, std::pair{768, SampleType::uint32}};

/// The units that NIfTI has, by their codes from 1 on.
inline constexpr std::array<std::string_view, 3> units_of_nifti = {"m", "mm", "um"};

/// The fields of a header, in either version and byte order.
class Fields {
 public:
  Fields(std::string_view bytes, bool is_second)
      : bytes_(bytes), is_second_(is_second), is_big_endian_(bytes[0] == '\0') {}

  bool is_big_endian() const { return is_big_endian_; }

  double number(const Field& field, std::size_t i = 0) const {
    const Place& place = place_of(field);
    switch (place.type) {
      case 'b':
        return load<std::uint8_t>(place.at + i);
      case 's':
        return load<std::int16_t>(place.at + i * 2);
      case 'i':
        return load<std::int32_t>(place.at + i * 4);
      case 'l':
        return static_cast<double>(load<std::int64_t>(place.at + i * 8));
      case 'f':
        return load<float>(place.at + i * 4);
      default:
        return load<double>(place.at + i * 8);
    }
  }
  std::int64_t integer(const Field& field, std::size_t i = 0) const {
    const Place& place = place_of(field);
    return place.type == 'l' ? load<std::int64_t>(place.at + i * 8)
                             : static_cast<std::int64_t>(number(field, i));
  }
  template <std::size_t n>
  std::array<double, n> numbers(const Field& field) const {
    std::array<double, n> values;
    for (std::size_t i = 0; i < n; ++i) values[i] = number(field, i);
    return values;
  }
  /// "" if all of it is 0.
  std::string text(const Field& field) const;

 private:
  const Place& place_of(const Field& field) const { return is_second_ ? field.second : field.first; }
  template <class T>
  T load(std::size_t at) const {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), bytes_.data() + at, sizeof(T));
    if (is_big_endian_) std::ranges::reverse(bytes);
    return load_little_endian<T>(bytes.data());
  }

  std::string_view bytes_;
  bool is_second_, is_big_endian_;
};

/// The geometry of the sform, otherwise that of the qform, otherwise the spacing alone. Adds a warning for
/// what is unusable.
Geometry geometry_of_fields(const Fields& fields, const Index3& dims, std::vector<std::string>& warnings);

}  // namespace tagrid::nifti

namespace tagrid {

// The two forms in which NIfTI stores the position of a volume.

/// Directions and origin of a qform: a rotation as b, c, d of a quaternion, "METHOD 2" of the standard.
/// `pixdim` has the sign of z and the sizes of voxels.
Geometry geometry_of_qform(const std::array<double, 3>& quatern, const std::array<double, 3>& qoffset,
                           const std::array<double, 4>& pixdim);

/// The forms of a NIfTI source, from its key-value pairs.
struct FormsOfSource {
  bool is_nifti = false;
  double sform_code = 0, qform_code = 0;
  std::array<double, 3> quatern = {}, qoffset = {};
  std::array<double, 4> pixdim = {};
  Geometry sform, qform;  ///< where the code is positive

  bool has_sform() const { return sform_code > 0; }
  bool has_qform() const { return qform_code > 0; }
  /// There are two forms, and their positions differ.
  bool differ() const;
  /// The volume lies where the sform says, so it is not a part of the source.
  bool is_whole(const Geometry& geometry) const;
};
FormsOfSource forms_of_source(const std::vector<std::pair<std::string, std::string>>& pairs);

}  // namespace tagrid
