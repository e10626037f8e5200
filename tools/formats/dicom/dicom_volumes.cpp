#include "tools/formats/dicom/dicom_volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/samples/stored_bits.h"
#include "tools/formats/dicom/decoder.h"
#include "tools/formats/dicom/dicom_file.h"
#include "tools/formats/dicom/image_files.h"
#include "tools/formats/dicom/pixel_element.h"
#include "tools/formats/dicom/said_of_files.h"
#include "tools/formats/dicom/series.h"
#include "tools/formats/dicom/series_names.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

using Files = std::vector<DicomFile>;

SampleType stored_type(const DicomPixels& pixels) {
  switch (pixels.allocated) {
    case 8:
      return pixels.is_signed ? SampleType::int8 : SampleType::uint8;
    case 16:
      return pixels.is_signed ? SampleType::int16 : SampleType::uint16;
    default:
      return pixels.is_signed ? SampleType::int32 : SampleType::uint32;
  }
}

/// Samples of all slices, and what they mean.
struct Meaning {
  SampleType type = SampleType::uint8;
  std::vector<std::int32_t> added;  ///< to the stored integers of each slice
  Rescale rescale;
  KeyValues pairs;
  std::vector<std::string> warnings;
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
std::string listed(const std::vector<DicomSlice>& slices, Number number) {
  std::string text;
  for (const DicomSlice& slice : slices) text += fmt::format("{}{}", text.empty() ? "" : " ", number(slice));
  return text;
}

Meaning meaning_of(const std::vector<DicomSlice>& slices, const Files& files, const std::string& name) {
  Meaning meaning;
  meaning.added.assign(slices.size(), 0);
  const Rescale& first = frame_of(files, slices.front()).rescale;
  const bool is_one = std::ranges::all_of(
      slices, [&](const DicomSlice& slice) { return frame_of(files, slice).rescale == first; });
  const auto slope = [&](const DicomSlice& slice) { return frame_of(files, slice).rescale.slope; };
  const auto intercept = [&](const DicomSlice& slice) { return frame_of(files, slice).rescale.intercept; };
  if (const auto type = type_of_values(slices, files)) {
    meaning.type = *type;
    for (std::size_t i = 0; i < slices.size(); ++i)
      meaning.added[i] = static_cast<std::int32_t>(intercept(slices[i]));
    const bool have_units = std::ranges::all_of(
        slices, [&](const DicomSlice& slice) { return frame_of(files, slice).rescale.units == first.units; });
    if (!first.units.empty() && have_units) meaning.pairs.emplace_back("rescale_units", first.units);
    if (!is_one || first.intercept != 0)
      meaning.pairs.emplace_back("dicom_added_intercept",
                                 is_one ? fmt::format("{}", first.intercept) : listed(slices, intercept));
    return meaning;
  }
  meaning.type = stored_type(files[slices.front().file].pixels);
  meaning.rescale = first;
  if (is_one) return meaning;
  // Bounds hold for the values of every slice.
  meaning.rescale.intercept = 0;
  for (const DicomSlice& slice : slices)
    meaning.rescale.slope = std::max(std::abs(meaning.rescale.slope), std::abs(slope(slice)));
  meaning.pairs.emplace_back("slice_slopes", listed(slices, slope));
  meaning.pairs.emplace_back("slice_intercepts", listed(slices, intercept));
  meaning.warnings.push_back(name +
                             ": slices have slopes and intercepts of their own; samples are kept as they are "
                             "stored, and slice_slopes and "
                             "slice_intercepts with them; bounds are for the largest slope");
  return meaning;
}

/// What all files of the series say alike.
KeyValues common_texts(const std::vector<DicomSlice>& slices, const Files& files) {
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

class DicomVolume final : public ServedVolume {
 public:
  DicomVolume(Files all, const DicomSeries& series, const std::string& name) {
    lasting_name = series.choice.name;
    take_files(std::move(all), series);
    add_notes(name);
    const DicomPixels& pixels = files_[slices_.front().file].pixels;
    dims = {pixels.columns, pixels.rows, static_cast<std::int64_t>(slices_.size())};
    DicomPlaces where = places_of({series.choice, slices_}, files_, name);
    Meaning meaning = meaning_of(slices_, files_, name);
    geometry = std::move(where.geometry);
    type = meaning.type;
    rescale = meaning.rescale;
    added_ = std::move(meaning.added);
    for (auto* more : {&where.warnings, &meaning.warnings})
      warnings.insert(warnings.end(), more->begin(), more->end());
    pairs = common_texts(slices_, files_);
    for (DicomFile& file : files_) file.texts.clear();
    for (auto* more : {&where.pairs, &meaning.pairs}) pairs.insert(pairs.end(), more->begin(), more->end());
    pairs.emplace_back("slice_sop_instance_uids",
                       listed(slices_, [&](const DicomSlice& slice) { return files_[slice.file].instance; }));
    // A loss is not undone by a lossless copy.
    const auto is_lossy = [](const DicomFile& file) { return !file.pixels.lossy.empty(); };
    if (const auto lossy = std::ranges::find_if(files_, is_lossy); lossy != files_.end())
      pairs.emplace_back(lossy_source_key, lossy->pixels.lossy);
    add_places();
    fits_.resize(slices_.size());
    has_plain_form = places.empty() && std::ranges::all_of(files_, [](const DicomFile& file) {
                       return file.pixels.offset || file.pixels.encapsulated || file.pixels.inflated;
                     });
    for (const DicomFile& file : files_) texts_.push_back(file.path);
    files = texts_;
  }

  ReaderPlainFile plain_file(std::size_t number) override {
    const DicomFile& file = files_[number];
    std::uint64_t samples_at = 0;
    ReaderPlainFile plain = plain_dicom_file(file, number, samples_at);
    if (by_file_.empty())
      for (std::size_t z = 0; z < slices_.size(); ++z) by_file_.emplace(slices_[z].file, z);
    const auto [begin, end] = by_file_.equal_range(number);
    if (file.pixels.encapsulated && may_have_wider_streams(file))
      for (auto slice = begin; slice != end && plain.why_not.empty(); ++slice)
        if (!fits_now(slice->second)) plain.why_not = "its code stream has larger numbers than it says";
    for (auto slice = begin; slice != end; ++slice) {
      const std::size_t z = slice->second;
      const std::uint64_t bytes = file.pixels.offset ? file.pixels.step : file.pixels.frame_bytes();
      plain.places.push_back({static_cast<std::int64_t>(z),
                              {.file = number,
                               .offset = samples_at + slices_[z].frame * bytes,
                               .step = bytes,
                               .big_endian = file.pixels.big_endian,
                               .stored = stored_bits(z, file.pixels.stored)}});
    }
    return plain;
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    const DicomSlice& slice = slices_[static_cast<std::size_t>(z)];
    const DicomFile& file = files_[slice.file];
    if (!file.pixels.stretches.empty()) {
      read_from_stretches(file, slice.frame, out);
      apply(stored_bits(static_cast<std::size_t>(z), file.pixels.stored), type, out,
            static_cast<std::size_t>(dims.x * dims.y));
      return;
    }
    if (!decoder_ || &decoder_->file() != &files_[slice.file]) {
      decoder_.reset();
      decoder_.emplace(files_[slice.file]);
    }
    const int bits = decoder_->read_frame(slice.frame, out);
    fits_[static_cast<std::size_t>(z)] = fits(static_cast<std::size_t>(z), bits, out);
    apply(stored_bits(static_cast<std::size_t>(z), bits), type, out,
          static_cast<std::size_t>(dims.x * dims.y));
  }

 private:
  /// True if all decoded numbers of a slice are among those of the bits that its file says.
  bool fits(std::size_t z, int bits, const std::byte* numbers) const {
    const DicomPixels& pixels = files_[slices_[z].file].pixels;
    if (bits <= pixels.stored) return true;
    bool do_fit = true;
    with_bits_of(size_of(type), [&]<class Bits>(Bits) {
      const BitsThatCount<Bits> wide({bits == pixels.allocated ? 0 : bits, pixels.is_signed, 0}),
          narrow({pixels.stored, pixels.is_signed, 0});
      for (std::int64_t i = 0; i < dims.x * dims.y && do_fit; ++i) {
        Bits number;
        std::memcpy(&number, numbers + static_cast<std::size_t>(i) * sizeof(Bits), sizeof(Bits));
        do_fit = pixels.is_signed ? wide.with_sign(number) == narrow.with_sign(number)
                                  : wide.low(number) == narrow.low(number);
      }
    });
    return do_fit;
  }
  /// The same of a slice that may have to be decoded first.
  bool fits_now(std::size_t z) {
    if (!fits_[z]) {
      std::vector<std::byte> samples(memory_size(*sample_bytes({dims.x, dims.y, 1}, type)));
      read_slice(static_cast<std::int64_t>(z), samples.data());
      say_working();
    }
    return *fits_[z];
  }

  /// Notes about the files. In doubt, samples stay as they are.
  void add_notes(const std::string& name) {
    for (DicomFile& file : files_) {
      if (!file.pixels.inflated) continue;
      note_more_inflated_frames(file);
      say_working();
    }
    warnings = said_of(files_, &DicomNotes::warnings, name);
    for (std::string& text : about_concatenations(files_, name)) warnings.push_back(std::move(text));
    not_understood = said_of(files_, &DicomNotes::not_understood, name);
    for (const std::string& doubt : said_of(files_, &DicomNotes::scale_doubts, name))
      scale_doubt += (scale_doubt.empty() ? "" : "; ") + doubt;
    if (scale_doubt.empty()) return;
    for (DicomFile& file : files_)
      for (DicomFrame& frame : file.frames) frame.rescale = {};
  }

  /// Keeps the files of the series only, in the order of its slices.
  void take_files(Files all, const DicomSeries& series) {
    std::map<std::size_t, std::size_t> numbers;
    for (const DicomSlice& slice : series.slices) {
      const auto [found, is_new] = numbers.emplace(slice.file, files_.size());
      if (is_new) files_.push_back(std::move(all[slice.file]));
      slices_.push_back({found->second, slice.frame});
    }
    const auto is_whole = [](const DicomFile& file) { return !file.pixels.is_cut; };
    for (const DicomFile& file : files_)
      if (!file.pixels.unsupported.empty())
        throw BrokenInput(
            fmt::format("{}: DICOM file: {}{}", file.path, file.pixels.unsupported, role_of_file()),
            // After truncated files are left out, some slices must remain.
            file.pixels.is_cut && std::ranges::any_of(files_, is_whole) ? Problem::slices_missing
                                                                        : Problem::none);
  }

  /// To which series a file belongs, if it has others.
  std::string role_of_file() const {
    if (files_.size() == 1) return "";
    const auto name = [](const DicomFile& file) { return fs::path(file.path).filename().string(); };
    return fmt::format("; it is one of the {} files of series {}, {} to {}", files_.size(),
                       files_.front().series, name(files_.front()), name(files_.back()));
  }

  StoredBits stored_bits(std::size_t z, int bits) const {
    const DicomPixels& pixels = files_[slices_[z].file].pixels;
    return {bits == pixels.allocated ? 0 : bits, pixels.is_signed, added_[z]};
  }

  void add_places() {
    std::vector<SliceRun> runs;
    for (std::size_t z = 0; z < slices_.size(); ++z) {
      const DicomSlice& slice = slices_[z];
      const DicomPixels& pixels = files_[slice.file].pixels;
      memory = std::max(memory, 6 * pixels.frame_bytes() + (std::uint64_t{16} << 20));
      if (!pixels.offset) return;
      SliceRun run{slice.file,
                   *pixels.offset + slice.frame * pixels.step,
                   1,
                   pixels.step,
                   pixels.big_endian,
                   stored_bits(z, pixels.stored)};
      SliceRun* last = runs.empty() ? nullptr : &runs.back();
      if (last != nullptr && last->file == run.file && last->stored == run.stored &&
          run.offset == last->offset + static_cast<std::uint64_t>(last->slices) * last->step)
        ++last->slices;
      else
        runs.push_back(run);
    }
    places = std::move(runs);
  }

  Files files_;
  std::vector<std::string> texts_;
  std::vector<DicomSlice> slices_;
  std::vector<std::int32_t> added_;
  std::multimap<std::size_t, std::size_t> by_file_;  ///< numbers of slices
  std::vector<std::optional<bool>> fits_;            ///< of slices that were decoded
  std::optional<DicomDecoder> decoder_;
};

const std::string& uid_of(const DicomSeries& series, const Files& images) {
  return images[series.slices.front().file].series;
}

/// The volume of a name that no series has now, among the images of the series.
std::optional<DicomSeries> volume_that_was_apart(const std::string& name,
                                                 const std::vector<DicomSeries>& series,
                                                 const Files& images) {
  for (const DicomSeries& one : series)
    if (uid_in(name) == uid_of(one, images))
      if (auto slices = slices_called(name, one.slices, images))
        return DicomSeries{{name, one.choice.text}, *std::move(slices)};
  return std::nullopt;
}

/// The series that is wanted: by its name, by its UID if no other volume has it, or by its number. Throws UsageError,
/// SeveralVolumes.
DicomSeries series_wanted(const std::string& path, const std::string& wanted, const ImageFiles& files,
                          const std::vector<DicomSeries>& series) {
  const Files& images = files.images;
  std::vector<Choice> all, with_uid;
  for (const DicomSeries& one : series) {
    all.push_back(one.choice);
    if (!wanted.empty() && uid_of(one, images) == wanted) with_uid.push_back(one.choice);
  }
  if (with_uid.size() > 1) throw SeveralVolumes{"series", with_uid};
  if (with_uid.size() == 1) return series[chosen(path, "series", with_uid.front().name, all)];
  if (std::ranges::none_of(all, [&](const Choice& one) { return one.name == wanted; })) {
    if (auto volume = volume_that_was_apart(wanted, series, images)) return *std::move(volume);
    // Without some of its images, a volume may have another name. Then these are the error.
    for (const DicomSeries& one : series)
      if (uid_in(wanted) == uid_of(one, images) && !unreadable_in(one, files).empty()) return one;
  }
  return series[chosen(path, "series", wanted, all)];
}

/// Leaves out the slices whose files are cut within their pixels, and returns these files.
std::vector<UnreadableImage> leave_out_cut(DicomSeries& series, const Files& images) {
  std::vector<UnreadableImage> cut;
  const auto is_cut = [&](const DicomSlice& slice) { return images[slice.file].pixels.is_cut; };
  if (std::ranges::all_of(series.slices, is_cut)) return cut;  // then the first one is the error
  for (const DicomSlice& slice : series.slices)
    if (const DicomFile& image = images[slice.file]; is_cut(slice) && slice.frame == 0)
      cut.push_back({image.path, image.pixels.unsupported, image.series});
  std::erase_if(series.slices, is_cut);
  return cut;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// Notes about files in the directory that are not in the volume. Slices that cannot be read are left out
/// with `gaps_ok`. Throws BrokenInput without it.
std::vector<std::string> warnings_about(const std::string& path, const ImageFiles& files, DicomSeries& series,
                                        bool gaps_ok) {
  std::vector<std::string> warnings;
  std::vector<UnreadableImage> missing = unreadable_in(series, files);
  if (!missing.empty() && !gaps_ok)
    throw BrokenInput(
        fmt::format("{}: {} cannot be read and may belong to series {}: {}", path,
                    counted(missing.size(), "file"), uid_of(series, files.images), listed(missing)),
        Problem::slices_missing);
  if (gaps_ok) {
    const std::vector<UnreadableImage> cut = leave_out_cut(series, files.images);
    missing.insert(missing.end(), cut.begin(), cut.end());
  }
  if (!missing.empty())
    warnings.push_back(fmt::format("{}: {} cannot be read, and the volume is without {}: {}", path,
                                   counted(missing.size(), "file"), missing.size() == 1 ? "it" : "them",
                                   listed(missing)));
  // Those of other series are said where these are read.
  std::vector<UnreadableImage> of_none = files.unreadable;
  std::erase_if(of_none, [&](const UnreadableImage& image) {
    return image.series.empty() || std::ranges::any_of(files.images, [&](const DicomFile& other) {
             return other.series == image.series;
           });
  });
  if (!of_none.empty())
    warnings.push_back(fmt::format("{}: {} cannot be read: {}", path, counted(of_none.size(), "other file"),
                                   listed(of_none)));
  if (!files.others.empty())
    warnings.push_back(fmt::format("{}: {} without an image of DICOM: {}", path,
                                   counted(files.others.size(), "file"), listed_names(files.others)));
  return warnings;
}

/// Says that a file is a slice of a larger volume; "" if it is not.
std::string about_siblings(const std::string& path, const DicomSeries& series, const Files& images) {
  std::error_code unknown;
  const DicomFile& image = images[series.slices.front().file];
  if (series.slices.size() > 1 || image.path != path || fs::is_directory(path, unknown)) return "";
  const std::string sibling = sibling_of(image);
  if (sibling.empty()) return "";
  return fmt::format(
      "{}: is one image of a series, and {} is another one; give their folder to read all of them", path,
      sibling);
}

}  // namespace

std::unique_ptr<ServedVolume> open_dicom(const std::string& path, const ReaderOptions& options) {
  ImageFiles files = image_files_at(path);
  std::vector<DicomSeries> all = series_of(files.images);
  const auto wanted = options.find("series");
  const std::string name = wanted == options.end() ? "" : wanted->second;
  DicomSeries series = series_wanted(path, name, files, all);
  std::vector<std::string> warnings = warnings_about(path, files, series, options.contains("gaps-ok"));
  if (std::string text = about_siblings(path, series, files.images); !text.empty())
    warnings.push_back(std::move(text));
  auto volume = std::make_unique<DicomVolume>(std::move(files.images), series, path);
  volume->warnings.insert(volume->warnings.end(), warnings.begin(), warnings.end());
  return volume;
}

}  // namespace tagrid
