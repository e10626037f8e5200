#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>

#include "io/bytes/little_endian.h"
#include "io/envelope/envelope.h"
#include "io/envelope/plain_bytes.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/samples/stored_bits.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// The names of the files in the deepest folder that has them all.
std::vector<std::string> names_in_common_folder(const std::vector<std::string>& paths) {
  std::vector<std::string> names;  // full paths at first; a std::filesystem::path takes ten times the memory
  for (const std::string& path : paths) names.push_back(text_of(normal_path(absolute_path(path_of(path)))));
  std::string_view common = names.front();
  for (const std::string& name : names)
    common =
        common.substr(0, static_cast<std::size_t>(std::ranges::mismatch(common, name).in1 - common.begin()));
  const std::size_t begin = common.rfind('/') + 1;
  for (std::string& name : names) name.erase(0, begin);
  return names;
}

/// The files of a source whose samples lie plainly in them.
PlainForm as_it_is(const SourceFacts& facts, OpenFiles& files) {
  PlainForm form;
  for (std::size_t i = 0; i < facts.files.size(); ++i)
    form.files.push_back({facts.files[i], false, {PlainPiece::stretch(i, 0, files.file(i)->size())}});
  form.places = facts.places;
  return form;
}

/// True if a file of a plain form is a file of the source, from its first byte to its last.
bool is_as_it_is(OpenFiles& files, const PlainFile& file) {
  if (file.is_changed || file.pieces.size() != 1) return false;
  const PlainPiece& piece = file.pieces.front();
  return piece.kind == PlainPiece::Kind::stretch && files.paths()[piece.file] == file.path &&
         piece.offset == 0 && piece.size == files.file(piece.file)->size();
}

std::vector<std::string> paths_of(const PlainForm& form) {
  std::vector<std::string> paths;
  for (const PlainFile& file : form.files) paths.push_back(file.path);
  return paths;
}

/// The nearest number that the bits can hold. Only an encoding with an error makes others.
template <class Bits>
Bits nearest(Bits integer, const BitsThatCount<Bits>& bits, bool is_signed) {
  const auto low = static_cast<Bits>(is_signed ? -bits.sign : 0),
             high = static_cast<Bits>(is_signed ? bits.sign - 1 : bits.used);
  if (static_cast<Bits>(integer - low) <= bits.used) return integer;
  return static_cast<Bits>(integer - high) < static_cast<Bits>(low - integer) ? high : low;
}

}  // namespace

void for_each_stretch(
    const EnvelopeFile& file, const SampleShape& shape,
    const std::function<void(std::uint64_t begin, std::uint64_t end, const SlicesInFile* slices)>& use) {
  std::uint64_t position = 0;
  const auto use_samples = [&](std::uint64_t begin, std::uint64_t bytes, const SlicesInFile& slices) {
    if (begin > position) use(position, begin, nullptr);
    position = begin + bytes;
    use(begin, position, &slices);
  };
  const SliceRows rows = shape.rows();
  for (const SlicesInFile& slices : file.slices) {
    const SliceRun& run = slices.run;
    const bool has_gaps = run.row_step > rows.bytes;  // between rows
    if (!has_gaps && run.step == shape.slice_bytes()) {
      use_samples(run.offset, shape.slice_bytes() * static_cast<std::uint64_t>(run.slices), slices);
      continue;
    }
    for (std::int64_t i = 0; i < run.slices; ++i) {
      const std::uint64_t begin = run.offset + static_cast<std::uint64_t>(i) * run.step;
      if (!has_gaps) use_samples(begin, shape.slice_bytes(), slices);
      for (std::int64_t row = 0; has_gaps && row < rows.count; ++row)
        use_samples(begin + static_cast<std::uint64_t>(row) * run.row_step, rows.bytes, slices);
    }
  }
  if (file.size > position) use(position, file.size, nullptr);
}

void to_stored(const SlicesInFile& slices, SampleType type, std::byte* samples, std::size_t count) {
  const StoredBits& stored = slices.run.stored;
  if (!stored.changes_nothing())
    with_bits_of(size_of(type), [&]<class Bits>(Bits) {
      const BitsThatCount<Bits> bits(stored);
      const auto add = static_cast<Bits>(stored.add);
      change_each<Bits>({samples, count * sizeof(Bits)}, [&](Bits sample) {
        auto integer = static_cast<Bits>(sample - add);
        if (bits.sign != 0) integer = nearest(integer, bits, stored.is_signed);
        return slices.spare == SpareBits::sign ? bits.with_sign(integer) : bits.low(integer);
      });
    });
  swap_if_not_native(samples, count, size_of(type), slices.run.big_endian);
}

std::string change_of_restoring(const std::string& compression) {
  return compression == "chunks"
             ? "its samples are in chunks, and come back contiguous"
             : fmt::format("its samples are compressed ({}), and come back uncompressed", compression);
}

std::string SourceFiles::why_not_restorable() const {
  return !why_not && !compression.empty() ? change_of_restoring(compression) : why_not.value_or("");
}

