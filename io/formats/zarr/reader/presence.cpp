#include "io/formats/zarr/reader/presence.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

#include "io/programs/serve.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// "0", "12", but not "012".
std::optional<std::int64_t> number_of_chunk(std::string_view text) {
  std::int64_t number = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_plain = !text.empty() && text[0] != '-' && (text[0] != '0' || text.size() == 1);
  if (!is_plain || result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

/// How keys of chunks are made.
struct Rule {
  bool has_c = false;
  char separator = '/';
  bool operator==(const Rule&) const = default;
};

class Walk {
 public:
  Walk(const ZarrStore& store, const ZarrArray& array, ZarrPieces& pieces, const PieceBox& volume)
      : store_(store), array_(array), pieces_(pieces), volume_(volume) {
    for (std::size_t axis = 0; axis < array.shape.size(); ++axis) {
      const std::int64_t ratio = array.chunk[axis] / array.piece[axis];
      chunks_.first.push_back(volume.first[axis] / ratio);
      chunks_.end.push_back((volume.end[axis] - 1) / ratio + 1);
    }
  }

  ZarrPresence run() {
    store_.list(array_.path, [&](const std::string& name, bool is_folder) {
      say_working();
      if (!is_folder)
        look_at_file(name);
      else if (name == "c")
        folders_.push_back({{true, '/'}, joined(array_.path, name), {}});
      else
        add_folder({{false, '/'}, array_.path, {}}, name);
    });
    while (!folders_.empty()) {
      const Folder folder = std::move(folders_.back());
      folders_.pop_back();
      look_into(folder);
    }
    return found_;
  }

 private:
  /// A folder of chunks, whose first numbers are those of its path.
  struct Folder {
    Rule rule;
    std::string path;
    std::vector<std::int64_t> numbers;
  };

  Rule expected() const {
    // Without a separator, both rules are one.
    const bool has_separator = array_.shape.size() > 1 || !array_.first_of_keys.empty();
    return {!array_.first_of_keys.empty(), has_separator ? array_.separator : '.'};
  }

  /// "0.1.2" or "c.0.1.2".
  void look_at_file(const std::string& name) {
    std::vector<std::string_view> parts = split(name, '.');
    const bool has_c = parts.size() > 1 && parts[0] == "c";
    if (has_c) parts.erase(parts.begin());
    std::vector<std::int64_t> numbers;
    for (const std::string_view part : parts) {
      const auto number = number_of_chunk(part);
      if (!number || !is_of_volume(numbers.size(), *number)) return;
      numbers.push_back(*number);
    }
    if (numbers.size() == array_.shape.size()) add({has_c, '.'}, numbers, joined(array_.path, name));
  }

  void add_folder(Folder folder, const std::string& name) {
    const auto number = number_of_chunk(name);
    if (!number || folder.numbers.size() + 1 >= array_.shape.size() ||
        !is_of_volume(folder.numbers.size(), *number))
      return;
    folder.path = joined(folder.path, name);
    folder.numbers.push_back(*number);
    folders_.push_back(std::move(folder));
  }

  void look_into(const Folder& folder) {
    store_.list(folder.path, [&](const std::string& name, bool is_folder) {
      say_working();
      if (is_folder) return add_folder(folder, name);
      const auto number = number_of_chunk(name);
      if (!number || folder.numbers.size() + 1 != array_.shape.size() ||
          !is_of_volume(folder.numbers.size(), *number))
        return;
      std::vector<std::int64_t> numbers = folder.numbers;
      numbers.push_back(*number);
      add(folder.rule, numbers, joined(folder.path, name));
    });
  }

  bool is_of_volume(std::size_t axis, std::int64_t number) const {
    return axis < chunks_.first.size() && number >= chunks_.first[axis] && number < chunks_.end[axis];
  }

  void add(Rule rule, const std::vector<std::int64_t>& numbers, const std::string& key) {
    if (rule == expected()) {
      found_.written += pieces_.count(numbers, volume_);
    } else if (found_.other_key.empty() || key < found_.other_key) {  // whatever the order of the folder
      found_.other_key = key;
      found_.expected_key = array_.key(numbers);
    }
  }

  const ZarrStore& store_;
  const ZarrArray& array_;
  ZarrPieces& pieces_;
  const PieceBox& volume_;
  PieceBox chunks_;  ///< of the volume
  std::vector<Folder> folders_;
  ZarrPresence found_;
};

}  // namespace

ZarrPresence presence_of(const ZarrStore& store, const ZarrArray& array, ZarrPieces& pieces,
                         const PieceBox& volume) {
  return Walk(store, array, pieces, volume).run();
}

}  // namespace tagrid
