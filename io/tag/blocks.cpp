#include "io/tag/blocks.h"

#include <algorithm>
#include <span>
#include <stdexcept>

#include "io/bytes/byte_fields.h"
#include "io/bytes/checksum.h"
#include "io/bytes/zstd_bytes.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

std::span<const std::byte> bytes_of(const std::vector<std::uint8_t>& v) {
  return std::as_bytes(std::span(v));
}

}  // namespace

std::uint64_t largest_body(const CodingParameters& p, std::int64_t id) {
  const BrickGrid bricks = p.bricks();
  const auto points = static_cast<std::uint64_t>(bricks.closed_box(bricks.position(id)).count());
  return std::min<std::uint64_t>(65536 + points * (1 + 2 * size_of(p.type)), 0xFFFFFFFFU);
}

std::vector<std::byte> block_head(const CodingParameters& parameters, const BrickBytes& brick) {
  const std::size_t length = 8 + 4 + brick.activity.size() + brick.values.size();
  if (length > largest_body(parameters, brick.id))
    throw std::logic_error("a brick is larger than any may be");
  FieldWriter head;
  head.put(static_cast<std::uint32_t>(length));
  head.put(static_cast<std::uint64_t>(brick.id));
  head.put(static_cast<std::uint32_t>(brick.activity.size()));
  return std::move(head.bytes());
}

std::uint64_t own_checksum(const std::vector<std::byte>& head, const BrickBytes& brick) {
  return checksum_of({head, bytes_of(brick.activity), bytes_of(brick.values)});
}

void write_block(OutputFile& out, const std::vector<std::byte>& head, const BrickBytes& brick,
                 std::uint64_t checksum) {
  FieldWriter tail;
  tail.put(checksum);
  out.write(head);
  out.write(bytes_of(brick.activity));
  out.write(bytes_of(brick.values));
  out.write(tail.bytes());
}

std::vector<std::byte> file_end(const CodingParameters& parameters, const TagIndex& index,
                                std::uint64_t start, std::uint64_t last_checksum,
                                std::uint64_t header_checksum) {
  const std::vector<std::byte> fields = serialize_index(index, index_form(parameters));
  const std::vector<std::byte> packed = zstd_compress(fields);
  FieldWriter section;
  section.put(std::uint32_t{0});
  section.put(static_cast<std::uint64_t>(fields.size()));
  section.put(static_cast<std::uint64_t>(packed.size()));
  section.put_bytes(packed);
  section.put(chained_checksum(checksum_of({section.bytes()}), last_checksum));
  section.put(start);
  section.put(header_checksum);
  section.put_bytes(std::as_bytes(std::span(end_magic)));
  return std::move(section.bytes());
}

}  // namespace tagrid
