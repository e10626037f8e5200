#include "io/tag/blocks.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/bytes/zstd_bytes.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

std::span<const std::byte> bytes_of(const std::vector<std::uint8_t>& v) {
  return std::as_bytes(std::span(v));
}

std::vector<std::byte> bytes_of(std::int64_t brick) {
  FieldWriter number;
  number.put(static_cast<std::uint64_t>(brick));
  return std::move(number.bytes());
}

// What a directory says by itself. What depends on the pages is check_extremes().
Status check_statistics(const CodingParameters& parameters, const Statistics& total) {
  for (const double number : {total.low, total.high, total.sum, total.sum_squared_real})
    if (std::isnan(number)) return Status::broken("a recorded statistic is not a number");
  const auto check = [](double error, double bound, const std::string& what) {
    if (!(error >= 0)) return Status::broken("the recorded error" + what + " is not a number");
    return bound < 0 || error <= bound ? Status()
                                       : Status::broken("the recorded error" + what + " is above the bound");
  };
  if (Status status = check(total.max_error, parameters.max_error, ""); !status.ok()) return status;
  return parameters.mesh_error < 0 ? Status()
                                   : check(total.mesh_error, parameters.mesh_error, " of the mesh");
}

}  // namespace

std::uint64_t largest_body(const CodingParameters& p, std::int64_t id) {
  const BrickGrid bricks = p.bricks();
  const auto points = static_cast<std::uint64_t>(bricks.closed_box(bricks.position(id)).count());
  return std::min<std::uint64_t>(65536 + points * (1 + 2 * size_of(p.type)), 0xFFFFFFFFU);
}

std::uint64_t own_checksum(std::span<const std::byte> fields, std::int64_t brick) {
  return checksum_of({bytes_of(brick), fields});
}

std::uint64_t write_block(ByteSink& out, const CodingParameters& parameters, const BrickBytes& brick,
                          std::optional<std::uint64_t> before) {
  const std::size_t length = 4 + brick.activity.size() + brick.values.size();
  if (length > largest_body(parameters, brick.id))
    throw std::logic_error("a brick is larger than the largest possible");
  FieldWriter head, tail;
  head.put(static_cast<std::uint32_t>(length));
  head.put(static_cast<std::uint32_t>(brick.activity.size()));
  const std::uint64_t own =
      checksum_of({bytes_of(brick.id), head.bytes(), bytes_of(brick.activity), bytes_of(brick.values)});
  const std::uint64_t checksum = before ? chained_checksum(own, *before) : own;
  tail.put(checksum);
  out.write(head.bytes());
  out.write(bytes_of(brick.activity));
  out.write(bytes_of(brick.values));
  out.write(tail.bytes());
  return checksum;
}

std::vector<std::byte> file_end(const CodingParameters& parameters, const TagIndex& index,
                                std::uint64_t start, std::uint64_t last_checksum,
                                std::uint64_t header_checksum) {
  const std::vector<std::byte> fields = serialize_directory(index, index_form(parameters));
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

void EnvelopeBlocks::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t n = std::min(bytes.size(), largest_envelope_block - waiting_.size());
    waiting_.insert(waiting_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
    bytes = bytes.subspan(n);
    if (waiting_.size() == largest_envelope_block) finish();
  }
}

void EnvelopeBlocks::finish() {
  if (waiting_.empty()) return;
  out_.write(packed_block(envelope_marker, waiting_, checksum_));
  waiting_.clear();
}

std::vector<std::byte> packed_block(std::uint32_t marker, std::span<const std::byte> content,
                                    std::uint64_t& checksum) {
  const std::vector<std::byte> packed = zstd_compress(content);
  FieldWriter block;
  block.put(marker);
  block.put(static_cast<std::uint32_t>(content.size()));
  block.put(static_cast<std::uint32_t>(packed.size()));
  block.put_bytes(packed);
  checksum = chained_checksum(checksum_of({block.bytes()}), checksum);
  block.put(checksum);
  return std::move(block.bytes());
}

