#include "io/formats/tiff/reader/tiff_volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/metadata/loss.h"
#include "io/programs/stored_samples.h"
#include "io/samples/stored_bits.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {

namespace fs = std::filesystem;

std::string in_words(const TiffPage& page) {
  return fmt::format("{} x {} {}{}", page.width, page.height, name_of(page.type),
                     page.zero_is_white ? " (WhiteIsZero)" : "");
}

Choice choice_of(std::int64_t channel, std::int64_t channels, std::int64_t time, std::int64_t times) {
  Choice choice;
  if (channels > 1) {
    choice.name = fmt::format("c{}", channel + 1);
    choice.text = fmt::format("channel {} of {}", channel + 1, channels);
  }
  if (times > 1) {
    choice.name += fmt::format("t{}", time + 1);
    choice.text += fmt::format("{}moment {} of {}", choice.text.empty() ? "" : ", ", time + 1, times);
  }
  return choice;
}

namespace {

constexpr const char* different_spacings = "its slices have different spacings, so the spacing is unknown";

/// Files round their resolutions; programs may round that of each slice anew.
bool are_same(const Geometry& a, const Geometry& b) {
  constexpr double rounding = 1e-4;  // relative
  const auto is_same = [](double x, double y) {
    return std::abs(x - y) <= rounding * std::abs(x) || (std::isnan(x) && std::isnan(y));
  };
  return is_same(a.spacing[0], b.spacing[0]) && is_same(a.spacing[1], b.spacing[1]) && a.units == b.units;
}

}  // namespace

Geometry common_spacing(const std::vector<TiffPlane>& planes, TiffRemarks& remarks,
                        const SpacingOfPage& spacing_of_page) {
  Geometry first = spacing_of_page(planes.front().page, remarks);
  for (const TiffPlane& plane : planes) {
    const TiffPage& page = plane.page;
    const bool states_none = page.x_resolution.value_or(1) == 1 && page.y_resolution.value_or(1) == 1;
    TiffRemarks of_page;
    if (states_none || are_same(first, spacing_of_page(page, of_page))) continue;
    remarks.warn(different_spacings);
    return {};
  }
  return first;
}

