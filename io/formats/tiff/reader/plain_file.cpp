#include "io/formats/tiff/reader/tiff_file.h"

#include <fmt/format.h>
#include <tiff.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "io/files/file_bytes.h"
#include "io/formats/tiff/reader/directories.h"

namespace tagrid {
namespace {

/// Of all bytes that a description gives, so that it stays a short message.
constexpr std::size_t most_given = std::size_t{4} << 20;
/// Values with so many bytes stay in the file that has them, and the description says where.
constexpr std::uint64_t long_values = 512;
constexpr int deepest = 8;  // directories in directories

constexpr std::uint16_t type_short = TIFF_SHORT, type_long = TIFF_LONG, type_long8 = TIFF_LONG8;

/// Tags that say how the samples of a page are stored.
constexpr std::array<std::uint16_t, 16> tags_of_storage = {
    TIFFTAG_COMPRESSION,  TIFFTAG_FILLORDER,       TIFFTAG_STRIPOFFSETS,
    TIFFTAG_ROWSPERSTRIP, TIFFTAG_STRIPBYTECOUNTS, TIFFTAG_T4OPTIONS,
    TIFFTAG_T6OPTIONS,    TIFFTAG_PREDICTOR,       TIFFTAG_TILEWIDTH,
    TIFFTAG_TILELENGTH,   TIFFTAG_TILEOFFSETS,     TIFFTAG_TILEBYTECOUNTS,
    TIFFTAG_BADFAXLINES,  TIFFTAG_CLEANFAXDATA,    TIFFTAG_CONSECUTIVEBADFAXLINES,
    TIFFTAG_JPEGTABLES};
constexpr std::array<std::uint16_t, 2> tags_of_free_space = {TIFFTAG_FREEOFFSETS, TIFFTAG_FREEBYTECOUNTS};
/// Tags whose values are places in the file in ways of their own: old JPEG, LSM, STK.
constexpr std::array<std::uint16_t, 9> tags_with_places = {TIFFTAG_JPEGIFOFFSET,
                                                           TIFFTAG_JPEGQTABLES,
                                                           TIFFTAG_JPEGDCTABLES,
                                                           TIFFTAG_JPEGACTABLES,
                                                           34412,
                                                           33628,
                                                           33629,
                                                           33630,
                                                           33631};

bool is_one_of(std::span<const std::uint16_t> tags, std::uint16_t tag) {
  return std::ranges::find(tags, tag) != tags.end();
}

bool leads_to_directories(const TiffField& field) {
  return field.type == TIFF_IFD || field.type == TIFF_IFD8 || field.tag == TIFFTAG_SUBIFD ||
         field.tag == TIFFTAG_EXIFIFD || field.tag == TIFFTAG_GPSIFD ||
         field.tag == TIFFTAG_INTEROPERABILITYIFD;
}

/// The bytes of the new file, front to back.
class NewFile {
 public:
  NewFile(const TiffLayout& layout, std::size_t number) : layout_(layout), number_(number) {}

  std::uint64_t size() const { return size_; }
  void give(const std::string& bytes) {
    if (given_ + bytes.size() > most_given) throw NoPlainForm{"its pages have too many tags"};
    if (pieces_.empty() || pieces_.back().kind != PlainPiece::Kind::given)
      pieces_.push_back(PlainPiece::given(""));
    pieces_.back().bytes += bytes;
    given_ += bytes.size();
    size_ += bytes.size();
  }
  void copy(std::uint64_t from, std::uint64_t count) {
    if (count == 0) return;
    pieces_.push_back(PlainPiece::stretch(number_, from, from + count));
    given_ += 4 * sizeof(PlainPiece);  // and its description
    if (given_ > most_given) throw NoPlainForm{"its pages have too many strips"};
    size_ += count;
  }
  void samples(std::uint64_t count) {
    pieces_.push_back(PlainPiece::samples(count));
    size_ += count;
  }
  /// Directories and values begin at even bytes, and in BigTIFF at multiples of eight.
  void align() {
    const std::uint64_t unit = layout_.is_big ? 8 : 2;
    give(std::string((unit - size_ % unit) % unit, '\0'));
  }