Status parse_packed_head(std::span<const std::byte> head, std::uint32_t marker, ContentSize possible,
                         std::uint64_t& rest) {
  FieldReader reader(head);
  const auto stored = reader.get<std::uint32_t>(), size = reader.get<std::uint32_t>(),
             packed_size = reader.get<std::uint32_t>();
  if (stored != marker || size < possible.least || size > possible.most || packed_size > largest_packed(size))
    return Status::broken("an impossible size");
  rest = std::uint64_t{packed_size} + 8;
  return {};
}

std::uint64_t packed_checksum(std::span<const std::byte> block, std::uint64_t before) {
  return chained_checksum(checksum_of({block.first(block.size() - 8)}), before);
}

Status parse_packed_block(std::span<const std::byte> block, std::uint64_t& checksum,
                          std::vector<std::byte>* content) {
  const auto fields = block.first(block.size() - 8);
  const auto in_file = load_little_endian<std::uint64_t>(block.last(8).data());
  if (!checksums_agree(in_file, packed_checksum(block, checksum)))
    return Status::broken("checksum mismatch: it, or what comes before it, is damaged or of another file");
  checksum = in_file;
  if (content == nullptr) return {};
  const auto size = load_little_endian<std::uint32_t>(block.data() + 4);
  return zstd_decompress(fields.subspan(packed_head_size), size, *content);
}

Status parse_block(std::span<const std::byte> block, const CodingParameters& parameters, std::int64_t id,
                   std::uint64_t& checksum, BrickBytes& brick) {
  FieldReader reader(block);
  const auto length = reader.get<std::uint32_t>();
  if (length < 4 || length > largest_body(parameters, id)) return Status::broken("an impossible size");
  if (block.size() != std::uint64_t{4} + length + 8)
    return Status::broken("its size is not the one in the index");
  const auto in_file = load_little_endian<std::uint64_t>(block.data() + 4 + length);
  if (!checksums_agree(in_file, chained_checksum(own_checksum(block.first(4 + length), id), checksum)))
    return Status::broken("checksum mismatch: the brick, or one before it, is damaged or of another file");
  if (Status status = split_block(block, id, brick); !status.ok()) return status;
  checksum = in_file;
  return {};
}

Status parse_bound_block(std::span<const std::byte> bytes, const CodingParameters& parameters,
                         std::int64_t id, std::uint64_t activity_bytes, BrickBytes& brick) {
  if (bytes.size() < 8) return Status::broken("an impossible size");
  auto checksum = load_little_endian<std::uint64_t>(bytes.data());
  if (Status status = parse_block(bytes.subspan(8), parameters, id, checksum, brick); !status.ok())
    return status;
  return brick.activity.size() == activity_bytes ? Status()
                                                 : Status::broken("its size is not the one in the index");
}

Status split_block(std::span<const std::byte> block, std::int64_t id, BrickBytes& brick) {
  const auto body = block.subspan(4, load_little_endian<std::uint32_t>(block.data()));
  const auto activity_size = load_little_endian<std::uint32_t>(body.data());
  if (activity_size > body.size() - 4) return Status::broken("the activity is larger than the brick");
  const auto* const fields = reinterpret_cast<const std::uint8_t*>(body.data()) + 4;
  brick.id = id;
  brick.activity.assign(fields, fields + activity_size);
  brick.values.assign(fields + activity_size, fields + body.size() - 4);
  return {};
}

Status find_file_end(std::span<const std::byte> footer, std::uint64_t& start) {
  start = load_little_endian<std::uint64_t>(footer.data());
  const auto magic = footer.last(end_magic.size());
  if (!std::equal(magic.begin(), magic.end(), std::as_bytes(std::span(end_magic)).begin()))
    return Status::broken("this is not a footer");
  return {};
}

Status FileEnd::parse_head(std::span<const std::byte> head, std::uint64_t& rest) const {
  FieldReader reader(head);
  const auto marker = reader.get<std::uint32_t>();
  const auto size = reader.get<std::uint64_t>(), packed_size = reader.get<std::uint64_t>();
  const PageLayout layout(parameters.bricks().count());
  if (marker != 0) return Status::broken("there are more bricks than the volume has");
  if (!layout.is_possible()) return Status::broken("no file has that many bricks");
  if (size < least_directory_size(layout.pages(), index_form(parameters)) || size > largest_directory ||
      packed_size > largest_packed(size))
    return Status::broken("the index has an impossible size");
  if (static_cast<std::uint64_t>(layout.bricks()) > (start - header_size) / block_frame_size)
    return Status::broken("the file is too short for that many bricks");
  rest = packed_size + 8 + footer_size;
  return {};
}

