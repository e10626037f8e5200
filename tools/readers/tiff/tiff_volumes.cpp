#include "tools/readers/tiff/tiff_volumes.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "io/files/errors.h"
#include "io/files/text.h"
#include "tools/readers/slice_files.h"
#include "tools/readers/tiff/image_j.h"
#include "tools/readers/tiff/ome.h"
#include "tools/readers/tiff/tiff_slices.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

std::string in_words(const TiffPage& page) {
  return fmt::format("{} x {} {}", page.width, page.height, name_of(page.type));
}

bool are_alike(const TiffPage& a, const TiffPage& b) {
  return a.width == b.width && a.height == b.height && a.type == b.type && a.zero_is_white == b.zero_is_white;
}

/// The name of a channel and a moment, where there are several.
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

/// ImageJ writes a stack of more than 4 GiB as one page, whose samples those of all other images follow.
std::vector<TiffPage> pages_of_image_j(const TiffFile& file, std::vector<TiffPage> pages,
                                       const ImageJ& image_j) {
  const auto count = static_cast<std::uint64_t>(image_j.images);
  if (pages.size() == count) return pages;
  if (pages.size() != 1 || !pages.front().plain)
    throw BrokenInput(fmt::format("{}: TIFF file: ImageJ's description says {} images, but it has {}",
                                  file.path(), count, pages.size()));
  const TiffPage first = pages.front();
  if ((file.size() - *first.plain) / first.bytes() < count)
    throw BrokenInput(
        fmt::format("{}: TIFF file: ImageJ's description says {} images, but there are bytes for {}",
                    file.path(), count, (file.size() - *first.plain) / first.bytes()));
  pages.resize(count, first);
  for (std::size_t i = 1; i < count; ++i) pages[i].plain = *first.plain + i * first.bytes();
  return pages;
}

void add_image_j(const TiffFile& file, std::vector<TiffPage> pages, const ImageJ& image_j,
                 TiffVolumes& volumes) {
  pages = pages_of_image_j(file, std::move(pages), image_j);
  const TiffPage& first = pages.front();
  for (std::int64_t t = 0; t < image_j.frames; ++t)
    for (std::int64_t c = 0; c < image_j.channels; ++c) {
      TiffVolume volume{choice_of(c, image_j.channels, t, image_j.frames), {}};
      for (std::int64_t z = 0; z < image_j.slices; ++z)
        volume.planes.push_back(
            {0, pages[static_cast<std::size_t>(c + image_j.channels * (z + image_j.slices * t))]});
      volumes.list.push_back(std::move(volume));
    }
  // Without a unit, resolutions are those of paper.
  const bool has_unit = !image_j.unit.empty() && image_j.unit != "pixel" && image_j.unit != "pixels";
  if (!has_unit || !(first.x_resolution > 0) || !(first.y_resolution > 0)) return;
  volumes.geometry.spacing = {1 / first.x_resolution, 1 / first.y_resolution,
                              image_j.spacing != 0 ? image_j.spacing : Geometry::unknown};
  volumes.geometry.has_spacing = image_j.spacing > 0;
  volumes.geometry.units.fill(image_j.unit);
}

void add_ome(const std::string& path, std::vector<TiffPage> own_pages, const std::vector<OmeImage>& images,
             TiffVolumes& volumes) {
  std::map<std::string, std::pair<std::size_t, std::vector<TiffPage>>> known;
  known[""] = {0, own_pages};
  // If only one file is named, it is this one, which may have another name by now.
  std::set<std::string> names;
  for (const OmeImage& image : images)
    for (const OmePlane& plane : image.planes)
      if (!plane.file.empty()) names.insert(plane.file);
  if (names.size() == 1) known[*names.begin()] = {0, own_pages};
  known[fs::path(path).filename().string()] = {0, std::move(own_pages)};
  const auto pages_of = [&](const std::string& name) -> const auto& {
    const auto found = known.find(name);
    if (found != known.end()) return found->second;
    // A description is untrusted input: it names files beside it, and no others.
    if (name == ".." || name.find('/') != name.npos)
      throw BrokenInput(fmt::format("{}: TIFF file: OME-XML names the file {}, which is not in its folder",
                                    path, tagrid::quoted(std::string_view(name))));
    const std::string beside = (fs::path(path).parent_path() / name).string();
    volumes.files.push_back(beside);
    return known[name] = {volumes.files.size() - 1, TiffFile(beside).pages()};
  };
  for (std::size_t i = 0; i < images.size(); ++i) {
    const OmeImage& image = images[i];
    for (std::int64_t t = 0; t < image.times; ++t)
      for (std::int64_t c = 0; c < image.channels; ++c) {
        TiffVolume volume{choice_of(c, image.channels, t, image.times), {}};
        if (images.size() > 1) {
          volume.choice.name = fmt::format("i{}{}", i + 1, volume.choice.name);
          volume.choice.text = fmt::format("image {}{}{}", tagrid::quoted(std::string_view(image.name)),
                                           volume.choice.text.empty() ? "" : ", ", volume.choice.text);
        }
        for (std::int64_t z = 0; z < image.slices; ++z) {
          const OmePlane& plane =
              image.planes[static_cast<std::size_t>(z + image.slices * (c + image.channels * t))];
          const auto& [file, pages] = pages_of(plane.file);
          if (plane.page < 0 || static_cast<std::size_t>(plane.page) >= pages.size())
            throw BrokenInput(fmt::format("{}: TIFF file: OME-XML: slice {} of {} has no page", path, z + 1,
                                          volume.choice.text.empty() ? "the image" : volume.choice.text));
          volume.planes.push_back({file, pages[static_cast<std::size_t>(plane.page)]});
        }
        volumes.list.push_back(std::move(volume));
      }
  }
  const OmeImage& first = images.front();
  if (!(first.spacing[0] > 0) || !(first.spacing[1] > 0)) return;
  volumes.geometry.spacing = first.spacing;
  volumes.geometry.has_spacing = first.spacing[2] > 0;
  volumes.geometry.units.fill(first.unit);
}