  /// A place that becomes known later.
  struct Later {
    std::size_t piece = 0, at = 0;
  };
  Later give_later() {
    give(std::string(layout_.place_bytes(), '\0'));
    return {pieces_.size() - 1, pieces_.back().bytes.size() - layout_.place_bytes()};
  }
  void set(const Later& later, std::uint64_t place) {
    std::string bytes;
    layout_.put(bytes, place, layout_.place_bytes());
    pieces_[later.piece].bytes.replace(later.at, bytes.size(), bytes);
  }

  const TiffLayout& layout() const { return layout_; }
  std::vector<PlainPiece> take() { return std::move(pieces_); }

 private:
  TiffLayout layout_;
  std::size_t number_, given_ = 0;
  std::uint64_t size_ = 0;
  std::vector<PlainPiece> pieces_;
};

/// Where the samples of a page lie in the new file.
struct PlainPage {
  std::uint64_t at = 0;
  const TiffPage* page = nullptr;
};

class PlainTiff {
 public:
  PlainTiff(const std::string& path, std::size_t number, const std::vector<const TiffPage*>& pages)
      : old_(path), new_(layout_of(old_, pages), number) {
    for (const TiffPage* page : pages)
      if (!slices_.emplace(page->directory, PlainPage{0, page}).second)
        throw NoPlainForm{"a page of it is two slices"};
    const TiffLayout& layout = new_.layout();
    std::string begin = layout.big_endian ? "MM" : "II";
    layout.put(begin, layout.is_big ? 43 : 42, 2);
    if (layout.is_big) {
      layout.put(begin, layout.place_bytes(), 2);
      layout.put(begin, 0, 2);
    }
    new_.give(begin);
    const NewFile::Later first = new_.give_later();
    samples_at_ = new_.size();
    std::uint64_t bytes = 0;
    for (const TiffPage* page : pages) {
      slices_[page->directory].at = samples_at_ + bytes;
      bytes += page->bytes();
    }
    new_.samples(bytes);
    new_.set(first, copy_chain(old_.first(), 0));
    if (seen_slices_ != slices_.size()) throw NoPlainForm{"its pages cannot be found"};
  }

  std::uint64_t samples_at() const { return samples_at_; }
  std::vector<PlainPiece> pieces() { return new_.take(); }

 private:
  /// A field of the new file, with its values or where they are.
  struct Entry {
    std::uint16_t tag = 0, type = 0;
    std::uint64_t count = 0;
    std::string value;  ///< in the directory: filled up to the bytes of a place
  };

  static TiffLayout layout_of(const TiffDirectories& old, const std::vector<const TiffPage*>& pages) {
    TiffLayout layout = old.layout();
    std::uint64_t bytes = old.size() + most_given;
    for (const TiffPage* page : pages) bytes += page->bytes();
    layout.is_big = layout.is_big || bytes > std::numeric_limits<std::uint32_t>::max();
    return layout;
  }

  /// Copies a directory and those that follow it. Returns the place of the first one in the new file. Some
  /// programs chain directories that a list names, too: what was copied before is linked to.
  std::uint64_t copy_chain(std::uint64_t place, int depth) {
    std::uint64_t first = 0;
    std::optional<NewFile::Later> link;
    for (std::set<std::uint64_t> chain; place != 0;) {
      if (depth > deepest || !chain.insert(place).second)
        throw NoPlainForm{"its directories lead in circles"};
      const auto known = copies_.find(place);
      std::uint64_t copy = known == copies_.end() ? 0 : known->second, next = 0;
      std::optional<NewFile::Later> next_link;
      if (copy == 0) {
        if (!begun_.insert(place).second) throw NoPlainForm{"its directories lead in circles"};
        const TiffDirectory old = old_.at(place);
        const std::vector<Entry> entries = entries_of(old, place, depth);
        new_.align();
        copies_[place] = copy = new_.size();
        next_link = write(entries);
        next = old.next;
      }
      if (link) new_.set(*link, copy);
      if (first == 0) first = copy;
      link = next_link;
      place = next;
    }
    return first;
  }

