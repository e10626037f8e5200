#include "tools/archive/input_removal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>

#include "io/envelope/envelope.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/held_files.h"
#include "io/formats/table/open_volume.h"
#include "io/parity/parity.h"
#include "io/system/files.h"
#include "io/tag/bricks.h"
#include "io/text/addresses.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/found_lines.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& file, const std::string& why, const char* advice) {
  throw UsageError("{}: cannot be removed: {}; {}", file, why, advice);
}

void require_removable(const std::string& file, const char* advice) {
  if (file == "-") refuse("standard input", "it is not a regular file", advice);
  if (is_address(file)) refuse(file, "it is an address", advice);
  // If the file does not exist, opening it gives the message.
  if (!is_regular_output(file)) refuse(file, "it is not a regular file", advice);
  // Only the link would be removed.
  if (const auto status = status_of_name(file); status && status->is_link())
    refuse(file, "it is a symbolic link, and the file itself would stay", advice);
}

void require_file_as_output(const std::string& input, const std::string& output, const char* advice) {
  if (!is_regular_output(output)) refuse(input, "the output is not a regular file", advice);
}

/// Throws UsageError if one of the files cannot be removed, or if the output is not a file that stays.
void require_files(const std::string& input, const std::string& output, const char* advice) {
  require_removable(input, advice);
  require_file_as_output(input, output, advice);
}

/// Why a file of this format cannot replace any .tag file; "" if it may.
std::string lost_by_options(const Decoding& decoding) {
  const Format& format = decoding.format;
  if (!decoding.wanted.is_all()) return "a region or a step gives only a part of the volume";
  if (decoding.vdb.tolerance > 0)
    return "--vdb-tolerance changes samples, and only the .tag file has the original ones";
  if (format.name == "raw") return "samples without a header do not record their size and type";
  if (!format.reads.any() && format.reads.as.empty())
    return fmt::format("tagrid cannot read {} files, so it cannot verify the output", format.name);
  return "";
}

/// What this .tag file holds and the decoded file would not; "" if that is nothing.
std::string lost_of_content(const TagBricks& file, const Format& format, Numbers wanted) {
  const CodingParameters& parameters = file.parameters();
  if (file.sizes().envelope > 0)
    return "it keeps the source files, which a decoded volume does not replace; tagrid restore restores them";
  if (file.header().volumes > 1)
    return fmt::format("it holds {} volumes, which are not compared with a decoded file",
                       file.header().volumes);
  if (parameters.mode == FileMode::grid)
    return "it stores only the grid, which a decoded volume does not replace";
  if (parameters.mesh_error >= 0) return "its mesh has a bound, which a decoded volume does not keep";
  const WrittenNumbers numbers = written_numbers(format, wanted, file.header(), &file.index());
  if (numbers.are_values() && is_float_type(numbers.rule.to))
    return fmt::format("values are rounded to {}", name_of(numbers.rule.to));
  if (std::ranges::count(numbers.rule.slopes, 0.0) > 0)
    return "slices have the slope 0, so their values do not tell their samples";
  const VolumeInfo info = numbers.info(volume_info_of(file.header()));
  if (std::string lost = format.keeps.lost_rescale(info); !lost.empty()) return lost;
  if (const auto lost = losses(format, info); !lost.empty()) return lost.front();
  if (std::string lost = usual_losses(format, info); !lost.empty()) return lost;
  // losses() looks at the pairs of other formats one by one.
  if (!format.keeps.header && !format.keeps.slices_are_alike && !has_only_needed(info.metadata))
    return fmt::format("{} files have no place for all of its comments and key/value pairs", format.name);
  return "";
}

/// The other data sets of a file of which one was chosen: "/b, /c and 7 more"; "" if there are none.
std::string others_in_file(const std::string& input, SourceDescription source) {
  constexpr std::size_t most = 3;
  if (!source.dataset || is_folder(input)) return "";
  const fs::path own = path_of("/") / path_of(*source.dataset);
  source.dataset.reset();
  source.known = nullptr;
  std::vector<std::string> others;
  try {
    open_volume(input, source);
  } catch (const UsageError& error) {
    for (const Choice& choice : error.detail().choices)
      if (path_of("/") / path_of(choice.name) != own) others.push_back(choice.name);
  }
  const std::size_t shown = std::min(others.size(), most);
  const std::string more =
      others.size() > shown ? fmt::format(" and {} more", others.size() - shown) : std::string();
  return fmt::format(
      "{}{}", fmt::join(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(shown), ", "), more);
}

void require_untouched(const UnchangedFiles& files) {
  files.require_opened();
  if (const std::string file = files.touched(); !file.empty())
    throw BrokenInput(
        file + ": was changed, linked or given other permissions after it was verified; nothing is removed");
}

}  // namespace

