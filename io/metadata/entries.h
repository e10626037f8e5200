// The entries of a volume's description: comments, key-value pairs, and the fields of NRRD. Each is a line of
// text, which is kept as it was written. The format: https://teem.sourceforge.net/nrrd/format.html
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

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

/// Entries in their order. Each is taken apart when it is its turn: the lines of a hostile header take no memory
/// besides their text. Views end when the entries change.
class MetadataEntries {
 public:
  class Iterator {
   public:
    using value_type = MetadataEntry;
    using difference_type = std::ptrdiff_t;
    Iterator() = default;
    explicit Iterator(std::string_view rest) : rest_(rest) {}
    MetadataEntry operator*() const { return entry_of_line(line()); }
    Iterator& operator++() {
      rest_.remove_prefix(line().size() + 1);
      return *this;
    }
    Iterator operator++(int) {
      const Iterator before = *this;
      ++*this;
      return before;
    }
    bool operator==(const Iterator& other) const { return rest_.size() == other.rest_.size(); }

   private:
    std::string_view line() const { return rest_.substr(0, rest_.find('\n')); }

    std::string_view rest_;
  };
  Iterator begin() const { return Iterator(text_); }
  Iterator end() const { return Iterator(std::string_view()); }
  bool empty() const { return text_.empty(); }

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
  std::string text_;
};

}  // namespace tagrid
