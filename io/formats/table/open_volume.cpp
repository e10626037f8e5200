#include "io/formats/table/open_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/files/file_attributes.h"
#include "io/files/slice_files.h"
#include "io/formats/table/all_volumes.h"
#include "io/formats/table/formats.h"
#include "io/formats/table/other_formats.h"
#include "io/metadata/rescale.h"
#include "io/programs/find.h"
#include "io/programs/volumes.h"
#include "io/samples/file_samples.h"
#include "io/samples/slices_in_files.h"
#include "io/system/files.h"
#include "io/text/addresses.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "io/volume/series_of_files.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// How a volume will be read: by tagrid itself, or by a program.
struct Way {
  const Format* format = nullptr;  ///< nullptr: a program that somebody added
  std::string program;             ///< "": tagrid itself
};

Way way_of(const Format& format, const std::string& name) {
  if (format.reads.program.empty()) return {&format, ""};
  if (const auto program = find_reader(format.reads.program)) return {&format, *program};
  const bool has_files = format.reads.is_folder == nullptr && is_folder(name);
  throw WorldError("{}: {}, which tagrid-read-{} reads; that program is not installed {}", name,
                   has_files ? fmt::format("has {} files", format.help) : fmt::format("is {}", format.what),
                   format.reads.program, about_missing_program(format.reads.program));
}

Way way_named(const std::string& from, const std::string& name) {
  if (const Format* format = read_format_named(from)) return way_of(*format, name);
  if (const auto program = find_reader(from)) return {nullptr, *program};
  throw UsageError("{}: \"{}\" is not a format that can be read; known are {}", Setting{"from", "its format"},
                   from, fmt::format("{}", fmt::join(read_format_names(), ", ")));
}

/// What a volume is that a program reads.
std::string in_words(const Way& way) {
  return way.format != nullptr ? std::string(way.format->what) : "read by " + way.program;
}

ReaderOptions options_of(const SourceDescription& source) {
  ReaderOptions options;
  for (const auto& [name, value] :
       {std::pair("series", source.series), {"dataset", source.dataset}, {"grid", source.vdb_grid}})
    if (value) options.emplace(name, *value);
  if (source.gaps_ok) options.emplace("gaps-ok", "yes");
  return options;
}

/// A volume that a program reads. Its format is one whose files often lack a voxel size, or come
/// from instruments that should state one.
std::unique_ptr<VolumeSource> open_way(const Way& way, const std::string& path,
                                       const SourceDescription& source) {
  auto volume = open_with_reader(way.program, path, options_of(source), source.reader_memory);
  const bool has_units = way.format != nullptr && !way.format->has_grids;
  volume->set_missing_of_voxel_size(missing_of_voxel_size(volume->info().geometry(), has_units));
  return volume;
}

std::unique_ptr<VolumeSource> open_file(const std::string& path, const SourceDescription& source);

std::string known_formats() {
  std::vector<std::string_view> known;
  for (const Format& format : formats())
    if (format.reads.any() && format.reads.is_recognized()) known.push_back(format.what);
  const std::string_view last = known.back();
  known.pop_back();
  return fmt::format("{} or {}", fmt::join(known, ", "), last);
}

/// `path` without the extension of compression, and with another extension, in capitals if its own is.
fs::path beside(const std::string& path, std::string_view ending) {
  fs::path other = path_of(plain_name(path));
  const std::string own = text_of(other.extension());
  std::string wanted(ending);
  if (!own.empty() && own != lower_case(own))
    std::ranges::transform(wanted, wanted.begin(),
                           [](char c) { return c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c; });
  return other.replace_extension(path_of(wanted));
}

