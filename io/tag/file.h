// .tag files, written and read front to back. TagBricks reads them in any order.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/files/spool_file.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/tag/pages.h"

namespace tagrid {

/// Takes the members of a file, after its bricks and its envelope.
class MemberSink {
 public:
  virtual ~MemberSink() = default;
  /// Writes a member of a kind with a factor. Its content is that of a temporary file.
  virtual void write_member(std::uint32_t kind, std::uint32_t factor, SpoolFile& content) = 0;
};

/// Writes the block of a member whose content is that of a temporary file. `checksum` is that of the block before, and
/// becomes that of this one.
void write_member(const Member& member, SpoolFile& content, std::uint64_t& checksum, ByteSink& out);

class TagWriter : public BrickSink, public MemberSink {
 public:
  /// Writes the header. `out` must outlive the writer.
  TagWriter(ByteSink& out, const TagHeader& header);

  /// REQUIRES: bricks come in the order of their numbers, from 0.
  void write_brick(const BrickBytes& brick, const Statistics& statistics) override;
  /// Writes the next bytes of the envelope; see io/envelope. REQUIRES: all bricks were written.
  void write_envelope(std::span<const std::byte> bytes) { envelope_.write(bytes); }
  /// Nothing of the envelope may follow. REQUIRES: all bricks were written.
  void write_member(std::uint32_t kind, std::uint32_t factor, SpoolFile& content) override;
  /// Writes the directory of the index, and the footer. The caller commits the file.
  void finish();

  const TagIndex& index() const { return pages_.index(); }
  /// The sizes of what was written so far.
  TagSizes sizes() const { return tag_sizes(out_.position, header_size_, envelope_out_.position, index()); }

 private:
  /// Counts what is written.
  struct Output : ByteSink {
    explicit Output(ByteSink* to) : sink(to) {}
    void write(std::span<const std::byte> bytes) override {
      sink->write(bytes);
      position += bytes.size();
    }
    ByteSink* sink;
    std::uint64_t position = 0;
  };

  Output out_, envelope_out_;
  CodingParameters parameters_;
  std::uint64_t header_size_ = 0, header_checksum_ = 0;
  std::uint64_t last_checksum_ = 0;  ///< of the last part written: the header, then each block
  std::int64_t next_brick_ = 0;
  EnvelopeBlocks envelope_;
  PageBlocks pages_;
};

/// Reads a .tag file once, front to back, from any stream. Wrong bytes throw BrokenInput with their place.
class TagReader : public BrickSource {
 public:
  /// Reads the header. "-" stands for standard input.
  explicit TagReader(const std::string& path);
  explicit TagReader(std::unique_ptr<ByteStream> stream);

  const TagHeader& header() const { return header_; }
  const CodingParameters& parameters() const { return header_.parameters; }
  const std::string& name() const override { return bytes_->name(); }

  /// Hands out the next brick, after its checksum and that of the following block have been checked: a page
  /// and the next brick, or page, envelope, directory and footer, which nothing may follow. Returns false after
  /// the last brick.
  bool read_brick(BrickBytes& brick) override;
  void stop() override { stopped_ = true; }
  /// Reads the bricks that are left, and the index.
  void read_to_end();

  /// Passes on the entries of each page when it is read: behind its last brick, before this one is handed out.
  void look_at_pages(std::function<void(std::span<const IndexEntry>)> look) { look_ = std::move(look); }

  /// The index and the sizes. REQUIRES: the last brick was read.
  const TagIndex& index() const { return index_; }
  TagSizes sizes() const {
    return with_parity(tag_sizes(file_size_, header_size_, envelope_size_, index_), parity_);
  }
  /// The parity after the footer, which was skipped, not checked. REQUIRES: the last brick was read.
  const std::optional<ParityLayout>& parity() const { return parity_; }
  /// The first block of the envelope; none without an envelope. REQUIRES: the last brick was read.
  const std::vector<std::byte>& beginning_of_envelope() const { return beginning_of_envelope_; }
  /// The parameters of the overviews, in the order of the members. REQUIRES: as above. Of the overviews, only
  /// headers, ends and checksums were checked.
  const std::vector<CodingParameters>& overviews() const { return overviews_; }
  /// The names of all volumes; none if no volume has one. REQUIRES: as above.
  std::vector<std::string> volume_names() const { return names_.take(); }

 private:
  void read_exactly(std::byte* out, std::size_t size, const char* what);
  void read_growing(std::uint64_t size, const char* what);
  void read_frame(BrickBytes& brick);
  /// Reads the two blocks of a page if the last brick of one was read.
  void read_page();
  /// Reads a block that must have this marker and so many bytes of content.
  std::vector<std::byte> read_part_of_page(std::uint32_t marker, std::uint64_t size, std::uint32_t& bytes);
  /// Reads the envelope, and the first bytes of what follows it.
  void read_envelope();
  /// Reads the members, and the first bytes of the index.
  void read_members();
  void read_member();
  /// Reads the header of an overview or a volume, of which `left` bytes are there, into block_.
  void read_nested_header(const Member& member, std::uint64_t left);
  void read_index_section();
  /// Reads to the end of the stream: nothing follows the footer, or parity.
  void skip_parity();
  [[noreturn]] void fail(const std::string& what) const;
  std::string place() const;

  std::atomic<bool> stopped_{false};
  std::unique_ptr<ByteStream> bytes_;
  TagHeader header_;
  std::uint64_t header_size_ = 0, header_checksum_ = 0;
  std::int64_t next_brick_ = 0;      ///< whose frame is read next
  bool starting_ = true;             ///< nothing is in ahead_ yet
  std::uint64_t last_checksum_ = 0;  ///< of what was read last: the header, then each brick
  BrickBytes ahead_;                 ///< the brick after the one that was handed out; id -1 after the last
  std::vector<std::byte> block_;     ///< which is being read
  PageLayout layout_{0};
  std::vector<IndexEntry> page_;  ///< bricks that were read since the last page
  TagIndex seen_;                 ///< sizes and pages of what was read
  std::function<void(std::span<const IndexEntry>)> look_;
  TagIndex index_;
  std::uint64_t file_size_ = 0, envelope_size_ = 0;
  std::vector<std::byte> beginning_of_envelope_;
  std::optional<ParityLayout> parity_;
  std::vector<Member> members_;
  std::vector<CodingParameters> overviews_;
  VolumeNames names_;
};

}  // namespace tagrid
