#include "io/parity/parity.h"

#include <algorithm>
#include <array>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/parity/reed_solomon.h"
#include "io/system/files.h"

namespace tagrid {
namespace {

constexpr std::size_t before_payload = parity_head_size - 8;

/// The payloads of a group of pages, in rows: pages of the table, then those of their parity.
class PageGroup {
 public:
  PageGroup(const ParityLayout& layout, std::uint64_t group)
      : layout_(layout), group_(group), code_(layout.pages_of_group(), layout.parity_of_group()) {
    const auto rows = static_cast<std::size_t>(table_rows() + layout.parity_of_group());
    bytes_.resize(rows * layout.payload());
    for (std::size_t row = 0; row < rows; ++row) starts_.push_back(bytes_.data() + row * layout.payload());
  }

  int table_rows() const { return layout_.pages_of_group(); }
  int rows() const { return static_cast<int>(starts_.size()); }
  std::span<std::byte> payload(int row) {
    return {starts_[static_cast<std::size_t>(row)], layout_.payload()};
  }
  /// Number of the page in a row; nothing for a row of zeros that fills the group up.
  std::optional<std::uint64_t> number(int row) const {
    const bool of_table = row < table_rows();
    const std::uint64_t page =
        static_cast<std::uint64_t>(of_table ? row : row - table_rows()) * layout_.groups() + group_;
    if (!of_table) return layout_.pages() + page;
    return page < layout_.pages() ? std::optional(page) : std::nullopt;
  }
  void encode() { code_.encode(starts_, layout_.payload()); }
  void restore(std::span<const int> lost) { code_.restore(starts_, lost, layout_.payload()); }

