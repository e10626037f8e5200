// The entries of a volume's description: comments, key-value pairs, and the fields of NRRD. Each is a line of
// text, which is kept as it was written. The format: https://teem.sourceforge.net/nrrd/format.html
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

struct MetadataEntry {
  enum class Kind : std::uint8_t { comment, pair, field };
  Kind kind = Kind::comment;
  /// Name of a field in lower case, in the standard's first spelling ("space origin"); empty for other entries.
  std::string_view field = {};
  /// The text after the colon of a field, without blanks around it; what follows ":=" in a pair, as it is
  /// written.
  std::string_view value = {};
  std::string_view key = {};   ///< of a pair
  std::string_view line = {};  ///< the entire line
};

/// Reads one line, without its line end, of an NRRD header. Throws BrokenInput if it is not one.
MetadataEntry entry_of_line(std::string_view line);

/// True if the field says how samples are stored, and so belongs to the file rather than to the volume.
bool is_storage_field(std::string_view field);

/// Entries in their order. Each is read once; its parts are found again by their places. Views end when the
/// entries change. Memory: 12 bytes an entry, and its text.
class MetadataEntries {
 public:
  class Iterator {
   public:
    using value_type = MetadataEntry;
    using difference_type = std::ptrdiff_t;
    Iterator() = default;
    Iterator(const MetadataEntries& all, std::size_t number) : all_(&all), number_(number) {}
    MetadataEntry operator*() const { return all_->entry(number_); }
    Iterator& operator++() {
      ++number_;
      return *this;
    }
    Iterator operator++(int) {
      const Iterator before = *this;
      ++number_;
      return before;
    }
    bool operator==(const Iterator& other) const { return number_ == other.number_; }

   private:
    const MetadataEntries* all_ = nullptr;
    std::size_t number_ = 0;
  };
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, places_.size()}; }
  bool empty() const { return places_.empty(); }

  /// The same entry as others have it.
  void add(const MetadataEntry& entry) { add_line(entry.line); }
  /// Throws BrokenInput if the field is not one of NRRD, or if the value does not fit into a line.
  void add_field(std::string_view field, std::string_view value);
  /// In the key, characters that could be taken for something else become '_'; in the text, line feeds and
  /// backslashes are escaped.
  void add_pair(std::string_view key, std::string_view text);
  /// A pair whose value is already written as MetadataEntry::value. Throws BrokenInput if the pair does not
  /// fit into a line.
  void add_written_pair(std::string_view key, std::string_view value);
  /// A line, without its line end. Throws as entry_of_line() does.
  void add_line(std::string_view line);

  /// All lines, each with '\n'.
  const std::string& text() const { return text_; }

  bool operator==(const MetadataEntries& other) const { return text_ == other.text_; }

 private:
  struct Place {
    std::uint32_t begin = 0;        ///< of the line
    std::uint32_t name_length = 0;  ///< of what stands before the colon
    MetadataEntry::Kind kind = MetadataEntry::Kind::comment;
    std::uint8_t field = 0;  ///< its number in the list of fields
  };
  MetadataEntry entry(std::size_t number) const;

  std::string text_;
  std::vector<Place> places_;
};

}  // namespace tagrid
