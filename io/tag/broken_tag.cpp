#include "io/tag/broken_tag.h"

namespace tagrid {

BrokenInput broken_part(const std::string& file, const std::string& part, std::uint64_t before,
                        const std::string& what) {
  return BrokenInput(file + ": " + part + ", before byte " + std::to_string(before) + ": " + what);
}

std::size_t header_size_of(const std::string& file, std::span<const std::byte> preamble) {
  std::size_t size = 0;
  if (Status status = parse_preamble(preamble, size); !status.ok())
    throw BrokenInput(file + ": " + status.what());
  return size;
}

TagHeader header_of(const std::string& file, std::span<const std::byte> bytes, std::uint64_t& checksum) {
  TagHeader header;
  if (Status status = parse_header(bytes, header, checksum); !status.ok())
    throw BrokenInput(file + ": " + status.what());
  try {
    volume_info_of(header);
  } catch (const BrokenInput& broken) {
    throw BrokenInput(file + ": the source's fields in the header: " + broken.what());
  }
  return header;
}

}  // namespace tagrid