/// What to do about a file of samples whose header lies beside it; "" if none does.
std::string advice_of_header_beside(const std::string& path) {
  if (path == "-") return "";
  for (const std::string_view ending : {".mhd", ".nhdr", ".hdr", ".vgi", ".xtekct", ".info"}) {
    // That of a.vol is a.vol.info.
    const std::string header = ending == ".info" ? path + ".info" : text_of(beside(path, ending));
    if (const auto status = status_of(header); header == path || !status || !status->is_file()) continue;
    const Format* known = readable_format(header);
    if (known == nullptr) {
      FileBytes file(header);
      const std::string_view beginning = file.peek(most_bytes_of_others);
      if (const OtherFormat* other = other_format_of(beginning, header))
        return fmt::format("{} next to it {}", header, about_other_format(*other, beginning, {}).text);
      continue;
    }
    try {
      const auto volume = open_file(header, {});
      for (const std::string& file : volume->files())
        if (is_same_file(file, path)) return header + " describes its samples; give that file";
    } catch (const UsageError&) {
      return header + " describes its samples, of several volumes; give that file";
    } catch (const Error& error) {
      return fmt::format("{} next to it cannot be read: {}", header, error.what());
    }
  }
  return "";
}

/// What is wrong with a file whose extension belongs to a self-describing format; "" for other extensions.
std::string contradicts_its_name(const std::string& path) {
  const std::string name = lower_case(name_of_path(path));
  for (const Format& format : formats()) {
    const std::string_view what =
        format.reads.as.empty() ? format.what : read_format_named(format.reads.as)->what;
    const bool is_recognized = format.reads.is_recognized() || !format.reads.as.empty();
    for (const std::string_view ending : format.extensions)
      if (is_recognized && (format.reads.any() || !format.reads.as.empty()) && name.size() > ending.size() &&
          name.ends_with(ending))
        return fmt::format(
            "its name says that it is {}, but its content does not match; it may be truncated or damaged",
            what);
  }
  return "";
}

BrokenInput no_volume(FileBytes& file, const std::string& path) {
  const std::string_view beginning = file.peek(most_bytes_of_others);
  if (beginning.empty()) return BrokenInput(file.name() + ": is empty, so it is not a volume");
  if (const std::string advice = advice_of_header_beside(path); !advice.empty())
    return BrokenInput("{}: has no header of its own; {}", file.name(), advice);
  // Users know that a .nii.gz file is a gzip file.
  const bool says_gzip = lower_case(path).ends_with(".nii.gz");
  if (const OtherFormat* other = says_gzip ? nullptr : other_format_of(beginning, path))
    return BrokenInput(Sentence("{}: {}", file.name(), about_other_format(*other, beginning, file.size())),
                       {.problem = other->problem, .subject = file.name()});
  if (const std::string contradiction = contradicts_its_name(path); !contradiction.empty())
    return BrokenInput("{}: {}", file.name(), contradiction);
  if (const std::string ending = extension_of(plain_name(path)); ending == ".img")
    return BrokenInput(
        fmt::format("{}: has no header of its own; the header of a NIfTI pair would be {}, which is missing",
                    file.name(), text_of(beside(path, ".hdr"))),
        Problem::no_known_format);
  return BrokenInput(fmt::format("{}: not {}", file.name(), known_formats()), Problem::no_known_format);
}

/// The format that a program reads from files with the extension of `path`; nullptr if there is none, and for
/// files that are empty or begin as those of another known format do.
const Format* format_of_name(FileBytes& file, const std::string& path) {
  const std::string extension = extension_of(path);
  const auto found = std::ranges::find_if(formats(), [&](const Format& format) {
    return !format.reads.program.empty() &&
           std::ranges::find(format.extensions, extension) != format.extensions.end();
  });
  const std::string_view beginning = file.peek(most_bytes_of_others);
  if (found == formats().end() || beginning.empty()) return nullptr;
  const bool is_certain = begins_with_any(beginning, found->reads.named_magic);
  return is_certain || other_format_of(beginning, path) == nullptr ? &*found : nullptr;
}

/// The program that somebody added for files with the extension of `path`.
std::optional<std::string> reader_of_extension(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension.empty() ? std::nullopt : find_reader(extension.substr(1));
}

/// The format that the content of a file says, if it can be read; otherwise nullptr.
const Format* recognized(FileBytes& file) {
  if (const Format* format = format_of(file.peek(bytes_to_recognize()))) return format;
  if (!begins_gzip(file)) return nullptr;
  const Format* format = format_of(beginning_of_gzip(file, bytes_to_recognize()));
  return format != nullptr && format->reads.in_gzip ? format : nullptr;
}

