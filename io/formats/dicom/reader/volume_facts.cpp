#include "io/formats/dicom/reader/volume_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "io/errors/errors.h"
#include "io/formats/dicom/reader/decoder.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/programs/stored_samples.h"
#include "io/programs/words.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;

struct Said {
  const DicomNote* note;
  const DicomFile* first;
  std::size_t files;
};

/// The 16-bit type that holds the values of all slices; nothing if there is none, or if they are not such
/// integers.
std::optional<SampleType> type_of_values(const std::vector<DicomSlice>& slices, const Files& files) {
  double least = 0, most = 0;
  for (const DicomSlice& slice : slices) {
    const DicomPixels& pixels = files[slice.file].pixels;
    const Rescale& rescale = frame_of(files, slice).rescale;
    if (pixels.allocated != 16 || rescale.slope != 1 || rescale.intercept != std::round(rescale.intercept) ||
        std::abs(rescale.intercept) > 65536)
      return std::nullopt;
    const double span = std::exp2(pixels.stored);
    const double low = pixels.is_signed ? -span / 2 : 0;
    least = std::min(least, low + rescale.intercept);
    most = std::max(most, low + span - 1 + rescale.intercept);
  }
  if (least >= -32768 && most <= 32767) return SampleType::int16;
  if (least >= 0 && most <= 65535) return SampleType::uint16;
  return std::nullopt;
}

/// "1 1 2.5 ...", one number a slice.
template <class Number>
std::string one_a_slice(const std::vector<DicomSlice>& slices, Number number) {
  std::string text;
  for (const DicomSlice& slice : slices) text += fmt::format("{}{}", text.empty() ? "" : " ", number(slice));
  return text;
}

}  // namespace

std::vector<std::string> said_of(const std::vector<DicomFile>& files,
                                 std::vector<DicomNote> DicomNotes::*kind, const std::string& name) {
  std::vector<Said> all;
  for (const DicomFile& file : files)
    for (const DicomNote& note : file.notes.*kind) {
      const auto found =
          std::ranges::find_if(all, [&](const Said& said) { return said.note->about == note.about; });
      if (found == all.end())
        all.push_back({&note, &file, 1});
      else
        ++found->files;
    }
  std::vector<std::string> texts;
  for (const Said& said : all) {
    std::string where;
    if (files.size() > 1 && said.files < files.size())
      where = said.files == 1 ? fmt::format(" ({})", file_name(said.first->path))
                              : fmt::format(" ({} and {} more)", file_name(said.first->path), said.files - 1);
    else if (files.size() > 1)
      where = fmt::format(" ({} and all others)", file_name(said.first->path));
    texts.push_back(fmt::format("{}: {}{}", name, said.note->text, where));
  }
  return texts;
}

void note_more_inflated_frames(DicomFile& file) {
  const std::uint64_t wanted = file.frames.size() * file.pixels.frame_bytes(),
                      bytes = DicomDecoder(file).bytes_of_samples();
  if (bytes < wanted)
    throw BrokenInput(
        "{}: DICOM file: its pixels have {} bytes, but {} x {} samples of {} bits in {} frames have {}",
        file.path, bytes, file.pixels.columns, file.pixels.rows, file.pixels.allocated, file.frames.size(),
        wanted);
  note_bytes_left_over(file, bytes);
}

std::vector<std::string> about_concatenations(const std::vector<DicomFile>& files, const std::string& name) {
  std::map<std::string, std::int64_t> parts;
  for (const DicomFile& file : files)
    if (file.concatenated > 0) ++parts[file.concatenation];
  std::vector<std::string> texts;
  for (const DicomFile& file : files)
    if (const auto found = parts.find(file.concatenation); found != parts.end()) {
      if (found->second < file.concatenated)
        texts.push_back(fmt::format("{}: {} is one of {} files of a concatenation, of which {} {} missing",
                                    name, file_name(file.path), file.concatenated,
                                    file.concatenated - found->second,
                                    file.concatenated - found->second == 1 ? "is" : "are"));
      parts.erase(found);
    }
  return texts;
}

