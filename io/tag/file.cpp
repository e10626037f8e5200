#include "io/tag/file.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/tag/bricks.h"

namespace tagrid {
namespace {

/// The first bytes of a block, which tell what it is.
constexpr std::size_t marker_size = 4;

/// What is kept of a member that is read once: its header and its end. The bytes between them are zeros.
class EndsOfMember : public ByteSource {
 public:
  EndsOfMember(std::uint64_t size, std::string name) : size_(size), name_(std::move(name)) {}

  void add_header(const std::vector<std::byte>& bytes) { add(header_ = bytes); }
  void add(const std::vector<std::byte>& bytes) {
    end_.insert(end_.end(), bytes.end() - std::min(std::ssize(bytes), most_), bytes.end());
    end_.erase(end_.begin(), end_.end() - std::min(std::ssize(end_), most_));
  }

  std::uint64_t size() const override { return size_; }
  const std::string& name() const override { return name_; }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    std::ranges::fill(to, std::byte{0});
    const auto put = [&](std::uint64_t at, const std::vector<std::byte>& bytes) {
      const std::uint64_t first = std::max(at, position),
                          last = std::min(at + bytes.size(), position + to.size());
      if (first < last)
        std::copy(bytes.begin() + static_cast<std::ptrdiff_t>(first - at),
                  bytes.begin() + static_cast<std::ptrdiff_t>(last - at),
                  to.begin() + static_cast<std::ptrdiff_t>(first - position));
    };
    put(0, header_);
    put(size_ - end_.size(), end_);
  }

 private:
  static constexpr std::ptrdiff_t most_ = largest_end;
  std::uint64_t size_;
  std::string name_;
  std::vector<std::byte> header_, end_;
};

}  // namespace

void write_member(const Member& member, SpoolFile& content, std::uint64_t& checksum, ByteSink& out) {
  MemberWriter writer(member, out);
  content.read_back([&](std::span<const std::byte> bytes) { writer.write(bytes); });
  writer.finish(checksum);
}

TagWriter::TagWriter(ByteSink& out, const TagHeader& header)
    : out_(&out),
      envelope_out_(&out_),
      parameters_(header.parameters),
      envelope_(last_checksum_, envelope_out_),
      pages_(header.parameters.bricks().count(), last_checksum_, out_) {
  const std::vector<std::byte> bytes = serialize_header(header);
  header_checksum_ = load_little_endian<std::uint64_t>(bytes.data() + bytes.size() - 8);
  last_checksum_ = header_checksum_;
  out_.write(bytes);
  header_size_ = bytes.size();
}

void TagWriter::write_brick(const BrickBytes& brick, const Statistics& statistics) {
  assert(brick.id == next_brick_);
  ++next_brick_;
  last_checksum_ = write_block(out_, parameters_, brick, last_checksum_);
  pages_.add(brick.activity.size(), brick.values.size(), statistics);
}

void TagWriter::write_member(std::uint32_t kind, std::uint32_t factor, SpoolFile& content) {
  envelope_.finish();
  const Member member = {kind, factor, out_.position, content.size()};
  tagrid::write_member(member, content, last_checksum_, out_);
  pages_.add(member);
}

void TagWriter::finish() {
  envelope_.finish();
  out_.write(file_end(parameters_, index(), out_.position, last_checksum_, header_checksum_));
}

TagReader::TagReader(const std::string& path) : TagReader(open_stream(path)) {}

TagReader::TagReader(std::unique_ptr<ByteStream> stream) : bytes_(std::move(stream)) {
  bytes_->stop_when(stopped_);
  block_.resize(tag_preamble_size);
  block_.resize(bytes_->read(block_.data(), block_.size()));
  header_size_ = header_size_of(name(), block_);
  read_growing(header_size_ - block_.size(), "the header");
  header_ = header_of(name(), block_, header_checksum_);
  names_ = VolumeNames(header_);
  block_ = {};
  last_checksum_ = header_checksum_;
  const auto bricks = static_cast<std::uint64_t>(parameters().bricks().count());
  if (bytes_->size() && bricks > (*bytes_->size() - header_size_) / block_frame_size)
    throw BrokenInput(name() + ": the file is too short for the bricks of its volume; it is truncated");
  layout_ = PageLayout(parameters().bricks().count());
}

std::string TagReader::place() const {
  return next_brick_ < parameters().bricks().count() ? "brick " + std::to_string(next_brick_) : "the index";
}

void TagReader::fail(const std::string& what) const {
  throw broken_part(name(), place(), bytes_->position(), what);
}

void TagReader::read_exactly(std::byte* out, std::size_t size, const char* what) {
  if (bytes_->read(out, size) != size) fail(std::string("the file ends in ") + what + "; it is truncated");
}

