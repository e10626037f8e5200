#include "tools/report/damage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/parity/parity.h"
#include "io/tag/blocks.h"
#include "io/tag/bricks.h"
#include "io/tag/header.h"
#include "io/tag/pages.h"
#include "io/tag/whole_bricks.h"
#include "io/text/addresses.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

bool has_footer(const ByteSource& file) {
  std::uint64_t start = 0;
  return file.size() >= footer_size &&
         find_file_end(bytes_at(file, file.size() - footer_size, footer_size), start).ok() &&
         start < file.size();
}

/// Parity that `repair` can read. That it cannot be read is less important than the damage.
bool is_protected(const std::string& input) {
  try {
    return input != "-" && !is_address(input) && has_parity(input);
  } catch (const WorldError&) {
    return false;
  }
}

std::string with_repair(const std::string& words, const std::string& input) {
  return fmt::format("{}; {} rebuilds what is damaged, if its parity is sufficient", words,
                     repair_command(input));
}

/// Nothing of a file of which not even the header is intact.
std::optional<WholeBricks> remains_of(const std::string& input) {
  if (!is_regular_input(input)) return std::nullopt;
  try {
    return std::optional<WholeBricks>(std::in_place, open_source(input));
  } catch (const Error&) {
    return std::nullopt;
  }
}

bool has_intact_bricks(const WholeBricks& file, std::int64_t volume) {
  if (volume == 0) return file.whole_count() > 0;
  try {
    return WholeBricks(file.volume(volume)).whole_count() > 0;
  } catch (const Error&) {
    return false;
  }
}

std::string salvage_advice(const WholeBricks& file, const std::string& input,
                           std::optional<std::int64_t> volume) {
  if (file.lost().empty() && !file.is_damaged_elsewhere()) return "";
  const std::int64_t volumes = file.header().volumes, end = volume ? *volume + 1 : volumes;
  for (std::int64_t number = volume.value_or(0); number < end; ++number)
    if (has_intact_bricks(file, number))
      return fmt::format("; tagrid decode {} --salvage{} decodes the intact bricks{}", word_of_command(input),
                         volumes > 1 ? fmt::format(" --volume {}", number) : "",
                         volumes > 1 && !volume ? " of one volume" : "");
  return "";
}

}  // namespace

bool file_begins_as_tag(const ByteSource& file) {
  return begins_as_tag(bytes_at(file, 0, std::min<std::uint64_t>(file.size(), tag_preamble_size)));
}

std::string words_of_damage(const std::string& input, const BrokenInput& broken) {
  if (broken.detail().problem != Problem::unknown_beginning || !is_regular_input(input))
    return words_of(broken);
  const auto file = open_source(input);
  // Otherwise another volume in it begins wrongly.
  if (file_begins_as_tag(*file) || !(is_protected(input) || has_footer(*file))) return words_of(broken);
  return fmt::format("{}: the beginning of this .tag file is damaged, without which nothing can be decoded",
                     shown_input(input));
}

std::string word_of_command(std::string_view path) {
  const std::string word = (path.starts_with('-') ? "./" : "") + std::string(path);
  const auto is_plain = [](char c) {
    return static_cast<unsigned char>(c) > 0x7F || std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_@%+=:,./-").find(c) != std::string_view::npos;
  };
  if (is_windows) return std::ranges::all_of(word, is_plain) ? word : fmt::format("\"{}\"", word);
  // Within $'...', shells read the escapes of printable().
  const bool is_printable = printable(word) == word;
  if (is_printable && !word.empty() && std::ranges::all_of(word, is_plain)) return word;
  std::string quoted;
  for (const char c : word) {
    if (c == '\'')
      quoted += is_printable ? R"('\'')" : R"(\')";
    else if (c == '\\' && !is_printable)
      quoted += R"(\\)";
    else
      quoted += c;
  }
  return fmt::format("{}'{}'", is_printable ? "" : "$", printable(quoted));
}

std::string repair_command(const std::string& input) {
  return fmt::format("tagrid repair {} -o OUT", word_of_command(input));
}

std::string words_with_repair(const std::string& input, const BrokenInput& broken) {
  const std::string words = words_of_damage(input, broken);
  const bool is_repairable = !is_newer_format(broken) && is_regular_input(input) && is_protected(input);
  return is_repairable ? with_repair(words, input) : words;
}

std::string salvage_advice(const std::string& input, std::optional<std::int64_t> volume) {
  const std::optional<WholeBricks> file = remains_of(input);
  return file ? salvage_advice(*file, input, volume) : "";
}

std::string words_with_salvage(const std::string& input, const BrokenInput& broken,
                               std::optional<std::int64_t> volume) {
  const std::optional<WholeBricks> file = remains_of(input);
  if (!file || is_newer_format(broken)) return words_with_repair(input, broken);
  const std::string words = words_of_damage(input, broken);
  return (file->has_parity() || is_protected(input) ? with_repair(words, input) : words) +
         salvage_advice(*file, input, volume);
}

namespace {

constexpr std::size_t most_lines = 50;

std::string region_of(const Box& box) {
  return fmt::format("{}:{},{}:{},{}:{}", box.low.x, box.high.x + 1, box.low.y, box.high.y + 1, box.low.z,
                     box.high.z + 1);
}

}  // namespace

std::vector<std::string> lines_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks) {
  std::vector<std::string> lines;
  for (const BrickRun& run : lost) {
    if (lines.size() == most_lines) {
      lines.push_back(fmt::format("and {} more places", lost.size() - most_lines));
      break;
    }
    std::string regions;
    for (const Box& box : boxes_of(run, bricks)) regions += (regions.empty() ? "" : " and ") + region_of(box);
    lines.push_back(
        run.first == run.last
            ? fmt::format("brick {} is damaged or missing: region {}", run.first, regions)
            : fmt::format("bricks {} to {} are damaged or missing: region {}", run.first, run.last, regions));
  }
  return lines;
}

nlohmann::ordered_json json_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks) {
  auto list = nlohmann::ordered_json::array();
  for (const BrickRun& run : lost)
    for (const Box& box : boxes_of(run, bricks))
      list.push_back({{"low", {box.low.x, box.low.y, box.low.z}},
                      {"high", {box.high.x + 1, box.high.y + 1, box.high.z + 1}}});
  return list;
}

std::string count_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks) {
  const std::int64_t count =
      std::accumulate(lost.begin(), lost.end(), std::int64_t{0},
                      [](std::int64_t sum, const BrickRun& run) { return sum + run.last - run.first + 1; });
  return fmt::format("{} of {} bricks {} lost", count, bricks.count(), count == 1 ? "is" : "are");
}

}  // namespace tagrid