Way way_of_file(FileBytes& file, const std::string& path, const SourceDescription& source) {
  if (source.from) return way_named(*source.from, file.name());
  const bool is_described = source.raw && source.raw->offset > 0;
  if (const Format* format = is_described ? nullptr : recognized(file)) return way_of(*format, file.name());
  if (source.raw) return {&format_named("raw"), ""};
  if (!file.peek(1).empty()) {
    if (const Format* format = format_of_name(file, path)) return way_of(*format, file.name());
    if (const auto program = reader_of_extension(path)) return {nullptr, *program};
  }
  throw no_volume(file, path);
}

/// Throws UsageError for a name that means another file, or none, to another program.
void require_name_for_all(const std::string& path, const Way& way) {
  const bool is_own = path == "/dev/stdin" || path.starts_with("/dev/fd/") || path.starts_with("/proc/self/");
  if (is_own)
    throw UsageError(
        "{}: is {}, which a separate program reads; to that program, this name means something else; give "
        "the name of the file itself",
        path, in_words(way));
}

std::unique_ptr<VolumeSource> open_file(const std::string& path, const SourceDescription& source) try {
  auto file = std::make_unique<FileBytes>(path);
  const Way way = way_of_file(*file, path, source);
  if (source.vdb_grid && (way.format == nullptr || !way.format->has_grids))
    throw UsageError(file->name() + ": is not an OpenVDB file", Problem::not_openvdb);
  if (way.program.empty()) {
    if (way.format->name == "raw" && !source.raw)
      throw UsageError("{}: samples without a header need {} and {}", file->name(),
                       Setting{"dims", "their size"}, Setting{"type", "their type"});
    if ((source.series && !way.format->reads.has_series) || source.dataset)
      throw UsageError("{}: is one volume; leave out {}", file->name(),
                       source.dataset ? Setting{"dataset", "the data set"} : Setting{"series", "the series"});
    if (!source.raw || way.format->reads.takes_description)
      return way.format->reads.open(std::move(file), path, source);
  }
  if (source.raw)
    throw UsageError(fmt::format("{}: is {}", file->name(), in_words(way)), Problem::describes_itself);
  if (path == "-" || !file->size())
    throw UsageError("{}: is {}, which can only be read from a file; save it to one first", file->name(),
                     in_words(way));
  require_name_for_all(path, way);
  file.reset();
  return open_way(way, path, source);
} catch (const WrongSize& wrong) {
  const OtherFormat* other = other_format_of(wrong.beginning, path);
  if (other == nullptr) throw;
  const auto status = source.raw ? status_of(path) : std::nullopt;
  const Sentence about =
      about_other_format(*other, wrong.beginning, status ? std::optional(status->size) : std::nullopt);
  throw BrokenInput(Sentence("{}; it {}", wrong.what(), about), other->problem);
}

bool has_folders(const std::string& folder) {
  std::vector<FolderEntry> entries;
  files().list(folder, entries);
  return std::ranges::any_of(entries, [&](const FolderEntry& entry) {
    return !entry.name.starts_with('.') && is_folder(folder, entry);
  });
}

BrokenInput no_files_in(const std::string& folder) {
  if (!has_folders(folder)) return BrokenInput(folder + ": is an empty directory");
  return BrokenInput(folder + ": has no files, only directories",
                     {.problem = Problem::volumes_below, .subject = folder});
}

/// The error for a directory whose first files are not slices. `first` is one of them.
BrokenInput no_slices_in(const std::string& folder, const std::string& first) {
  if (status_of(first)) {
    FileBytes file(first);
    const std::string_view beginning = file.peek(most_bytes_of_others);
    if (const OtherFormat* other = other_format_of(beginning, first);
        other && other->problem == Problem::none)
      return BrokenInput(Sentence("{}: is a directory, and {} in it {}; {}", folder, name_of_path(first),
                                  other->what, other->advice),
                         {.problem = Problem::volumes_below, .subject = folder});
  }
  std::string known;
  for (const Format& format : formats())
    if (format.reads.has_folders) known += fmt::format("{}{}", known.empty() ? "" : " or ", format.help);
  return BrokenInput(
      Sentence("{}: is a directory, but its first files are not slices of {}; give a file or a directory of "
               "slices",
               folder, known),
      {.problem = Problem::volumes_below, .subject = folder});
}

