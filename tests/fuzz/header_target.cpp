#include "io/formats/nrrd/header.h"
#include "io/tag/header.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
namespace {

/// The metadata of the source is the same in every header that is written from it.
void metadata_comes_back(const TagHeader& header) {
  const VolumeInfo info = volume_info_of(header);
  for (const char* data_file : {"", "x.raw"}) {
    const NrrdHeader again = parse_nrrd_header(nrrd_header_text(info, data_file));
    claim(again.info.metadata == info.metadata, "the source's fields come back in NRRD");
    claim(again.info.dims == info.dims && again.info.type == info.type, "dims and type come back in NRRD");
  }
}

}  // namespace

void header(Bytes bytes) {
  const auto input = std::as_bytes(bytes);
  std::size_t size = 0;
  if (input.size() < tag_preamble_size || !parse_preamble(input.first(tag_preamble_size), size).ok()) return;
  TagHeader first;
  std::uint64_t checksum = 0;
  if (!parse_header(input, first, checksum).ok()) return;
  claim(check_parameters(first.parameters).ok(), "a header that was accepted has possible parameters");
  const std::vector<std::byte> written = serialize_header(first);
  TagHeader second;
  claim(parse_header(written, second, checksum).ok(), "a header that was written is read");
  claim(serialize_header(second) == written, "a header that was read is written as it was");
  claim(first.metadata == second.metadata, "the source's fields come back");
  metadata_comes_back(first);
}

}  // namespace tagrid::fuzz
