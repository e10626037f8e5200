#include "io/parts/part_file.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

constexpr std::array<std::uint8_t, 8> head_magic = {'T', 'A', 'G', 'P', 'A', 'R', 'T', '\n'};
constexpr std::array<std::uint8_t, 8> tail_magic = {'T', 'A', 'G', 'D', 'O', 'N', 'E', '\n'};
constexpr std::size_t head_size = 7 * 8, tail_size = 3 * 8;

std::span<const std::byte> bytes_of(const std::array<std::uint8_t, 8>& magic) {
  return std::as_bytes(std::span(magic));
}

std::vector<std::byte> head_of(const PartId& id) {
  FieldWriter head;
  head.put_bytes(bytes_of(head_magic));
  head.put(id.run);
  head.put(static_cast<std::uint64_t>(id.number));
  head.put(static_cast<std::uint64_t>(id.first_brick));
  head.put(static_cast<std::uint64_t>(id.bricks));
  head.put(id.sums_bytes);
  head.put(checksum_of({head.bytes()}));
  return std::move(head.bytes());
}

std::uint64_t table_checksum(std::span<const std::byte> head, std::span<const std::byte> table,
                             std::uint64_t start) {
  FieldWriter field;
  field.put(start);
  return checksum_of({head, table, field.bytes()});
}

std::size_t entry_size(const CodingParameters& parameters) {
  const auto levels = static_cast<std::size_t>(max_level(parameters.cube_size) + 1);
  return 2 * 4 + 8 + levels * 8 + 10 * 8 + parameters.thresholds.count * 2 * 8;
}

/// The fields of a brick's statistics, for a FieldWriter or a FieldReader.
void statistics_fields(auto& fields, auto& s, const CodingParameters& parameters) {
  for (int level = 0; level <= max_level(parameters.cube_size); ++level)
    fields.field(s.active[static_cast<std::size_t>(level)]);
  fields.field(s.max_error);
  fields.field(s.mesh_error);
  field_128(fields, s.sum_squared_error);
  for (auto* number : {&s.sum_squared_real, &s.low, &s.high, &s.sum}) fields.field(*number);
  fields.field(s.finite);
  fields.field(s.samples);
  for (std::size_t i = 0; i < parameters.thresholds.count; ++i)
    for (auto* counts : {&s.at_least, &s.moved}) fields.field(counts->all[i]);
}

}  // namespace

PartWriter::PartWriter(const std::string& path, const PartId& id, const CodingParameters& parameters)
    : out_(path, false), parameters_(parameters), head_(head_of(id)) {
  out_.write(head_);
}

void PartWriter::write_brick(const BrickBytes& brick, const Statistics& statistics) {
  const std::uint64_t own = write_block(out_, parameters_, brick);
  FieldWriter entry;
  entry.put(static_cast<std::uint32_t>(brick.activity.size()));
  entry.put(static_cast<std::uint32_t>(brick.values.size()));
  entry.put(own);
  statistics_fields(entry, statistics, parameters_);
  table_.insert(table_.end(), entry.bytes().begin(), entry.bytes().end());
}

void PartWriter::write_sums(std::span<const std::byte> bytes) {
  sums_.add(bytes);
  out_.write(bytes);
}

void PartWriter::finish() {
  FieldWriter sums;
  sums.put(sums_.value());
  out_.write(sums.bytes());
  const std::uint64_t start = out_.position();
  FieldWriter tail;
  tail.put(start);
  tail.put(table_checksum(head_, table_, start));
  tail.put_bytes(bytes_of(tail_magic));
  out_.write(table_);
  out_.write(tail.bytes());
  out_.commit();
}

PartReader::PartReader(const std::string& path, const PartId& id, const CodingParameters& parameters)
    : bytes_(path), first_brick_(id.first_brick) {
  read_table(id, parameters);
}

void PartReader::fail(const std::string& what) const { throw BrokenInput(bytes_.name() + ": " + what); }

void PartReader::read_exactly(std::byte* out, std::size_t size) {
  if (bytes_.read(out, size) != size) fail("the part ends too soon");
}