void require_replaceable_tag(const std::string& input, const std::string& output, const Decoding& decoding) {
  const char* advice = "leave out --rm";
  if (const std::string lost = lost_by_options(decoding); !lost.empty())
    throw UsageError("--rm: {}; {}", lost, advice);
  require_files(input, output, advice);
  const TagBricks file(std::make_shared<FileSource>(input));
  if (const std::string lost = lost_of_content(file, decoding.format, decoding.numbers); !lost.empty())
    throw UsageError("{}: --rm: {}; {}", input, lost, advice);
}

void require_lasting_choice(const std::string& input, const SourceDescription& source) {
  const auto number = whole_number_of(source.series.value_or(""));
  if (!number || input == "-") return;
  if (!is_folder(input) && open_volume(input, source)->files().size() < 2) return;  // a file does not change
  SourceDescription any = source;
  any.series.reset();
  try {
    open_volume(input, any);
  } catch (const UsageError& error) {
    const std::vector<Choice>& choices = error.detail().choices;
    const bool is_name =
        std::ranges::any_of(choices, [&](const Choice& one) { return one.name == source.series; });
    if (is_name || *number < 1 || static_cast<std::size_t>(*number) > choices.size()) return;
    throw UsageError(
        "{}: {} is the number of a volume in a list that changes when files come or go; give its name "
        "instead: {}",
        input, *number, choices[static_cast<std::size_t>(*number) - 1].name);
  }
}

std::vector<std::string> removable_volume(const std::string& input, const SourceDescription& source,
                                          const std::string& output, OtherHeaders& headers,
                                          const char* advice) {
  const bool is_series = is_folder(input), is_file = is_regular_input(input);
  if (is_series)
    require_file_as_output(input, output, advice);
  else
    require_files(input, output, advice);
  if (is_directory_of_dicom(path_of(input)))
    refuse(input,
           "a DICOMDIR whose images are gone cannot be read, not even for its other series; encode the "
           "directories of its images instead",
           advice);
  require_lasting_choice(input, source);
  const auto volume = open_volume(input, source);
  const auto folder = is_series ? path_of(input) : path_of(input).parent_path();
  for (const std::string& file : volume->files()) {
    require_removable(file, advice);
    // A header is untrusted input. It must not choose files in other directories for removal, by any path.
    const auto from_there = relative_path(path_of(file), folder);
    if (from_there.empty() || *from_there.begin() == ".." || (from_there.has_parent_path() && !is_series))
      refuse(file, "it may be in a different directory than its header", advice);
    if (is_file)
      if (const std::string why = not_own_name(input, file); !why.empty()) refuse(file, why, advice);
  }
  if (const auto named = headers.first_named(volume->files()))
    refuse(named->file, "another header, " + named->header + ", also names it", advice);
  return volume->files();
}

void require_replaceable(const std::string& input, const Replacement& by, const char* advice) {
  if (by.max_error < 0)
    refuse(input, "nothing bounds the error of its encoding, so most voxels could not be restored", advice);
  if (by.max_error > 0 && !by.doubt.empty())
    refuse(input,
           fmt::format("its samples may mean something else, and a lossy encoding would destroy them: {}",
                       by.doubt),
           advice);
  if (by.max_error > 0 && by.headerless && !by.trusted)
    refuse(input,
           "it has no header, and if its type, byte order or dims differ from the command, a lossy encoding "
           "destroys it; compare the decoded volume with the original, then give --trust-description",
           fmt::format("or {}", advice).c_str());
}

void require_files_come_back(const std::string& input, const SourceDescription& source,
                             const SourceFacts& facts, bool keeps_files, const char* advice) {
  if (std::string why = source_files(facts).why_not_restorable(); !why.empty()) {
    if (const std::string others = others_in_file(input, source); !others.empty())
      why += fmt::format(" (the file also has {})", others);
    refuse(input, fmt::format("its files could not be restored byte for byte: {}", why), advice);
  }
  // Samples alone have names and a byte order, too.
  if (!keeps_files) refuse(input, "--strip drops its files, so they could not be restored", advice);
}

bool has_bound(const EncodeOptions& options) {
  return !options.grid_only || options.max_error || options.error_rule;
}

void refuse_without_bound(const EncodeOptions& options, const std::string& option) {
  if (has_bound(options)) return;
  throw UsageError(
      "{}: a grid without a bound cannot replace a volume, because most voxels could not be restored; {}, or "
      "leave out {}",
      option, options.max_level ? "give --max-error E instead of --max-level" : "give --max-error E", option);
}

void remove_replaced(const Removal& removal, const std::string& tag, const std::function<void()>& record) {
  const OutputLock lock(file_of_link(tag));
  require_untouched(removal.originals);
  require_untouched(removal.copy);
  if (record) record();
  for (const std::string& file : removal.files)
    if (!files().unlink(file)) throw world_error("cannot remove", file, errno);
}

}  // namespace tagrid