namespace {

bool are_alike(const TiffPage& a, const TiffPage& b) {
  return a.width == b.width && a.height == b.height && a.type == b.type && a.zero_is_white == b.zero_is_white;
}

/// Some programs write one page, whose samples those of all other images follow: ImageJ if there are more
/// than 4 GiB. `who` says that there are `count` images.
std::vector<TiffPage> pages_of_stack(const TiffFile& file, std::vector<TiffPage> pages, std::uint64_t count,
                                     const char* who, TiffRemarks& remarks) {
  if (pages.size() == count) return pages;
  if (pages.size() != 1 || !pages.front().plain)
    throw BrokenInput("{}: TIFF file: {} description says {} images, but it has {}", file.path(), who, count,
                      pages.size());
  const TiffPage first = pages.front();
  const std::uint64_t room = (file.size() - *first.plain) / first.bytes();
  if (room < count)
    throw BrokenInput("{}: TIFF file: {} description says {} images, but there are bytes for {}", file.path(),
                      who, count, room);
  if (room > count)
    remarks.warn(
        fmt::format("{} description says {} images, but there are bytes for {}; only the first {} are read",
                    who, count, room, count));
  pages.resize(memory_size(count), first);
  for (std::size_t i = 1; i < count; ++i) pages[i].plain = *first.plain + i * first.bytes();
  return pages;
}

/// ImageJ saves a stack as channels or frames if it was not told that they are slices.
ImageJ with_slices(ImageJ image_j, TiffRemarks& remarks) {
  constexpr std::int64_t most = 8;  // channels that ImageJ can give a color each
  const auto become_slices = [&](std::int64_t& count, const char* what) {
    remarks.miss(
        fmt::format("ImageJ's description states {} {} with one slice each; they are read as {} slices of "
                    "one volume",
                    count, what, count));
    std::swap(image_j.slices, count);
  };
  if (image_j.slices != 1) return image_j;
  if (image_j.frames == 1 && image_j.channels > most) become_slices(image_j.channels, "channels");
  if (image_j.channels == 1 && image_j.frames > most) become_slices(image_j.frames, "frames");
  return image_j;
}

void add_image_j(const TiffFile& file, std::vector<TiffPage> pages, const ImageJ& described,
                 TiffVolumes& volumes) {
  const ImageJ image_j = with_slices(described, volumes.remarks);
  pages = pages_of_stack(file, std::move(pages), static_cast<std::uint64_t>(image_j.images), "ImageJ's",
                         volumes.remarks);
  const auto spacing = [&](const TiffPage& page, TiffRemarks& remarks) {
    return spacing_of(image_j, page, remarks);
  };
  for (std::int64_t t = 0; t < image_j.frames; ++t)
    for (std::int64_t c = 0; c < image_j.channels; ++c) {
      TiffVolume volume{choice_of(c, image_j.channels, t, image_j.frames), {}, {}, {}};
      for (std::int64_t z = 0; z < image_j.slices; ++z)
        volume.planes.push_back(
            {0, pages[static_cast<std::size_t>(c + image_j.channels * (z + image_j.slices * t))]});
      volume.geometry = common_spacing(volume.planes, volume.remarks, spacing);
      volumes.list.push_back(std::move(volume));
    }
}

/// The pages as they follow each other.
void add_pages(const TiffFile& file, std::vector<TiffPage> pages, const std::string& description,
               TiffVolumes& volumes) {
  const TiffShape shape = shape_in(description);
  if (shape.images > 1 && shape.images != pages.size() && shape.is_truncated)
    pages = pages_of_stack(file, std::move(pages), shape.images, "tifffile's", volumes.remarks);
  if (shape.images == pages.size() && !shape.is_of_slices)
    volumes.remarks.miss(fmt::format(
        "its description says that its pages are an array of {}, so some axis may be channels or moments; "
        "they are read as {} slices",
        shape.text, pages.size()));
  if (description.starts_with("state.") || description.find("scanimage.SI") != description.npos)
    volumes.remarks.miss("it is a file of ScanImage, and what that says of channels and moments is not read");
  volumes.remarks.miss(pages.front().unread_order);
  volumes.list.emplace_back();
  TiffVolume& volume = volumes.list.back();
  for (TiffPage& page : pages) volume.planes.push_back({0, std::move(page)});
  volume.geometry = common_spacing(volume.planes, volumes.remarks, spacing_of_resolutions);
}

void require_alike(const TiffVolumes& volumes, const TiffVolume& volume) {
  const TiffPlane& first = volume.planes.front();
  for (std::size_t z = 1; z < volume.planes.size(); ++z) {
    const TiffPlane& plane = volume.planes[z];
    const std::string of_first = plane.file == first.file ? "" : " (" + volumes.files[first.file] + ")";
    if (!are_alike(plane.page, first.page))
      throw BrokenInput("{}: TIFF file: slice {} of {} is {}, but the first one is {}{}",
                        volumes.files[plane.file], z + 1, volume.planes.size(), in_words(plane.page),
                        in_words(first.page), of_first);
    if (plane.page.rescale != first.page.rescale)
      throw BrokenInput(
          "{}: TIFF file: slice {} of {} has another scale of values (GDAL) than the first one{}, so their "
          "values cannot be one volume",
          volumes.files[plane.file], z + 1, volume.planes.size(), of_first);
  }
}

/// The OME-XML that lies in another file, which may be TIFF, too.
OmeXml xml_elsewhere(const std::string& path, const std::string& metadata_file) {
  FileBytes file(metadata_file);
  constexpr std::uint64_t most = std::uint64_t{64} << 20;
  if (file.size().value_or(0) > most)
    throw BrokenInput("{}: has more than 64 MiB, which is not read as OME-XML", metadata_file);
  std::string text(file.size().value_or(0), '\0');
  text.resize(file.read(reinterpret_cast<std::byte*>(text.data()), text.size()));
  std::optional<OmeXml> xml = ome_xml_of(text);
  if (!xml || !xml->metadata_file.empty())
    throw BrokenInput("{}: is not OME-XML, although the OME-XML in {} says so", metadata_file, path);
  return *std::move(xml);
}

bool may_be_tiff(const std::string& path) {
  const std::string begin(FileBytes(path).peek(2));
  return begin == "II" || begin == "MM";
}

TiffVolumes described_volumes(const std::string& path, bool gaps_ok);

/// The volumes that are described in another file (BinaryOnly), which is called `name`.
TiffVolumes volumes_described_in(const std::string& name, const std::string& path,
                                 const std::vector<TiffPage>& pages, bool gaps_ok, TiffVolumes volumes) {
  const std::string metadata_file = beside(path, name);
  std::error_code unknown;
  if (!fs::exists(path_of(metadata_file), unknown))
    throw BrokenInput("{}: TIFF file: its OME-XML is in the file {}, which is missing", path,
                      tagrid::quoted(std::string_view(name)));
  if (!may_be_tiff(metadata_file)) {
    add_ome(path, pages, xml_elsewhere(path, metadata_file), false, gaps_ok, volumes);
    volumes.files.push_back(metadata_file);
    return volumes;
  }
  const std::string description = TiffFile(metadata_file).description();
  if (const auto xml = ome_xml_of(description); !xml || !xml->metadata_file.empty())
    throw BrokenInput("{}: has no OME-XML, although the OME-XML in {} says so", metadata_file, path);
  return described_volumes(metadata_file, gaps_ok);
}

/// The volumes as the description of the file has them.
TiffVolumes described_volumes(const std::string& path, bool gaps_ok) {
  TiffVolumes volumes;
  volumes.files = {path};
  TiffFile file(path);
  std::vector<TiffPage> pages = file.pages();
  volumes.remarks = file.remarks();
  const std::string description = pages.front().description;
  for (TiffPage& page : pages) page.description = {};
  volumes.calibration = calibration_of(description);
  volumes.loss = loss_in(description);
  try {
    if (const auto image_j = image_j_of(description))
      add_image_j(file, std::move(pages), *image_j, volumes);
    else if (const auto xml = ome_xml_of(description); xml && !xml->metadata_file.empty())
      return volumes_described_in(xml->metadata_file, path, pages, gaps_ok, std::move(volumes));
    else if (xml)
      add_ome(path, pages, *xml, true, gaps_ok, volumes);
    else if (const std::string described_in = file_that_names(path); !described_in.empty())
      return described_volumes(described_in, gaps_ok);
    else
      add_pages(file, std::move(pages), description, volumes);
  } catch (const BrokenInput& error) {
    const std::string_view why = error.what();
    if (!why.starts_with("TIFF file:")) throw;
    throw BrokenInput(fmt::format("{}: {}", path, why), error.detail().problem);
  }
  return volumes;
}

}  // namespace

