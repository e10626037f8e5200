#include "io/formats/tiff/reader/tiff_volumes.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/files/file_bytes.h"
#include "io/metadata/loss.h"
#include "io/programs/stored_samples.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

/// The runs of planes that lie plainly in their files; none if one does not.
std::vector<SliceRun> places_of(const std::vector<TiffPlane>& planes) {
  std::vector<SliceRun> runs;
  for (const TiffPlane& plane : planes) {
    if (!plane.page.plain) return {};
    const std::uint64_t offset = *plane.page.plain, bytes = plane.page.bytes();
    SliceRun* last = runs.empty() ? nullptr : &runs.back();
    if (last != nullptr && last->file == plane.file && last->slices == 1 && offset > last->offset)
      last->step = offset - last->offset;
    const SliceRun run{plane.file, offset, 1, bytes, plane.page.big_endian};
    if (last == nullptr || !joins(*last, run)) runs.push_back(run);
  }
  return runs;
}

class TiffSlices final : public ServedVolume {
 public:
  TiffSlices(TiffVolumes volumes, std::size_t number) : planes_(std::move(volumes.list[number].planes)) {
    const TiffVolume& volume = volumes.list[number];
    const TiffPage& first = planes_.front().page;
    dims = {first.width, first.height, static_cast<std::int64_t>(planes_.size())};
    type = first.type;
    name_ = std::move(volumes.name);
    geometry = volume.geometry;
    rescale = first.rescale;
    pairs = std::move(volumes.pairs);
    files = std::move(volumes.files);
    warnings = std::move(volumes.warnings);
    if (first.zero_is_white)
      not_understood.push_back(
          name_ +
          ": small numbers mean white in this TIFF image (WhiteIsZero); numbers are kept as they are");
    const auto is_turned = [](const TiffPlane& plane) { return plane.page.orientation != 1; };
    if (const auto turned = std::ranges::find_if(planes_, is_turned); turned != planes_.end())
      warnings.push_back(fmt::format(
          "{}: its pages are to be shown mirrored or turned (Orientation {}); rows and columns are kept as "
          "they are stored",
          name_, turned->page.orientation));
    TiffRemarks remarks = std::move(volumes.remarks);
    remarks.add(volume.remarks);
    add_unwritten(remarks);
    add_byte_order(remarks);
    if (volumes.calibration) calibrate(*volumes.calibration, remarks);
    add(remarks);
    for (const TiffPlane& plane : planes_) memory = std::max(memory, plane.page.memory);
    memory += first.bytes();
    places = places_of(planes_);
    for (SliceRun& run : places) run.stored = stored_;
    has_plain_form = places.empty();
    // A loss is not undone by a lossless copy.
    const bool is_lossy =
        std::ranges::any_of(planes_, [](const TiffPlane& plane) { return plane.page.is_lossy; });
    if (const std::string loss = loss_after(volumes.loss, is_lossy ? "TIFF, JPEG" : ""); !loss.empty())
      pairs.emplace_back(lossy_source_key, loss);
  }

  ReaderPlainFile plain_file(std::size_t number) override {
    std::vector<std::int64_t> slices;
    std::vector<const TiffPage*> pages;
    for (std::int64_t z = 0; z < dims.z; ++z)
      if (const TiffPlane& plane = planes_[static_cast<std::size_t>(z)]; plane.file == number) {
        slices.push_back(z);
        pages.push_back(&plane.page);
      }
    const bool is_plain =
        std::ranges::all_of(pages, [](const TiffPage* page) { return page->plain.has_value(); });
    ReaderPlainFile plain;
    std::uint64_t samples_at = 0;
    if (is_plain)
      plain.pieces = {PlainPiece::stretch(number, 0, FileSource(files[number]).size())};
    else
      plain = plain_tiff_file(files[number], number, pages, samples_at);
    for (std::size_t i = 0; i < pages.size() && plain.why_not.empty(); ++i) {
      const std::uint64_t offset = is_plain ? *pages[i]->plain : samples_at + i * pages[i]->bytes();
      add_place(slices[i], offset, *pages[i], plain.places);
      if (!is_plain && plain.compression.find(pages[i]->storage) == std::string::npos)
        plain.compression += (plain.compression.empty() ? "" : ", ") + pages[i]->storage;
    }
    return plain;
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    const TiffPlane& plane = planes_[static_cast<std::size_t>(z)];
    file(plane.file).read(plane.page, out);
    apply(stored_, type, out, static_cast<std::size_t>(dims.x * dims.y));
    swap_if_not_native(out, static_cast<std::size_t>(dims.x * dims.y), size_of(type), false);
  }

 private:
  TiffFile& file(std::size_t number) {
    if (!file_ || number_ != number) file_.emplace(files[number]);
    number_ = number;
    return *file_;
  }

  /// Adds a slice in a plain form to the run that it goes on, or as a run of its own.
  void add_place(std::int64_t z, std::uint64_t offset, const TiffPage& page,
                 std::vector<NumberedRun>& runs) const {
    SliceRun run{0, offset, 1, page.bytes(), page.big_endian, stored_};
    run.stored.bits = page.packed_bits;
    const bool is_next = !runs.empty() && z == runs.back().first + runs.back().run.slices;
    if (!is_next || !joins(runs.back().run, run)) runs.push_back({z, run});
  }

  void add_unwritten(TiffRemarks& remarks) const {
    std::uint64_t all = 0, unwritten = 0;
    for (const TiffPlane& plane : planes_) {
      all += plane.page.pieces;
      unwritten += plane.page.unwritten;
    }
    if (unwritten > 0)
      remarks.warn(
          fmt::format("{} of its {} strips or tiles were never written; their samples are read as {}",
                      unwritten, all, planes_.front().page.fill));
  }

  /// Only the samples show whether the bytes of floats may be swapped.
  void add_byte_order(TiffRemarks& remarks) {
    std::vector<std::byte> samples;
    for (const TiffPlane& plane : planes_) {
      if (!plane.page.may_be_swapped) continue;
      say_working();
      samples.resize(memory_size(plane.page.bytes()));
      file(plane.file).read(plane.page, samples.data());
      remarks.add(file(plane.file).remarks());
    }
  }

  void calibrate(const ImageJCalibration& calibration, TiffRemarks& remarks) {
    if (rescale != Rescale{}) remarks.doubt("values have a scale by ImageJ and another one by GDAL");
    CalibratedSamples samples = calibrated(calibration, type);
    type = samples.type;
    stored_.add = samples.add;
    rescale = samples.rescale;
    if (!rescale.units.empty() && rescale.slope == 1 && rescale.intercept == 0)
      pairs.emplace_back("rescale_units", rescale.units);
    remarks.warn(std::move(samples.warning));
    remarks.miss(std::move(samples.not_understood));
    remarks.doubt(std::move(samples.scale_doubt));
  }

  /// Sentences, with the name of the volume.
  void add(const TiffRemarks& remarks) {
    for (const std::string& sentence : remarks.warnings) warnings.push_back(name_ + ": " + sentence);
    for (const std::string& sentence : remarks.not_understood)
      not_understood.push_back(name_ + ": " + sentence);
    if (!remarks.scale_doubt.empty()) scale_doubt = name_ + ": " + remarks.scale_doubt;
  }

  std::vector<TiffPlane> planes_;
  std::string name_;
  StoredBits stored_;
  std::optional<TiffFile> file_;
  std::size_t number_ = 0;
};

}  // namespace

std::unique_ptr<ServedVolume> slices_of(TiffVolumes volumes, std::size_t number) {
  return std::make_unique<TiffSlices>(std::move(volumes), number);
}

}  // namespace tagrid