// Appends to block_ in steps, so that a false size takes no memory.
void TagReader::read_growing(std::uint64_t size, const char* what) {
  constexpr std::uint64_t step = 1 << 20;
  while (size > 0) {
    const std::size_t have = block_.size(), more = std::min(step, size);
    block_.resize(have + more);
    read_exactly(block_.data() + have, more, what);
    size -= more;
  }
}

// The next block is bound to a brick. It is read before the brick is handed out, and shows that the brick
// belongs to this file.
bool TagReader::read_brick(BrickBytes& brick) {
  const std::int64_t count = parameters().bricks().count();
  if (starting_) read_frame(ahead_);
  starting_ = false;
  if (ahead_.id < 0) return false;
  brick = std::move(ahead_);
  ahead_ = {};
  read_page();
  if (next_brick_ < count) {
    read_frame(ahead_);
  } else {
    ahead_.id = -1;
    read_envelope();
    read_members();
    read_index_section();
  }
  return true;
}

void TagReader::read_frame(BrickBytes& brick) {
  block_.clear();
  read_growing(4, "a brick");
  const auto length = load_little_endian<std::uint32_t>(block_.data());
  if (length < 4 || length > largest_body(parameters(), next_brick_)) fail("an impossible size");
  read_growing(std::uint64_t{length} + 8, "a brick");
  if (Status status = parse_block(block_, parameters(), next_brick_, last_checksum_, brick); !status.ok())
    fail(status.what());
  ++next_brick_;
  page_.push_back({static_cast<std::uint32_t>(brick.activity.size()),
                   static_cast<std::uint32_t>(brick.values.size()), 0, 0, 0});
}

std::vector<std::byte> TagReader::read_part_of_page(std::uint32_t marker, std::uint64_t size,
                                                    std::uint32_t& bytes) {
  const auto require = [&](const Status& status) {
    if (!status.ok())
      throw broken_part(name(), name_of_page(layout_, static_cast<std::int64_t>(seen_.pages.size())),
                        bytes_->position(), status.what());
  };
  std::uint64_t rest = 0;
  std::vector<std::byte> columns;
  block_.clear();
  read_growing(packed_head_size, "the index");
  require(parse_packed_head(block_, marker, {size, size}, rest));
  read_growing(rest, "the index");
  require(parse_packed_block(block_, last_checksum_, &columns));
  bytes = static_cast<std::uint32_t>(block_.size());
  return columns;
}

void TagReader::read_page() {
  const auto page = static_cast<std::int64_t>(seen_.pages.size());
  if (page == layout_.pages() || static_cast<std::int64_t>(page_.size()) < layout_.bricks_in(page)) return;
  PageFacts facts;
  std::vector<IndexEntry> stored(page_.size());
  parse_sizes(read_part_of_page(sizes_marker, page_.size() * sizes_entry, facts.sizes_bytes), stored);
  for (std::size_t i = 0; i < page_.size(); ++i) {
    if (stored[i].activity_bytes != page_[i].activity_bytes || stored[i].value_bytes != page_[i].value_bytes)
      throw broken_part(name(), name_of_page(layout_, page), bytes_->position(),
                        "the sizes are not those of its bricks");
    facts.brick_bytes += block_frame_size + page_[i].activity_bytes + page_[i].value_bytes;
    seen_.activity_bytes += page_[i].activity_bytes;
    seen_.value_bytes += page_[i].value_bytes;
  }
  parse_statistics(
      read_part_of_page(statistics_marker, page_.size() * statistics_entry, facts.statistics_bytes), stored);
  take_range(stored, facts);
  seen_.pages.push_back(facts);
  page_.clear();
  if (look_) look_(stored);
}

void TagReader::read_envelope() {
  const std::uint64_t start = bytes_->position();
  const auto require = [&](const Status& status) {
    if (!status.ok()) throw broken_part(name(), "the envelope", bytes_->position(), status.what());
  };
  for (;;) {
    block_.clear();
    read_growing(marker_size, "the index");
    envelope_size_ = bytes_->position() - marker_size - start;
    if (load_little_endian<std::uint32_t>(block_.data()) != envelope_marker) return;
    read_growing(packed_head_size - marker_size, "the envelope");
    std::uint64_t rest = 0;
    require(parse_packed_head(block_, envelope_marker, envelope_content, rest));
    read_growing(rest, "the envelope");
    const bool is_first = envelope_size_ == 0;
    require(parse_packed_block(block_, last_checksum_, is_first ? &beginning_of_envelope_ : nullptr));
  }
}