  /// The fields of a directory in the new file. Their values, and directories below, are written.
  std::vector<Entry> entries_of(const TiffDirectory& old, std::uint64_t place, int depth) {
    const auto slice = depth == 0 ? slices_.find(place) : slices_.end();
    const bool is_slice = slice != slices_.end();
    if (depth == 0 && !is_slice) require_plain_or_small(old);
    std::vector<Entry> entries;
    for (const TiffField& field : old.fields) {
      if (is_one_of(tags_with_places, field.tag))
        throw NoPlainForm{fmt::format("its tag {} holds places in the file", field.tag)};
      if (is_one_of(tags_of_free_space, field.tag) || (is_slice && is_one_of(tags_of_storage, field.tag)))
        continue;
      if (field.tag == TIFFTAG_STRIPOFFSETS || field.tag == TIFFTAG_TILEOFFSETS)
        entries.push_back(copied_strips(old, field));
      else if (leads_to_directories(field))
        entries.push_back(copied_below(field, depth));
      else
        entries.push_back(copied(field));
    }
    if (is_slice) {
      describe(slice->second, entries);
      ++seen_slices_;
    }
    std::ranges::stable_sort(entries, {}, &Entry::tag);
    return entries;
  }

  /// Many programs take the compression of the first page for that of all.
  void require_plain_or_small(const TiffDirectory& page) const {
    constexpr std::uint64_t not_full = FILETYPE_REDUCEDIMAGE | FILETYPE_MASK;
    if ((old_.number_of(page, TIFFTAG_SUBFILETYPE, 0) & not_full) == 0 &&
        old_.number_of(page, TIFFTAG_COMPRESSION, COMPRESSION_NONE) != COMPRESSION_NONE)
      throw NoPlainForm{"it has samples of other volumes, which are compressed"};
  }

  std::uint16_t type_of_places() const { return new_.layout().is_big ? type_long8 : type_long; }

  Entry copied_below(const TiffField& field, int depth) {
    std::vector<std::uint64_t> places;
    for (const std::uint64_t place : old_.numbers(field)) places.push_back(copy_chain(place, depth + 1));
    const bool is_ifd = field.type == TIFF_IFD || field.type == TIFF_IFD8;
    const std::uint16_t type_ifd = new_.layout().is_big ? TIFF_IFD8 : TIFF_IFD;
    return entry_of(field.tag, is_ifd ? type_ifd : type_of_places(), places);
  }

  /// Values that are the same in the new file.
  Entry copied(const TiffField& field) {
    Entry entry{field.tag, field.type, field.count, ""};
    const std::uint64_t bytes = field.bytes();
    if (bytes > new_.layout().place_bytes() && bytes >= long_values) {
      std::uint64_t& copy = long_values_[{field.at, bytes}];  // pages may share them
      if (copy == 0) {
        new_.align();
        copy = new_.size();
        new_.copy(field.at, bytes);
      }
      new_.layout().put(entry.value, copy, new_.layout().place_bytes());
    } else {
      place_value(entry, old_.bytes(field.at, bytes));
    }
    return entry;
  }

  /// Puts values into their field, or where it leads.
  void place_value(Entry& entry, const std::string& values) {
    const std::size_t room = new_.layout().place_bytes();
    if (values.size() <= room) {
      entry.value = values + std::string(room - values.size(), '\0');
      return;
    }
    new_.align();
    entry.value.clear();
    new_.layout().put(entry.value, new_.size(), room);
    new_.give(values);
  }

