// The header of a .tag file. docs/dev/format.md specifies every byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/volume/volume_info.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/status.h"

namespace tagrid {

struct TagHeader {
  CodingParameters parameters;
  Metadata metadata;  ///< of the source
  int volumes = 1;    ///< in the file; the parameters are those of each of them

  /// All volumes, one after the other along z.
  Index3 all_dims() const { return {parameters.dims.x, parameters.dims.y, parameters.dims.z * volumes}; }
};

inline constexpr std::size_t tag_preamble_size = 16;
/// The largest header that is read, whatever size it claims.
inline constexpr std::uint32_t max_header_size = 1 << 24;

/// The entire header: preamble, fields, checksum. REQUIRES: check_metadata(header.metadata).ok().
std::vector<std::byte> serialize_header(const TagHeader& header);

/// True if a file with these first bytes is a .tag file, of any version.
bool begins_as_tag(std::span<const std::byte> bytes);

/// The size of the entire header, from the first tag_preamble_size bytes of a file, or from all its bytes if
/// there are fewer. Broken if they are not those of a .tag file.
Status parse_preamble(std::span<const std::byte> preamble, std::size_t& header_size);

/// Reads an entire header and checks every field. `checksum` receives that of the header.
Status parse_header(std::span<const std::byte> bytes, TagHeader& header, std::uint64_t& checksum);

/// Checks that a header may have these parameters; says what is wrong.
Status check_parameters(const CodingParameters& parameters);

/// True if bricks of two headers are coded in the same way: all fields that these parameters have are equal.
bool are_same(const CodingParameters& a, const CodingParameters& b);
/// Checks that a file may have so many volumes with these parameters; says what is wrong.
Status check_volumes(const CodingParameters& parameters, std::int64_t volumes);

/// Checks that the metadata fits into a header that parse_header() reads; says what is wrong.
Status check_metadata(const Metadata& metadata);

/// Describes the volume in a file.
VolumeInfo volume_info_of(const TagHeader& header);

/// Describes all volumes of a file; see VolumeInfo::volumes.
VolumeInfo info_of_all(const TagHeader& header);

/// The name or the moment of the volume of a header; "" if it has none.
std::string name_of_volume(const TagHeader& header);

/// The names of the volumes of a file.
class VolumeNames {
 public:
  VolumeNames() = default;
  /// That of the first one.
  explicit VolumeNames(const TagHeader& file) { add(name_of_volume(file)); }
  void add(std::string name) {
    has_any_ = has_any_ || !name.empty();
    all_.push_back(std::move(name));
  }
  /// None if no volume has one.
  std::vector<std::string> take() const { return has_any_ ? all_ : std::vector<std::string>(); }

 private:
  std::vector<std::string> all_;
  bool has_any_ = false;
};

/// The error of a file that begins with its name.
BrokenInput broken_input_of(const std::string& file, const Status& status);

/// The size of the header of a file that begins with these bytes. Throws BrokenInput.
std::size_t header_size_of(const std::string& file, std::span<const std::byte> preamble);

/// The header in these bytes, with a usable description of a volume, and its checksum. Throws BrokenInput.
TagHeader header_of(const std::string& file, std::span<const std::byte> bytes, std::uint64_t& checksum);

}  // namespace tagrid