std::vector<std::string> about_several_scans(const std::vector<DicomFile>& files, const std::string& name) {
  std::vector<std::string> texts;
  for (const char* attribute :
       {"PatientID", "StudyInstanceUID", "FrameOfReferenceUID", "ConvolutionKernel"}) {
    const auto value = [&](const DicomFile& file) {
      const auto found = file.texts.find(attribute);
      return found == file.texts.end() ? std::string_view() : std::string_view(found->second);
    };
    // A file that lacks the attribute says nothing: it may have been taken out.
    const DicomFile* first = nullptr;
    for (const DicomFile& file : files) {
      if (value(file).empty()) continue;
      if (first == nullptr) first = &file;
      if (value(file) == value(*first)) continue;
      texts.push_back(fmt::format("{}: its slices may be of several scans: {} is {} in {}, and {} in {}",
                                  name, attribute, tagrid::quoted(value(*first)), file_name(first->path),
                                  tagrid::quoted(value(file)), file_name(file.path)));
      break;
    }
  }
  return texts;
}

std::vector<std::int32_t> set_meaning(const std::vector<DicomSlice>& slices, const Files& files,
                                      const std::string& name, ServedVolume& volume) {
  std::vector<std::int32_t> added(slices.size(), 0);
  const auto rescale = [&](const DicomSlice& slice) -> const Rescale& {
    return frame_of(files, slice).rescale;
  };
  const auto slope = [&](const DicomSlice& slice) { return rescale(slice).slope; };
  const auto intercept = [&](const DicomSlice& slice) { return rescale(slice).intercept; };
  const Rescale& first = rescale(slices.front());
  const bool is_one =
      std::ranges::all_of(slices, [&](const DicomSlice& slice) { return rescale(slice) == first; });
  if (const auto type = type_of_values(slices, files)) {
    volume.type = *type;
    std::ranges::transform(slices, added.begin(), [&](const DicomSlice& slice) {
      return static_cast<std::int32_t>(intercept(slice));
    });
    const bool have_units = std::ranges::all_of(
        slices, [&](const DicomSlice& slice) { return rescale(slice).units == first.units; });
    if (!first.units.empty() && have_units) volume.pairs.emplace_back("rescale_units", first.units);
    if (!is_one || first.intercept != 0)
      volume.pairs.emplace_back("dicom_added_intercept",
                                is_one ? fmt::format("{}", first.intercept) : one_a_slice(slices, intercept));
    return added;
  }
  const DicomPixels& pixels = files[slices.front().file].pixels;
  volume.type = *integer_type(static_cast<std::size_t>(pixels.allocated) / 8, pixels.is_signed);
  volume.rescale = first;
  if (is_one) return added;
  // Bounds hold for the values of every slice.
  volume.rescale.intercept = 0;
  for (const DicomSlice& slice : slices)
    volume.rescale.slope = std::max(std::abs(volume.rescale.slope), std::abs(slope(slice)));
  volume.pairs.emplace_back("slice_slopes", one_a_slice(slices, slope));
  volume.pairs.emplace_back("slice_intercepts", one_a_slice(slices, intercept));
  volume.warnings.push_back(
      name +
      ": slices have slopes and intercepts of their own; samples are kept as they are stored, and "
      "slice_slopes and slice_intercepts with them; bounds are for the largest slope");
  return added;
}

KeyValues texts_of(const std::vector<DicomSlice>& slices, const Files& files) {
  std::map<std::string, std::string> common = files[slices.front().file].texts;
  for (const DicomSlice& slice : slices)
    std::erase_if(common, [&](const auto& text) {
      const auto& others = files[slice.file].texts;
      const auto found = others.find(text.first);
      return found == others.end() || found->second != text.second;
    });
  KeyValues pairs;
  for (const auto& [key, value] : common) pairs.emplace_back("dicom_" + key, value);
  return pairs;
}

std::string uids_of(const std::vector<DicomSlice>& slices, const Files& files) {
  return one_a_slice(slices, [&](const DicomSlice& slice) { return files[slice.file].instance; });
}

}  // namespace tagrid