  Entry entry_of(std::uint16_t tag, std::uint16_t type, const std::vector<std::uint64_t>& numbers) {
    Entry entry{tag, type, numbers.size(), ""};
    std::string values;
    for (const std::uint64_t number : numbers)
      new_.layout().put(values, number, TiffField{tag, type, 1, 0}.value_bytes());
    place_value(entry, values);
    return entry;
  }

  /// Copies the strips or tiles of a page as they are.
  Entry copied_strips(const TiffDirectory& directory, const TiffField& offsets) {
    const std::uint16_t of_counts =
        offsets.tag == TIFFTAG_STRIPOFFSETS ? TIFFTAG_STRIPBYTECOUNTS : TIFFTAG_TILEBYTECOUNTS;
    const auto counts = std::ranges::find(directory.fields, of_counts, &TiffField::tag);
    if (counts == directory.fields.end() || counts->count != offsets.count)
      throw NoPlainForm{"a page of it does not say where it ends"};
    const std::vector<std::uint64_t> from = old_.numbers(offsets), bytes = old_.numbers(*counts);
    std::vector<std::uint64_t> places;
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (bytes[i] > old_.size() || from[i] > old_.size() - bytes[i])
        throw NoPlainForm{"a page of it lies beyond its end"};
      if (bytes[i] > 0) new_.align();
      places.push_back(bytes[i] > 0 ? new_.size() : 0);
      new_.copy(from[i], bytes[i]);
    }
    return entry_of(offsets.tag, type_of_places(), places);
  }

  /// Says how the samples of a slice are stored.
  void describe(const PlainPage& plain, std::vector<Entry>& entries) {
    const TiffPage& page = *plain.page;
    const auto set = [&](std::uint16_t tag, std::uint16_t type, std::uint64_t value) {
      std::erase_if(entries, [&](const Entry& entry) { return entry.tag == tag; });
      entries.push_back(entry_of(tag, type, {value}));
    };
    if (page.packed_bits != 0) set(TIFFTAG_BITSPERSAMPLE, type_short, 8 * size_of(page.type));
    set(TIFFTAG_COMPRESSION, type_short, COMPRESSION_NONE);
    set(TIFFTAG_STRIPOFFSETS, type_of_places(), plain.at);
    set(TIFFTAG_ROWSPERSTRIP, type_long, page.height);
    set(TIFFTAG_STRIPBYTECOUNTS, type_of_places(), page.bytes());
  }

  /// Writes a directory. Returns where the place of the next one belongs.
  NewFile::Later write(const std::vector<Entry>& entries) {
    const TiffLayout& layout = new_.layout();
    std::string bytes;
    layout.put(bytes, entries.size(), layout.is_big ? 8 : 2);
    for (const Entry& entry : entries) {
      layout.put(bytes, entry.tag, 2);
      layout.put(bytes, entry.type, 2);
      layout.put(bytes, entry.count, layout.place_bytes());
      bytes += entry.value;
    }
    new_.give(bytes);
    return new_.give_later();
  }

  const TiffDirectories old_;
  NewFile new_;
  std::map<std::uint64_t, PlainPage> slices_;  ///< by the places of their directories
  std::size_t seen_slices_ = 0;
  std::set<std::uint64_t> begun_;                  ///< directories of the old file
  std::map<std::uint64_t, std::uint64_t> copies_;  ///< and their places in the new one
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t>
      long_values_;  ///< the same, by place and size
  std::uint64_t samples_at_ = 0;
};

}  // namespace

ReaderPlainFile plain_tiff_file(const std::string& path, std::size_t number,
                                const std::vector<const TiffPage*>& pages, std::uint64_t& samples_at) {
  ReaderPlainFile plain;
  try {
    PlainTiff tiff(path, number, pages);
    samples_at = tiff.samples_at();
    plain.pieces = tiff.pieces();
  } catch (const NoPlainForm& none) {
    plain.why_not = none.why;
  }
  return plain;
}

}  // namespace tagrid