namespace {

/// Takes names, sizes and pieces of the files. Returns why the files are not kept; nothing if they are.
std::optional<std::string> take_files(PlainForm& form, SourceFiles& source) {
  source.names = names_in_common_folder(paths_of(form));
  const std::vector<std::string>& names = source.names;
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    return "two of its files would have the same name";
  source.files.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!is_relative_name(names[i])) return fmt::format("{} cannot be a name", names[i]);
    source.files[i].name = names[i];
    // Whoever made the form may be wrong: it is compared with the file.
    source.files[i].is_changed = !is_as_it_is(*source.opened, form.files[i]);
    source.pieces.push_back(std::move(form.files[i].pieces));
    source.files[i].size = PlainBytes(source.pieces[i], *source.opened).size();
  }
  return std::nullopt;
}

void note_compression(const SourceFacts& facts, const PlainForm& form, SourceFiles& source) {
  bool is_changed = std::ranges::any_of(source.files, &EnvelopeFile::is_changed);
  // Samples that were not read at these places may be others than those that lie there.
  if (facts.places.empty() && !is_changed)
    for (const SliceRun& run : form.places) is_changed = source.files[run.file].is_changed = true;
  source.compression = !is_changed                ? ""
                       : form.compression.empty() ? "in an unknown way"
                                                  : form.compression.substr(0, longest_compression_name);
}

/// Gives each file its slices, in the order of their places. Returns why they cannot be; nothing if they can.
std::optional<std::string> place_slices(const PlainForm& form, SourceFiles& source) {
  const SliceRows rows = source.shape.rows();
  std::int64_t z = 0;
  for (SliceRun run : form.places) {
    EnvelopeFile& file = source.files[run.file];
    run.file = 0;
    if (run.slices == 1) run.step = span_of_slice(run, rows).value_or(source.shape.slice_bytes());
    file.slices.push_back({z, run});
    z += run.slices;
  }
  for (EnvelopeFile& file : source.files) {
    std::ranges::sort(file.slices, {}, [](const SlicesInFile& slices) { return slices.run.offset; });
    std::uint64_t end = 0;
    for (const auto& [first, run, spare] : file.slices) {
      const auto span = span_of_slice(run, rows), end_of_slices = end_of_run(run, rows);
      if (run.offset < end || !span || !end_of_slices || run.step < *span)
        return "two of its slices lie at the same place";
      end = *end_of_slices;
    }
    if (end > file.size) return fmt::format("{} has become shorter", file.name);
  }
  return std::nullopt;
}

/// Why what surrounds the slices is not kept; nothing if it is.
std::optional<std::string> why_others_are_not_kept(const SourceFiles& source) {
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < source.files.size(); ++i) {
    all += source.files[i].size;
    PlainBytes bytes(source.pieces[i], *source.opened);
    bool has_bytes = true;
    if (!bytes.is_complete())
      for_each_stretch(source.files[i], source.shape, [&](auto begin, auto end, const auto* slices) {
        has_bytes = has_bytes && (slices != nullptr || bytes.has_bytes(begin, end));
      });
    if (!has_bytes)
      return fmt::format("{} has samples of other volumes, which are compressed", source.names[i]);
  }
  if (source.files.size() > most_files(source.shape))
    return fmt::format("it has {} files, of which most have no slice", source.files.size());
  // Other volumes of a file would be kept with each of them.
  const std::uint64_t others = all - source.shape.bytes();
  const std::uint64_t most = most_other_bytes(source.shape, source.files.size());
  if (others <= most) return std::nullopt;
  return fmt::format("its files have {} bytes besides these samples, more than the {} that are kept", others,
                     most);
}

/// Fills in all but `why_not`, and returns that.
std::optional<std::string> fill_in(const SourceFacts& facts, SourceFiles& source) {
  if (!is_file_or_folder(facts.files.front()) || !is_file_or_folder(facts.files.back()))
    return "it came through a pipe";
  source.names = names_in_common_folder(facts.files);
  if (facts.places.empty() && !facts.plain_form) return "its samples are compressed, or stored in pieces";
  PlainForm form = facts.places.empty() ? facts.plain_form() : as_it_is(facts, *source.opened);
  source.warnings = form.warnings;
  if (form.why_not) return form.why_not;
  if (auto why = take_files(form, source)) return why;
  note_compression(facts, form, source);
  if (auto why = place_slices(form, source)) return why;
  return why_others_are_not_kept(source);
}

}  // namespace

SourceFiles source_files(const SourceFacts& facts) {
  SourceFiles source;
  source.shape = {facts.info.dims, facts.info.type};
  const bool are_shared = facts.opened && facts.opened->paths() == facts.files;
  source.opened = are_shared ? facts.opened : std::make_shared<OpenFiles>(facts.files);
  source.why_not = fill_in(facts, source);
  if (source.why_not) source.files.clear();
  return source;
}

}  // namespace tagrid