void TagReader::read_members() {
  while (load_little_endian<std::uint32_t>(block_.data()) == member_marker) {
    read_member();
    block_.clear();
    read_growing(marker_size, "the index");
  }
}

void TagReader::read_member() {
  Member member;
  const auto require = [&](const Status& status) {
    const std::string part = member.is_volume() ? member.name() : "a member";
    if (!status.ok()) throw broken_part(name(), part, bytes_->position(), status.what());
  };
  const std::uint64_t start = bytes_->position() - marker_size;
  read_growing(member_head_size - marker_size, "a member");
  require(parse_member_head(block_, start, member));
  if (members_.size() == most_members + static_cast<std::size_t>(header_.volumes) - 1)
    require(Status::broken("there are too many members"));
  MemberChecksum own(member);
  std::uint64_t left = member.length;
  std::shared_ptr<EndsOfMember> nested;
  const auto took_block = [&] {
    own.add(block_);
    left -= block_.size();
  };
  block_.clear();
  if (member.is_overview() || member.is_volume()) {
    read_nested_header(member, left);
    nested = std::make_shared<EndsOfMember>(member.length, name() + ": " + member.name());
    nested->add_header(block_);
    took_block();
  }
  constexpr std::uint64_t step = 1 << 20;
  while (left > 0) {
    block_.clear();
    read_growing(std::min(step, left), "a member");
    if (nested) nested->add(block_);
    took_block();
  }
  block_.clear();
  read_growing(8, "a member");
  const auto in_file = load_little_endian<std::uint64_t>(block_.data());
  if (!checksums_agree(in_file, own.chained(last_checksum_)))
    require(Status::broken("checksum mismatch: the member is damaged or of another file"));
  last_checksum_ = in_file;
  if (nested) TagBricks(nested).require_parts_of(member);
  members_.push_back(member);
}

void TagReader::read_nested_header(const Member& member, std::uint64_t left) {
  const std::string nested = name() + ": " + member.name();
  const auto no_room = [&] { return BrokenInput(nested + ": is shorter than its header"); };
  if (left < tag_preamble_size) throw no_room();
  read_growing(tag_preamble_size, "a member");
  const std::size_t size = header_size_of(nested, block_);
  if (size > left) throw no_room();
  read_growing(size - tag_preamble_size, "a member");
  std::uint64_t checksum = 0;
  const TagHeader header = header_of(nested, block_, checksum);
  if (Status status = check_nested(parameters(), member, header); !status.ok())
    throw BrokenInput(nested + ": " + status.what());
  if (member.is_overview()) overviews_.push_back(header.parameters);
  if (member.is_volume()) names_.add(name_of_volume(header));
}

void TagReader::read_index_section() {
  const FileEnd end = {parameters(),   header_size_,   header_checksum_, bytes_->position() - marker_size,
                       last_checksum_, header_.volumes};
  read_growing(index_head_size - marker_size, "the index");
  std::uint64_t rest = 0, envelope = 0;
  if (Status status = end.parse_head(block_, rest); !status.ok()) fail(status.what());
  read_growing(rest, "the index");
  if (Status status = end.parse(block_, index_, envelope); !status.ok())
    throw broken_part(name(), place(), bytes_->position(), status);
  if (index_.members != members_) fail("the table of members does not name the members of the file");
  if (envelope != envelope_size_ || index_.activity_bytes != seen_.activity_bytes ||
      index_.pages != seen_.pages)
    fail("the sizes of the bricks, or the pages, are not those in the directory");
  if (Status status = check_extremes(index_); !status.ok()) fail(status.what());
  next_brick_ = parameters().bricks().count();
  file_size_ = end.start + block_.size();
  skip_parity();
  block_ = {};
}

void TagReader::skip_parity() {
  std::vector<std::byte> bytes(parity_head_size);
  bytes.resize(bytes_->read(bytes.data(), bytes.size()));
  if (bytes.empty()) return;
  parity_ = parity_that_follows(bytes, file_size_);
  if (!parity_) throw BrokenInput(name() + ": " + bytes_follow);
  std::uint64_t rest = parity_->end(file_size_) - file_size_ - parity_head_size;
  bytes.resize(std::size_t{1} << 16);
  while (rest > 0) {
    const std::size_t count = bytes_->read(bytes.data(), std::min<std::uint64_t>(rest, bytes.size()));
    if (count == 0) throw BrokenInput(name() + ": the file ends in its parity; it is truncated");
    rest -= count;
  }
  if (bytes_->read(bytes.data(), 1) != 0) throw BrokenInput(name() + ": " + bytes_follow);
}

void TagReader::read_to_end() {
  BrickBytes brick;
  while (read_brick(brick)) {
  }
}

}  // namespace tagrid