/// The format of slices among files; nullptr if there are none.
const Format* format_of_slices(const std::vector<std::string>& files) {
  const Format* pictures = nullptr;
  for (const std::string& file : files) {
    const Format* format = status_of(file) ? readable_format(file) : nullptr;
    if (format == nullptr || !format->reads.has_folders) continue;
    if (!format->reads.are_often_pictures) return format;
    pictures = format;
  }
  return pictures;
}

/// The first files of a directory, as there may be very many.
std::vector<std::string> first_files(const std::string& folder) {
  constexpr std::size_t most_looks = 100;
  std::vector<std::string> files = visible_files(folder);
  if (files.size() > most_looks) files.resize(most_looks);
  return files;
}

/// The format of which a directory holds files.
Way way_of_folder(const std::string& folder, const SourceDescription& source) {
  if (source.from) return way_named(*source.from, folder);
  if (const Format* format = format_of_folder(folder)) return way_of(*format, folder);
  const std::vector<std::string> files = first_files(folder);
  if (files.empty()) throw no_files_in(folder);
  if (const Format* format = format_of_slices(files)) return way_of(*format, folder);
  // What is kept beside slices, such as notes, may be all that is left of them.
  if (const auto dead = std::ranges::find_if(files, is_dead_link); dead != files.end())
    throw dead_link(*dead);
  throw no_slices_in(folder, files.front());
}

/// A store without a volume, beside whose description slices lie. Both may have got into the directory by chance.
[[noreturn]] void rethrow_with_slices(const std::string& folder, const BrokenInput& error) {
  const Format* slices = format_of_slices(first_files(folder));
  if (slices == nullptr) throw;
  throw BrokenInput(Sentence("{}; if the slices of {} beside it are meant, give {} {}", error.what(),
                             slices->help, Setting{"from", "their format"}, slices->name),
                    error.detail().problem);
}

std::unique_ptr<VolumeSource> open_folder(const std::string& folder, const SourceDescription& source) {
  if (source.raw) return open_raw_directory(folder, source);
  const Way way = way_of_folder(folder, source);
  if (way.program.empty() && way.format->reads.open_folder != nullptr) {
    if (source.dataset)
      throw UsageError("{}: is one volume; leave out {}", folder, Setting{"dataset", "the data set"});
    return way.format->reads.open_folder(folder, source);
  }
  if (way.program.empty() ||
      (way.format != nullptr && !way.format->reads.has_folders && way.format->reads.is_folder == nullptr))
    throw UsageError("{}: is a directory, not {}", folder, way.format->what);
  require_name_for_all(folder, way);
  try {
    return open_way(way, folder, source);
  } catch (const BrokenInput& error) {
    if (source.from || way.format == nullptr || way.format->reads.is_folder == nullptr) throw;
    rethrow_with_slices(folder, error);
  }
}

std::unique_ptr<VolumeSource> open_one(const std::string& path, const SourceDescription& source) {
  return is_folder(path) ? open_folder(path, source) : open_file(path, source);
}

/// All volumes of a file. Readers that give one at a time list them.
std::unique_ptr<VolumeSource> open_all(const std::string& path, SourceDescription source) {
  source.series.reset();
  source.all_volumes = true;
  if (is_folder(path) && format_of_folder(path) == nullptr)
    throw UsageError("{}: is a directory, whose volumes are files of their own; choose one with {}", path,
                     Setting{"series", "its name"});
  try {
    return open_one(path, source);
  } catch (const UsageError& error) {
    std::vector<std::string> names;
    for (const Choice& choice : error.detail().choices) names.push_back(choice.name);
    if (error.detail().option != "series" || names.size() < 2 || names.size() > most_volumes) throw;
    return all_volumes(path, names, [path, source](const std::string& name) {
      SourceDescription one = source;
      one.series = name;
      return open_one(path, one);
    });
  }
}