 private:
  const ParityLayout& layout_;
  std::uint64_t group_;
  ReedSolomon code_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte*> starts_;
};

/// Calls use(byte of the payload, number of the checksum) for the checksums of a page. A payload is a
/// multiple of 8 bytes.
template <class Use>
void for_each_checksum(const ParityLayout& layout, std::uint64_t page, std::uint64_t count, Use use) {
  const std::uint64_t in_page = layout.payload() / 8, begin = page * in_page;
  for (std::uint64_t i = begin; i < std::min(count, begin + in_page); ++i) use(8 * (i - begin), i);
}

/// Calls use(number, page) for every page of a table, those of its parity included. `layout` has its id.
template <class Use>
void make_pages(const ParityLayout& layout, std::span<const std::uint64_t> checksums, Use use) {
  for (std::uint64_t g = 0; g < layout.groups(); ++g) {
    PageGroup group(layout, g);
    for (int row = 0; row < group.table_rows(); ++row)
      if (const auto page = group.number(row))
        for_each_checksum(layout, *page, checksums.size(), [&](std::uint64_t at, std::uint64_t i) {
          store_little_endian(group.payload(row).data() + at, checksums[i]);
        });
    group.encode();
    for (int row = 0; row < group.rows(); ++row)
      if (const auto page = group.number(row))
        use(*page, serialize_description(layout, static_cast<std::uint32_t>(*page), group.payload(row)));
  }
}

/// Reads the table from its pages. read(number, page) fills a page, whatever is there. `damaged` receives the
/// number of pages that are wrong. Nothing if too many are.
template <class Read>
std::optional<std::vector<std::uint64_t>> read_pages(const ParityLayout& layout, Read read,
                                                     std::uint64_t& damaged) {
  damaged = 0;
  std::vector<std::uint64_t> checksums(memory_size(layout.sequence()));
  std::vector<std::byte> page(layout.block_size());
  bool all_known = true;
  for (std::uint64_t g = 0; g < layout.groups(); ++g) {
    PageGroup group(layout, g);
    std::vector<int> lost;
    for (int row = 0; row < group.rows(); ++row) {
      const auto number = group.number(row);
      if (!number) continue;
      read(*number, page);
      const auto found = parse_description(page);
      if (found && found->layout == layout && found->number == *number)
        std::ranges::copy(std::span(page).subspan(before_payload, layout.payload()),
                          group.payload(row).begin());
      else
        lost.push_back(row);
    }
    damaged += lost.size();
    if (static_cast<int>(lost.size()) > layout.parity_of_group()) {
      all_known = false;
      continue;
    }
    group.restore(lost);
    for (int row = 0; row < group.table_rows(); ++row)
      if (const auto number = group.number(row))
        for_each_checksum(layout, *number, checksums.size(), [&](std::uint64_t at, std::uint64_t i) {
          checksums[i] = load_little_endian<std::uint64_t>(group.payload(row).data() + at);
        });
  }
  if (!all_known || id_of_table(checksums) != layout.id) return std::nullopt;
  return checksums;
}

/// What a disk that cannot read a stretch may still read beside it.
constexpr std::uint64_t sector = 4096;

/// Fills `to` with what a damaged file has from `position` on, and with zeros where it ends, or where a disk
/// cannot read it. `step` is the size of the stretches that are given up.
void read_what_is_there(const ByteSource& file, std::uint64_t position, std::span<std::byte> to,
                        std::uint64_t step) {
  const std::uint64_t size = file.size();
  const std::uint64_t there = position < size ? std::min<std::uint64_t>(to.size(), size - position) : 0;
  std::ranges::fill(to.subspan(there), std::byte{0});
  to = to.first(there);
  if (to.empty()) return;
  try {
    file.read_at(position, to);
  } catch (const WorldError&) {
    if (to.size() <= step) {
      std::ranges::fill(to, std::byte{0});
      return;
    }
    for (std::uint64_t begin = 0; begin < to.size(); begin += step)
      read_what_is_there(file, position + begin, to.subspan(begin, std::min(step, to.size() - begin)), step);
  }
}

void write_frame(const ParityLayout& layout, std::uint64_t base, const WriteAt& write) {
  write(base, serialize_description(layout, head_number, {}));
  // Written, not left as a gap: the output may have other bytes there.
  const std::uint64_t begin = base + parity_head_size;
  const std::vector<std::byte> zeros(layout.first_unit(base) - begin);
  write(begin, zeros);
  write(layout.foot(base), serialize_description(layout, foot_number, {}));
}

void write_pages(const ParityLayout& layout, std::span<const std::uint64_t> checksums, std::uint64_t base,
                 const WriteAt& write) {
  make_pages(layout, checksums, [&](std::uint64_t number, std::span<const std::byte> page) {
    write(layout.place_of_page(base, number), page);
  });
}

void write_run(const ParityLayout& layout, const BlockRun& run, std::uint64_t base, const WriteAt& write) {
  if (run.is_parity) return write(layout.place_of_parity(base, run.first), run.bytes);
  const std::uint64_t begin = run.first << layout.log2_block;
  write(begin, run.bytes.first(std::min<std::uint64_t>(run.bytes.size(), layout.file_size - begin)));
}

/// Appends the bytes of a block, after those before.
void append_block(std::vector<Stretch>& stretches, const ParityLayout& layout, std::uint64_t block) {
  const std::uint64_t begin = block << layout.log2_block,
                      end = std::min(layout.file_size, begin + layout.block_size());
  if (!stretches.empty() && stretches.back().end == begin)
    stretches.back().end = end;
  else
    stretches.push_back({begin, end});
}

/// The layout of the description at a position, if it is whole and belongs there.
std::optional<ParityLayout> credible(const ByteSource& source, std::uint64_t position, bool beside,
                                     std::span<const std::byte> beginning) {
  const auto claimed = claimed_description(beginning);
  if (!claimed || position != claimed->place(beside ? 0 : claimed->layout.file_size)) return std::nullopt;
  std::vector<std::byte> bytes(claimed->size());
  read_what_is_there(source, position, bytes, bytes.size());
  const auto found = parse_description(bytes);
  return found ? std::optional(found->layout) : std::nullopt;
}

/// Reads a file in search of a description. Where the file ends, or its head lies, may not be known.
std::optional<ParityLayout> search(const ByteSource& source, bool beside) {
  constexpr std::uint64_t step = std::uint64_t{1} << 20;
  std::vector<std::byte> bytes(step + parity_head_size - 1);  // one that begins here may end in the next part
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (std::uint64_t begin = 0; begin < source.size(); begin += step) {
    read_what_is_there(source, begin, bytes, sector);
    for (auto i = text.find(parity_magic); i < step; i = text.find(parity_magic, i + 1))
      if (auto layout = credible(source, begin + i, beside, std::span(bytes).subspan(i, parity_head_size)))
        return layout;
  }
  return std::nullopt;
}

/// The layout in the head or the foot of parity that is beside its file.
std::optional<ParityLayout> layout_beside(const ByteSource& parity) {
  std::array<std::byte, parity_head_size> bytes;
  read_what_is_there(parity, 0, bytes, bytes.size());
  if (const auto head = parse_description(bytes); head && head->number == head_number) return head->layout;
  if (parity.size() < bytes.size()) return std::nullopt;
  read_what_is_there(parity, parity.size() - bytes.size(), bytes, bytes.size());
  if (const auto foot = parse_description(bytes); foot && foot->number == foot_number) return foot->layout;
  return search(parity, true);
}

}  // namespace

std::uint64_t least_parity_memory(const ParityLayout& layout) {
  const std::uint64_t stripe =
      static_cast<std::uint64_t>(layout.data() + layout.parity) * layout.block_size();
  const std::uint64_t group =
      static_cast<std::uint64_t>(layout.pages_of_group() + layout.parity_of_group() + 1) *
      layout.block_size();
  // Checksums, and a bit for each damaged and each lost block.
  return std::max(stripe, group) + 8 * layout.sequence() + layout.blocks() / 4;
}

std::uint64_t write_parity(const ByteSource& file, ParityShare share, std::uint64_t base,
                           const WriteAt& write, std::uint64_t memory) {
  ParityLayout layout = ParityLayout::of(file.size(), share);
  const ReedSolomon code(layout.data(), layout.parity);
  std::vector<std::uint64_t> checksums(layout.sequence());
  {
    StripeBand band(layout, memory);
    while (band.next()) {
      band.fill_up();
      band.for_each_run(false, [&](const BlockRun& run) {
        const std::uint64_t begin = run.first << layout.log2_block;
        const auto there = run.bytes.first(std::min<std::uint64_t>(run.bytes.size(), file.size() - begin));
        file.read_at(begin, there);
        std::ranges::fill(run.bytes.subspan(there.size()), std::byte{0});
      });
      code.encode(band.row_starts(), band.row_bytes());
      for (int row = 0; row < band.rows(); ++row)
        for (std::uint64_t i = 0; i < band.count(); ++i)
          if (const auto number = band.number(row, i)) checksums[*number] = checksum_of({band.block(row, i)});
      band.for_each_run(true, [&](const BlockRun& run) { write_run(layout, run, base, write); });
    }
  }
  layout.id = id_of_table(checksums);
  write_pages(layout, checksums, base, write);
  write_frame(layout, base, write);
  return layout.end(base);
}

std::optional<ParityLayout> search_for_parity(const ByteSource& file) { return search(file, false); }

ProtectedFile::ProtectedFile(std::shared_ptr<const ByteSource> file, std::shared_ptr<const ByteSource> parity,
                             const ParityLayout& layout)
    : file_(std::move(file)), parity_(std::move(parity)), layout_(layout) {
  base_ = is_beside() ? 0 : layout_.file_size;
}

std::optional<ProtectedFile> ProtectedFile::find(std::shared_ptr<const ByteSource> file,
                                                 std::shared_ptr<const ByteSource> beside) {
  // Parity at most doubles a file. Of one that is far shorter than a description says, nothing can be
  // repaired, and the numbers of that description must not take memory.
  const auto found = [&](const std::optional<ParityLayout>& layout,
                         const std::shared_ptr<const ByteSource>& parity) -> std::optional<ProtectedFile> {
    const std::uint64_t there = file->size() + (parity == file ? 0 : parity->size());
    if (!layout || layout->file_size / 2 > there) return std::nullopt;
    return ProtectedFile(file, parity, *layout);
  };
  if (auto at_end = found(parity_at_end(*file), file)) return at_end;
  if (beside)
    if (auto other = found(layout_beside(*beside), beside)) return other;
  return found(search(*file, false), file);
}

std::optional<std::vector<std::uint64_t>> ProtectedFile::read_table(ParityCondition& condition) const {
  std::uint64_t damaged = 0;
  auto table = read_pages(
      layout_,
      [&](std::uint64_t number, std::span<std::byte> page) {
        read_what_is_there(*parity_, layout_.place_of_page(base_, number), page, page.size());
      },
      damaged);
  condition.damaged_parity += damaged;
  if (!table) condition.unknown_pages = std::max<std::uint64_t>(damaged, 1);
  return table;
}

bool ProtectedFile::is_frame_intact() const {
  if (parity_->size() != layout_.end(base_)) return false;
  bool same = true;
  write_frame(layout_, base_, [&](std::uint64_t position, std::span<const std::byte> expected) {
    std::vector<std::byte> bytes(expected.size());
    read_what_is_there(*parity_, position, bytes, bytes.size() + 1);
    same = same && std::ranges::equal(bytes, expected);
  });
  return same;
}

ParityCondition ProtectedFile::walk(const WriteAt* write, std::uint64_t memory) const {
  ParityCondition condition;
  condition.damaged_frame = !is_frame_intact();
  condition.wrong_size = is_beside() && file_->size() != layout_.file_size;
  const auto checksums = read_table(condition);
  if (!checksums) return condition;
  const ReedSolomon code(layout_.data(), layout_.parity);
  std::vector<bool> damaged(layout_.blocks()), lost(layout_.blocks());
  StripeBand band(layout_, memory);
  while (band.next()) {
    band.fill_up();
    const auto read = [&](const BlockRun& run) {
      const std::uint64_t place =
          run.is_parity ? layout_.place_of_parity(base_, run.first) : run.first << layout_.log2_block;
      read_what_is_there(run.is_parity ? *parity_ : *file_, place, run.bytes, layout_.block_size());
      // The last block ends in zeros, whatever follows it in the file.
      if (!run.is_parity && place + run.bytes.size() > layout_.file_size)
        std::ranges::fill(run.bytes.subspan(layout_.file_size - place), std::byte{0});
    };
    band.for_each_run(false, read);
    band.for_each_run(true, read);
    const auto is_right = [&](int row, std::uint64_t i) {
      const auto number = band.number(row, i);
      return !number || checksum_of({band.block(row, i)}) == (*checksums)[*number];
    };
    for (std::uint64_t i = 0; i < band.count(); ++i) {
      std::vector<int> wrong;
      std::vector<std::byte*> blocks;
      for (int row = 0; row < band.rows(); ++row) {
        blocks.push_back(band.block(row, i).data());
        if (is_right(row, i)) continue;
        wrong.push_back(row);
        ++(row < layout_.data() ? condition.damaged_blocks : condition.damaged_parity);
        if (row < layout_.data()) damaged[*band.number(row, i)] = true;
      }
      if (wrong.empty()) continue;
      const bool can_be_repaired = static_cast<int>(wrong.size()) <= layout_.parity;
      if (write && can_be_repaired) code.restore(blocks, wrong, layout_.block_size());
      for (const int row : wrong)
        if (row < layout_.data() && (!can_be_repaired || (write && !is_right(row, i))))
          lost[*band.number(row, i)] = true;
    }
    if (!write) continue;
    const auto write_to = [&](const BlockRun& run) { write_run(layout_, run, base_, *write); };
    band.for_each_run(false, write_to);
    if (!is_beside()) band.for_each_run(true, write_to);
  }
  for (std::uint64_t block = 0; block < layout_.blocks(); ++block) {
    if (damaged[block]) append_block(condition.damaged, layout_, block);
    if (lost[block]) append_block(condition.lost, layout_, block);
  }
  if (write && !is_beside()) {
    write_pages(layout_, *checksums, base_, *write);
    write_frame(layout_, base_, *write);
  }
  return condition;
}

std::string file_of_link(const std::string& path) {
  const auto status = status_of_name(path);
  if (!status || !status->is_link() || !status_of(path)) return path;
  std::string file;
  if (!files().resolve(path, file)) throw world_error("cannot look at", path, errno);
  return file;
}

bool has_parity(const std::string& path) {
  if (parity_at_end(*open_source(path))) return true;
  const std::string beside = parity_beside(path);
  return is_regular_input(beside) && layout_beside(*open_source(beside));
}

std::optional<ProtectedFile> protected_file(const std::string& path) {
  auto file = open_source(path);
  const std::string beside = parity_beside(path);
  if (path == "-" || !is_regular_input(beside)) return ProtectedFile::find(std::move(file));
  return ProtectedFile::find(std::move(file), open_source(beside));
}

std::uint64_t id_of_table(std::span<const std::uint64_t> checksums) {
  RunningChecksum sum;
  for (const std::uint64_t checksum : checksums) {
    std::array<std::byte, 8> bytes;
    store_little_endian(bytes.data(), checksum);
    sum.add(bytes);
  }
  return sum.value();
}

}  // namespace tagrid