void require_alike(const TiffVolumes& volumes, const TiffVolume& volume) {
  const TiffPlane& first = volume.planes.front();
  for (std::size_t z = 1; z < volume.planes.size(); ++z) {
    const TiffPlane& plane = volume.planes[z];
    if (are_alike(plane.page, first.page)) continue;
    throw BrokenInput(fmt::format("{}: TIFF file: slice {} of {} is {}, but the first one is {}{}",
                                  volumes.files[plane.file], z + 1, volume.planes.size(),
                                  in_words(plane.page), in_words(first.page),
                                  plane.file == first.file ? "" : " (" + volumes.files[first.file] + ")"));
  }
}

TiffVolumes volumes_in_folder(const std::string& folder, const ReaderOptions& options) {
  const NumberedFiles files = slice_files(folder, {".tif", ".tiff"}, options);
  if (files.paths.size() == 1) return volumes_of_file(files.paths.front());
  TiffVolumes volumes = volume_of_files(files.paths);
  volumes.pairs.push_back(pair_of(files));
  add_warning_of_gaps(folder, files, volumes.warnings);
  add(log_of_slices(folder, files), volumes.geometry, volumes.pairs, volumes.files);
  return volumes;
}

}  // namespace

TiffVolumes volumes_of_file(const std::string& path) {
  TiffVolumes volumes;
  volumes.files = {path};
  TiffFile file(path);
  std::vector<TiffPage> pages = file.pages();
  const std::string description = pages.front().description;
  for (TiffPage& page : pages) page.description = {};
  volumes.calibration = calibration_of(description);
  try {
    if (const auto image_j = image_j_of(description)) {
      add_image_j(file, std::move(pages), *image_j, volumes);
    } else if (const auto images = ome_images_of(description, static_cast<std::int64_t>(pages.size()))) {
      add_ome(path, std::move(pages), *images, volumes);
    } else {
      volumes.list.emplace_back();
      for (TiffPage& page : pages) volumes.list.back().planes.push_back({0, std::move(page)});
    }
  } catch (const BrokenInput& error) {
    const std::string_view why = error.what();
    throw BrokenInput(why.starts_with(path) ? std::string(why) : fmt::format("{}: {}", path, why));
  }
  for (TiffVolume& volume : volumes.list) {
    require_alike(volumes, volume);
    const TiffPage& first = volume.planes.front().page;
    volume.choice.text += fmt::format("{}{} x {} x {} {}", volume.choice.text.empty() ? "" : ": ",
                                      first.width, first.height, volume.planes.size(), name_of(first.type));
  }
  return volumes;
}

TiffVolumes volume_of_files(const std::vector<std::string>& paths) {
  TiffVolumes volumes;
  volumes.files = paths;
  volumes.list.emplace_back();
  for (std::size_t i = 0; i < paths.size(); ++i) {
    say_working();
    std::vector<TiffPage> pages = TiffFile(paths[i]).pages();
    if (pages.size() != 1)
      throw BrokenInput(
          fmt::format("{}: TIFF file: has {} pages, but is one of {} files that are a slice each", paths[i],
                      pages.size(), paths.size()));
    const auto calibration = calibration_of(pages.front().description);
    if (i == 0) volumes.calibration = calibration;
    if (calibration != volumes.calibration)
      throw BrokenInput(fmt::format(
          "{}: TIFF file: has another calibration of ImageJ than {}, so their values cannot be one volume",
          paths[i], paths.front()));
    pages.front().description = {};
    volumes.list.back().planes.push_back({i, std::move(pages.front())});
  }
  require_alike(volumes, volumes.list.front());
  return volumes;
}

std::unique_ptr<ServedVolume> open_tiff(const std::string& path, const ReaderOptions& options) {
  std::error_code unknown;
  const bool is_folder = fs::is_directory(path, unknown);
  TiffVolumes volumes = is_folder ? volumes_in_folder(path, options) : volumes_of_file(path);
  volumes.name = path;
  std::vector<Choice> choices;
  for (const TiffVolume& volume : volumes.list) choices.push_back(volume.choice);
  // In a folder, --series has named the files.
  const std::size_t number = chosen(path, "series", is_folder ? "" : option(options, "series"), choices);
  return slices_of(std::move(volumes), number);
}

}  // namespace tagrid
