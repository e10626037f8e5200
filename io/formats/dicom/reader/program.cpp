// tagrid-read-dicom: reads DICOM series with DCMTK, OpenJPEG and libjxl.

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dcdict.h>
#include <dcmtk/dcmdata/dcvr.h>
#include <dcmtk/oflog/oflog.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <optional>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/dicom/reader/decoder.h"
#include "io/formats/dicom/reader/dicom_file.h"
#include "io/formats/dicom/reader/image_files.h"
#include "io/formats/dicom/reader/known_images.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/formats/dicom/reader/series.h"
#include "io/formats/dicom/reader/series_names.h"
#include "io/formats/dicom/reader/volume_facts.h"
#include "io/metadata/loss.h"
#include "io/programs/serve_reader.h"
#include "io/programs/stored_samples.h"
#include "io/programs/words.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;

class DicomVolume final : public ServedVolume {
 public:
  /// Others still need the images, or not.
  DicomVolume(Files& all, bool are_needed, const DicomSeries& series, const std::string& name) {
    lasting_name = series.choice.name;
    take_files(all, are_needed, series);
    add_notes(name);
    const DicomPixels& pixels = files_[slices_.front().file].pixels;
    dims = {pixels.columns, pixels.rows, static_cast<std::int64_t>(slices_.size())};
    pairs = texts_of(slices_, files_);
    for (DicomFile& file : files_) file.texts.clear();
    set_places(slices_, files_, name, *this);
    added_ = set_meaning(slices_, files_, name, *this);
    pairs.emplace_back("slice_sop_instance_uids", uids_of(slices_, files_));
    // A loss is not undone by a lossless copy.
    const auto is_lossy = [](const DicomFile& file) { return !file.pixels.lossy.empty(); };
    if (const auto lossy = std::ranges::find_if(files_, is_lossy); lossy != files_.end())
      pairs.emplace_back(lossy_source_key, lossy->pixels.lossy);
    add_places();
    decoded_.resize(slices_.size());
    has_plain_form = places.empty() && std::ranges::all_of(files_, [](const DicomFile& file) {
                       return file.pixels.offset || file.pixels.encapsulated || file.pixels.inflated;
                     });
    for (const DicomFile& file : files_) files.push_back(file.path);
  }

  ReaderPlainFile plain_file(std::size_t number) override {
    const DicomFile& file = files_[number];
    std::uint64_t samples_at = 0;
    ReaderPlainFile plain = plain_dicom_file(file, number, samples_at);
    if (by_file_.empty())
      for (std::size_t z = 0; z < slices_.size(); ++z) by_file_.emplace(slices_[z].file, z);
    if (number == 0) plain.warnings = about_lost_bits();
    const auto [begin, end] = by_file_.equal_range(number);
    if (file.pixels.encapsulated && may_have_wider_streams(file))
      for (auto slice = begin; slice != end && !plain.why_not; ++slice)
        if (!decoded_now(slice->second).fits)
          plain.why_not = "its code stream has larger numbers than it says";
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
      take(static_cast<std::size_t>(z), file.pixels.stored, out);
      return;
    }
    if (!decoder_ || &decoder_->file() != &files_[slice.file]) decoder_.emplace(files_[slice.file]);
    const int bits = decoder_->read_frame(slice.frame, out);
    take(static_cast<std::size_t>(z), bits, out);
  }

 private:
  /// What is known of a slice that was decoded.
  struct Decoded {
    bool fits;       ///< into the bits that its file says
    bool has_spare;  ///< Bits that do not count are set, and are not the sign.
  };

  /// Makes samples of the decoded numbers of a slice, of which `bits` bits count.
  void take(std::size_t z, int bits, std::byte* numbers) {
    const auto count = static_cast<std::size_t>(dims.x * dims.y);
    const StoredBits stored = stored_bits(z, bits);
    SpareBitsSeen seen;
    if (stored.bits != 0) look_at_spare(stored, size_of(type), {numbers, count * size_of(type)}, seen);
    decoded_[z] = {.fits = fits(z, bits, numbers), .has_spare = !seen.zero && !seen.sign};
    apply(stored, type, numbers, count);
  }
  /// Says that bits are lost which do not count.
  std::vector<std::string> about_lost_bits() {
    for (std::size_t z = 0; z < slices_.size(); ++z) {
      const DicomFile& file = files_[slices_[z].file];
      if (!file.pixels.offset && file.pixels.stored < file.pixels.allocated && decoded_now(z).has_spare)
        return {about_spare_bits(file.path, file.pixels.stored)};
    }
    return {};
  }
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
  /// Of a slice that may have to be decoded first.
  const Decoded& decoded_now(std::size_t z) {
    if (!decoded_[z]) {
      std::vector<std::byte> samples(memory_size(*sample_bytes({dims.x, dims.y, 1}, type)));
      read_slice(static_cast<std::int64_t>(z), samples.data());
      say_working();
    }
    return *decoded_[z];
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
    for (std::string& text : about_several_scans(files_, name)) not_understood.push_back(std::move(text));
    for (const std::string& doubt : said_of(files_, &DicomNotes::scale_doubts, name))
      scale_doubt += (scale_doubt.empty() ? "" : "; ") + doubt;
    if (scale_doubt.empty()) return;
    for (DicomFile& file : files_)
      for (DicomFrame& frame : file.frames) frame.rescale = {};
  }

  /// Keeps the files of the series only, in the order of its slices.
  void take_files(Files& all, bool are_needed, const DicomSeries& series) {
    std::map<std::size_t, std::size_t> numbers;
    for (const DicomSlice& slice : series.slices) {
      const auto [found, is_new] = numbers.emplace(slice.file, files_.size());
      if (is_new) files_.push_back(are_needed ? all[slice.file] : std::move(all[slice.file]));
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
    return fmt::format("; it is one of the {} files of series {}, {} to {}", files_.size(),
                       files_.front().series, file_name(files_.front().path), file_name(files_.back().path));
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
      // Decoders have a sample several times, that of JPEG XL also as parts of three colors.
      const std::uint64_t frame =
          pixels.is_jpeg_xl() ? static_cast<std::uint64_t>(dims.x * dims.y) * 40 : 6 * pixels.frame_bytes();
      memory = std::max(memory, frame + (std::uint64_t{16} << 20));
      if (!pixels.offset) return;
      SliceRun run{slice.file,
                   *pixels.offset + slice.frame * pixels.step,
                   1,
                   pixels.step,
                   pixels.big_endian,
                   stored_bits(z, pixels.stored)};
      if (runs.empty() || !joins(runs.back(), run)) runs.push_back(run);
    }
    places = std::move(runs);
  }

  Files files_;
  std::vector<DicomSlice> slices_;
  std::vector<std::int32_t> added_;
  std::multimap<std::size_t, std::size_t> by_file_;  ///< numbers of slices
  std::vector<std::optional<Decoded>> decoded_;
  std::optional<DicomDecoder> decoder_;
};