/// A .tag file tells of the doubts of its source, and so do volumes that are decoded from it.
void keep_doubts(VolumeSource& volume, const std::string& path) {
  const SourceFacts& facts = volume.facts();
  Metadata metadata = facts.info.metadata;
  std::string scale_doubt = facts.scale_doubt;
  if (const std::string kept = metadata.text_of(scale_doubt_key); scale_doubt.empty() && !kept.empty())
    scale_doubt = fmt::format("{}: {}", volume.name(), kept);
  std::vector<std::string> not_understood = facts.not_understood;
  if (const std::string kept = metadata.text_of(not_understood_key); not_understood.empty() && !kept.empty())
    not_understood = {fmt::format("{}: {}", volume.name(), kept)};
  if (!facts.scale_doubt.empty() || !facts.not_understood.empty()) {
    std::vector<std::string> files = volume.files();
    files.push_back(path);
    add_doubts(facts.scale_doubt, facts.not_understood,
               names_of_source({path, files.front(), volume.name()}, files), metadata);
  }
  volume.set_metadata(std::move(metadata));
  volume.set_doubts(std::move(scale_doubt), std::move(not_understood));
}

}  // namespace

const Format* readable_format(const std::string& path) {
  FileBytes file(path);
  const Format* format = recognized(file);
  return format != nullptr ? format : format_of_name(file, path);
}

std::unique_ptr<VolumeSource> open_volume(const std::string& path, const SourceDescription& source) {
  if (is_address(path))
    throw UsageError(shown_address(path) +
                     ": is an address, and only .tag files are read from servers; download it first");
  if (source.known && source.known->files.are_untouched()) return placed_samples_again(source.known->facts);
  auto volume = source.series == every_volume ? open_all(path, source) : open_one(path, source);
  volume->set_name(path);
  if (source.spacing) give_spacing(*volume, *source.spacing);
  if (source.spacing && !volume->facts().missing_of_voxel_size.empty())
    volume->set_missing_of_voxel_size(missing_of_voxel_size(volume->info().geometry(), true));
  keep_doubts(*volume, path);
  return volume;
}

std::shared_ptr<const KnownVolume> known_volume(const VolumeSource& volume, std::time_t opened) {
  const SourceFacts& facts = volume.facts();
  if (!facts.opened || facts.places.empty() || facts.opened->paths() != facts.files) return nullptr;
  UnchangedFiles files(facts.files);
  if (files.last_change() + doubt_of_times >= opened) return nullptr;
  return std::make_shared<const KnownVolume>(KnownVolume{facts, std::move(files)});
}

std::unique_ptr<VolumeSource> open_raw_directory(const std::string& folder, const SourceDescription& source) {
  const RawDescription& raw = *source.raw;
  NumberedFiles files = chosen_series(folder, visible_files(folder), source);
  const auto count = static_cast<std::int64_t>(files.paths.size());
  if (!sample_bytes(raw.dims, raw.type) || raw.dims.z % count != 0)
    throw BrokenInput("{}: {} files cannot have equal parts of {}{}", folder, count,
                      described(raw.dims, raw.type), files.gap ? "; " + gap_in_words(files) : "");
  // Checked last: if the parts are unequal, accepting gaps does not help.
  require_no_gap(folder, files, source);
  const std::int64_t slices = raw.dims.z / count;
  const std::uint64_t slice = *sample_bytes({raw.dims.x, raw.dims.y, 1}, raw.type);
  std::vector<SliceRun> runs;
  for (std::size_t i = 0; i < files.paths.size(); ++i) {
    const auto status = status_of(files.paths[i]);
    const std::uint64_t wanted = raw.offset + slice * static_cast<std::uint64_t>(slices);
    if (status && status->size != wanted)
      throw BrokenInput("{}: has {} bytes, but {} are expected ({} of {} slices)", files.paths[i],
                        status->size, wanted, slices, described(raw.dims, raw.type));
    runs.push_back({i, raw.offset, slices, slice, raw.big_endian.value_or(false)});
  }
  std::vector<std::string> warnings;
  if (files.gap) warnings.push_back(fmt::format("{}: {}", folder, gap_in_words(files)));
  SourceFacts facts;
  facts.info = {raw.dims, raw.type};
  facts.files = std::move(files.paths);
  facts.warnings = std::move(warnings);
  facts.holds_other_bytes = raw.offset > 0;
  facts.headerless = true;
  return placed_samples(std::move(facts), std::move(runs));
}

}  // namespace tagrid