Status FileEnd::parse(std::span<const std::byte> bytes, TagIndex& index, std::uint64_t& envelope) const {
  const auto packed = bytes.subspan(index_head_size, bytes.size() - index_head_size - 8 - footer_size);
  const auto tail = bytes.last(8 + footer_size);
  if (!checksums_agree(load_little_endian<std::uint64_t>(tail.data()),
                       chained_checksum(checksum_of({bytes.first(index_head_size), packed}), last_checksum)))
    return Status::broken("checksum mismatch: the index is damaged, or the last brick is of another file");
  std::uint64_t start_in_footer = 0;
  if (!find_file_end(tail.last(footer_size), start_in_footer).ok() || start_in_footer != start ||
      !checksums_agree(load_little_endian<std::uint64_t>(tail.data() + 16), header_checksum))
    return Status::broken("the footer is damaged");
  const PageLayout layout(parameters.bricks().count());
  const auto size = load_little_endian<std::uint64_t>(bytes.data() + 4);
  std::vector<std::byte> fields;
  if (Status status = zstd_decompress(packed, memory_size(size), fields); !status.ok()) return status;
  IndexForm form = index_form(parameters);
  form.volumes = volumes;
  if (Status status = parse_directory(fields, layout.pages(), form, index); !status.ok()) return status;
  if (Status status = check_statistics(parameters, index.total); !status.ok()) return status;
  return check_sizes(layout, index, envelope);
}

Status FileEnd::check_sizes(const PageLayout& layout, const TagIndex& index, std::uint64_t& envelope) const {
  const auto do_not_add_up = [] {
    return Status::broken("the sizes of the bricks do not add up to the size of the file");
  };
  const auto fits = [](std::uint64_t block, std::uint64_t content) {
    return block >= packed_frame_size && block <= packed_frame_size + largest_packed(content);
  };
  // No sum is larger than the file, so none overflows.
  if (Status status = check_places(index.members, header_size, start); !status.ok()) return status;
  const std::uint64_t end = index.members.empty() ? start : index.members.front().offset;
  std::uint64_t left = end - header_size, of_bricks = 0;
  for (std::int64_t i = 0; i < layout.pages(); ++i) {
    const PageFacts& page = index.pages[static_cast<std::size_t>(i)];
    const auto count = static_cast<std::uint64_t>(layout.bricks_in(i));
    if (!fits(page.sizes_bytes, count * sizes_entry) ||
        !fits(page.statistics_bytes, count * statistics_entry))
      return Status::broken("a page has an impossible size");
    if (page.brick_bytes > left || page.bytes() > left || page.brick_bytes < count * block_frame_size)
      return do_not_add_up();
    left -= page.bytes();
    of_bricks += page.brick_bytes;
  }
  const std::uint64_t frames = static_cast<std::uint64_t>(layout.bricks()) * block_frame_size;
  if (index.activity_bytes > of_bricks - frames ||
      index.value_bytes != of_bricks - frames - index.activity_bytes)
    return do_not_add_up();
  envelope = left;
  return {};
}

TagSizes tag_sizes(std::uint64_t file, std::uint64_t header, std::uint64_t envelope, const TagIndex& index) {
  TagSizes sizes;
  sizes.file = file;
  sizes.header = header;
  sizes.envelope = envelope;
  sizes.activity = index.activity_bytes;
  sizes.values = index.value_bytes;
  for (const Member& member : index.members) sizes.members += member_frame_size + member.length;
  sizes.index = sizes.file - sizes.header - sizes.envelope - sizes.members - sizes.activity - sizes.values;
  return sizes;
}

BrokenInput broken_part(const std::string& file, const std::string& part, std::uint64_t before,
                        const std::string& what) {
  return broken_part(file, part, before, Status::broken(what));
}

BrokenInput broken_part(const std::string& file, const std::string& part, std::uint64_t before,
                        const Status& status) {
  return broken_input_of(file + ": " + part + ", before byte " + std::to_string(before), status);
}

}  // namespace tagrid