const std::string& uid_of(const DicomSeries& series, const Files& images) {
  return images[series.slices.front().file].series;
}

/// The volume that had this name while other volumes kept it apart from the rest of its series;
/// nothing if several volumes match.
std::optional<DicomSeries> volume_that_was_apart(const std::string& name,
                                                 const std::vector<DicomSeries>& series,
                                                 const Files& images) {
  std::vector<DicomSeries> found;
  for (const DicomSeries& one : series) {
    if (uid_in(name) != uid_of(one, images)) continue;
    if (name == one.name_of_all) return std::nullopt;
    for (std::vector<DicomSlice>& slices : slices_called(name, one.slices, images))
      found.push_back({{name, one.choice.text}, std::move(slices)});
  }
  return found.size() == 1 ? std::optional(std::move(found.front())) : std::nullopt;
}

/// The series that is wanted: by its name, by its UID if no other volume has it, or by its number. Throws
/// UsageError, SeveralVolumes.
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

/// Opens the volume at `path`: a file, a directory, or a DICOMDIR. Of several series, the option "series"
/// chooses one by its UID or its number. Values with a slope of 1 are given as they are meant (Hounsfield
/// units), if 16 bits hold them; others as they are stored.
std::unique_ptr<ServedVolume> open_dicom(const std::string& path, const ReaderOptions& options) {
  const std::string wanted = option(options, "series");
  auto known = images_at(path);
  DicomSeries series = series_wanted(path, wanted, known->files, known->series);
  if (!known->are_as_before(series)) {
    forget_images();
    known = images_at(path);
    series = series_wanted(path, wanted, known->files, known->series);
  }
  std::vector<std::string> warnings = warnings_about(path, known->files, series, options.contains("gaps-ok"));
  auto volume = std::make_unique<DicomVolume>(known->files.images, !known->seen.empty(), series, path);
  volume->has_others = known->series.size() > 1;
  volume->warnings.insert(volume->warnings.end(), warnings.begin(), warnings.end());
  return volume;
}

}  // namespace
}  // namespace tagrid

int main() {
  // Answers report what is wrong.
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  // Archives store unknown attributes as UN.
  dcmEnableUnknownVRConversion.set(OFTrue);
  return tagrid::serve_volumes(
      "dicom", tagrid::open_dicom,
      {.may_need = tagrid::may_be_of_series, .are_listed = true, .names_a_tree = tagrid::is_name_of_dicomdir},
      // The library reads its dictionary of all attributes when one is needed.
      [] { static_cast<void>(dcmDataDict.isDictionaryLoaded()); });
}