void PartReader::read_table(const PartId& id, const CodingParameters& parameters) {
  const std::vector<std::byte> expected = head_of(id);
  const std::uint64_t size = bytes_.size().value_or(0);
  // Not more bricks than fit into the file, so no memory is allocated for a false number.
  const auto count = static_cast<std::uint64_t>(id.bricks);
  constexpr std::uint64_t checksum_of_sums = 8;
  if (id.sums_bytes > size || size - id.sums_bytes < head_size + checksum_of_sums + tail_size ||
      count > size / (block_frame_size + entry_size(parameters)))
    fail("the part is not complete");
  const std::uint64_t table_size = count * entry_size(parameters);
  sums_bytes_ = id.sums_bytes;
  const std::uint64_t besides = head_size + sums_bytes_ + checksum_of_sums + tail_size;
  if (table_size > size - besides) fail("the part is not complete");
  const std::uint64_t start = size - tail_size - table_size;
  std::vector<std::byte> head(head_size), table(memory_size(table_size)), tail(tail_size);
  read_exactly(head.data(), head.size());
  if (!std::equal(head.begin(), head.end(), expected.begin()))
    fail("the part is damaged, or belongs to another run");
  bytes_.seek(start);
  read_exactly(table.data(), table.size());
  read_exactly(tail.data(), tail.size());
  FieldReader fields(tail);
  const auto recorded_start = fields.get<std::uint64_t>(), checksum = fields.get<std::uint64_t>();
  if (!std::equal(tail.begin() + 16, tail.end(), bytes_of(tail_magic).begin()) || recorded_start != start)
    fail("the part is not complete");
  if (!checksums_agree(checksum, table_checksum(head, table, start))) fail("the part is damaged");
  FieldReader entries(table);
  table_.resize(memory_size(count));
  for (std::uint64_t i = 0; i < count; ++i) {
    PartEntry& entry = table_[i];
    entry.activity_bytes = entries.get<std::uint32_t>();
    entry.value_bytes = entries.get<std::uint32_t>();
    entry.own_checksum = entries.get<std::uint64_t>();
    entry.statistics.at_least.count = entry.statistics.moved.count = parameters.thresholds.count;
    statistics_fields(entries, entry.statistics, parameters);
    blocks_size_ += entry.block_bytes();
    if (blocks_size_ > size - besides - table_size) fail("the part is damaged");
  }
  if (blocks_size_ != size - besides - table_size) fail("the part is damaged");
  bytes_.seek(head_size);
}

void PartReader::read_sums(std::size_t at_once, const std::function<void(std::span<const std::byte>)>& use) {
  bytes_.seek(head_size + blocks_size_);
  RunningChecksum sums;
  std::vector<std::byte> bytes;
  for (std::uint64_t left = sums_bytes_; left > 0; left -= bytes.size()) {
    bytes.resize(std::min<std::uint64_t>(left, at_once));
    read_exactly(bytes.data(), bytes.size());
    sums.add(bytes);
    if (use) use(bytes);
  }
  bytes.resize(8);
  read_exactly(bytes.data(), bytes.size());
  if (!checksums_agree(load_little_endian<std::uint64_t>(bytes.data()), sums.value()))
    fail("the sums of the part are damaged");
}

void PartReader::read_block(std::vector<std::byte>& block) {
  assert(next_block_ < table_.size());
  const PartEntry& entry = table_[next_block_];
  block.resize(memory_size(entry.block_bytes()));
  read_exactly(block.data(), block.size());
  FieldReader fields(block);
  const std::uint64_t length = fields.get<std::uint32_t>(), activity = fields.get<std::uint32_t>();
  const bool fits = length == block.size() - 12 && activity == entry.activity_bytes;
  const std::int64_t brick = first_brick_ + static_cast<std::int64_t>(next_block_);
  const std::span<const std::byte> content(block.data(), block.size() - 8);
  const auto own = load_little_endian<std::uint64_t>(block.data() + content.size());
  if (!fits || own != entry.own_checksum || !checksums_agree(own, own_checksum(content, brick)))
    fail("brick " + std::to_string(brick) + " of the part is damaged");
  ++next_block_;
}

}  // namespace tagrid