TiffVolumes volumes_of_file(const std::string& path, bool gaps_ok) {
  TiffVolumes volumes = described_volumes(path, gaps_ok);
  for (TiffVolume& volume : volumes.list) {
    require_alike(volumes, volume);
    const TiffPage& first = volume.planes.front().page;
    volume.choice.text += fmt::format("{}{} x {} x {} {}", volume.choice.text.empty() ? "" : ": ",
                                      first.width, first.height, volume.planes.size(), name_of(first.type));
  }
  return volumes;
}

namespace {

/// The number of images in the description of a file that has one page.
std::size_t images_in(const std::string& description) {
  if (const auto image_j = image_j_of(description)) return static_cast<std::size_t>(image_j->images);
  const auto xml = ome_xml_of(description);
  std::int64_t images = xml && !xml->metadata_file.empty() ? 2 : 0;
  if (xml)
    for (const OmeImage& image : xml->images) images += image.slices * image.channels * image.times;
  if (images > 1) return static_cast<std::size_t>(images);
  const TiffShape shape = shape_in(description);
  return shape.is_truncated ? shape.images : 1;
}

/// The spacing within a slice. The distance between slices in its file does not count, because the file does
/// not know other slices.
Geometry geometry_of_slice(const TiffPage& page, TiffRemarks& remarks) {
  Geometry geometry;
  if (const auto image_j = image_j_of(page.description); image_j) {
    geometry = spacing_of(*image_j, page, remarks);
  } else if (const auto xml = ome_xml_of(page.description);
             xml && !xml->images.empty() && xml->images.front().geometry.has_spacing) {
    geometry = xml->images.front().geometry;
    remarks.add(xml->images.front().remarks);
  } else {
    geometry = spacing_of(page, remarks);
  }
  geometry.spacing[2] = Geometry::unknown;
  geometry.has_spacing = !std::isnan(geometry.spacing[0]) || !std::isnan(geometry.spacing[1]);
  if (!geometry.has_spacing) geometry.units = {};
  return geometry;
}

}  // namespace

TiffVolumes volume_of_files(const std::vector<std::string>& paths) {
  TiffVolumes volumes;
  volumes.files = paths;
  volumes.list.emplace_back();
  bool differs = false;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    say_working();
    TiffFile file(paths[i]);
    std::vector<TiffPage> pages = file.pages();
    volumes.remarks.add(file.remarks());
    if (pages.size() != 1)
      throw BrokenInput("{}: TIFF file: has {} pages, but is one of {} files that are a slice each", paths[i],
                        pages.size(), paths.size());
    volumes.remarks.miss(pages.front().unread_order);
    const std::string& description = pages.front().description;
    const Geometry geometry = geometry_of_slice(pages.front(), volumes.list.front().remarks);
    if (i == 0)
      volumes.list.front().geometry = geometry;
    else if (!are_same(geometry, volumes.list.front().geometry))
      differs = true;
    if (images_in(description) > 1)
      throw BrokenInput(
          "{}: TIFF file: its description speaks of several images, but it is one of {} files that are a "
          "slice each",
          paths[i], paths.size());
    const auto calibration = calibration_of(description);
    if (i == 0) volumes.calibration = calibration;
    if (volumes.loss.empty()) volumes.loss = loss_in(description);
    if (calibration != volumes.calibration)
      throw BrokenInput(
          "{}: TIFF file: has another calibration of ImageJ than {}, so their values cannot be one volume",
          paths[i], paths.front());
    pages.front().description = {};
    volumes.list.back().planes.push_back({i, std::move(pages.front())});
  }
  if (differs) {
    volumes.list.front().geometry = {};
    volumes.list.front().remarks.warn(different_spacings);
  }
  require_alike(volumes, volumes.list.front());
  return volumes;
}

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
    for (std::size_t i = 0; i < pages.size() && !plain.why_not; ++i) {
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
