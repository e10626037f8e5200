#include "io/formats/dicom/reader/image_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/programs/serve_reader.h"
#include "io/programs/words.h"
#include "io/system/files.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_named = 5;  // in a message
constexpr std::array extensions_of_dicom = {".dcm", ".dicom", ".ima"};

/// The extension in lower case; "" for one of digits, as names that are UIDs have.
std::string usual_extension(const std::string& path) {
  std::string extension = extension_of(path);
  const bool is_number = std::ranges::all_of(extension, [](char c) { return c == '.' || is_digit(c); });
  return is_number ? "" : extension;
}

/// The names of images, as far as others may be like them.
struct NamesOfImages {
  std::set<std::string> patterns, extensions;

  void add(const std::string& path) {
    if (std::string pattern = number_pattern(file_name(path)); pattern.find('#') != pattern.npos)
      patterns.insert(std::move(pattern));
    if (std::string extension = usual_extension(path); !extension.empty())
      extensions.insert(std::move(extension));
  }
  bool have_pattern_of(const std::string& path) const {
    return patterns.contains(number_pattern(file_name(path)));
  }
  bool are_like(const std::string& path) const {
    const std::string extension = usual_extension(path);
    return have_pattern_of(path) || extensions.contains(extension) ||
           std::ranges::find(extensions_of_dicom, extension) != extensions_of_dicom.end();
  }
};

NamesOfImages names_of(const std::vector<DicomFile>& images) {
  NamesOfImages names;
  for (const DicomFile& image : images) names.add(image.path);
  return names;
}

/// Reads the headers of these files. Names of those without an image that are not of DICOM go to `strangers`.
ImageFiles images_of(const std::vector<std::string>& paths, std::vector<std::string>& strangers) {
  ImageFiles files;
  for (const std::string& path : paths) {
    say_working();
    if (!status_of(path)) {
      strangers.push_back(path);
      continue;
    }
    try {
      auto image = read_dicom_file(path);
      if (!image)
        strangers.push_back(path);
      else if (image->frames.empty())
        files.others.push_back(file_name(path));
      else
        files.images.push_back(std::move(*image));
    } catch (const BrokenDicomFile& broken) {
      files.unreadable.push_back({path, broken.why, broken.series});
    }
  }
  return files;
}

UnreadableImage no_dicom(const std::string& path) {
  std::error_code unknown;
  if (!status_of(path)) return {path, "is a broken symbolic link", ""};
  return {path, fs::file_size(path_of(path), unknown) == 0 ? "is empty" : "is not a DICOM file", ""};
}

/// The images that a directory names. Each of its files should be one.
ImageFiles images_of_directory(const std::vector<std::string>& paths) {
  std::vector<std::string> strangers;
  ImageFiles files = images_of(paths, strangers);
  for (const std::string& path : strangers) files.unreadable.push_back(no_dicom(path));
  return files;
}

ImageFiles images_in_folder(const std::string& folder) {
  std::vector<std::string> paths, strangers;
  std::string directory;
  for (const std::string& file : visible_files(folder))
    if (lower_case(file_name(file)) == "dicomdir")
      directory = file;
    else
      paths.push_back(file);
  ImageFiles files = images_of(paths, strangers);
  // Beside a directory, there is often a text to read first.
  if (files.images.empty() && files.unreadable.empty() && !directory.empty())
    if (const auto listed = files_of_dicomdir(directory)) return images_of_directory(*listed);
  const NamesOfImages names = names_of(files.images);
  for (const std::string& path : strangers)
    if (names.are_like(path))
      files.unreadable.push_back(no_dicom(path));
    else
      files.others.push_back(file_name(path));
  if (!directory.empty()) files.others.push_back(file_name(directory));
  std::ranges::sort(files.unreadable, comes_before, &UnreadableImage::path);
  std::ranges::sort(files.others, comes_before);
  return files;
}

ImageFiles images_of_file(const std::string& path) {
  if (const auto listed = files_of_dicomdir(path)) return images_of_directory(*listed);
  std::vector<std::string> strangers;
  return images_of({path}, strangers);
}

/// "a.dcm (is empty), b.dcm (...) and 3 more".
std::string with_reasons(const std::vector<UnreadableImage>& images) {
  std::vector<std::string> names;
  for (const UnreadableImage& image : images)
    names.push_back(fmt::format("{} ({})", file_name(image.path), image.why));
  return listed(names, most_named);
}

/// The name of another image of the series of `image`, in its folder; "" if none of the files whose names are
/// like its name is one. Looks into few of them.
std::string sibling_of(const DicomFile& image) {
  constexpr std::size_t most_looks = 8;
  if (image.series.empty() || image.instance.empty()) return "";
  const NamesOfImages like = names_of({image});
  const fs::path folder = path_of(image.path).parent_path();
  std::size_t looks = 0;
  for (const std::string& path : visible_files(folder.empty() ? "." : text_of(folder))) {
    const bool is_itself = file_name(path) == file_name(image.path);
    if (is_itself || !like.are_like(path) || !status_of(path) || looks++ >= most_looks) continue;
    try {
      const auto other = read_dicom_file(path);
      if (other && !other->frames.empty() && other->series == image.series &&
          other->instance != image.instance)
        return file_name(path);
    } catch (const Error&) {
      continue;  // a broken file says nothing about this one
    }
  }
  return "";
}

/// Leaves out the slices whose files are cut within their pixels, and returns these files.
std::vector<UnreadableImage> leave_out_cut(DicomSeries& series, const std::vector<DicomFile>& images) {
  std::vector<UnreadableImage> cut;
  const auto is_cut = [&](const DicomSlice& slice) { return images[slice.file].pixels.is_cut; };
  if (std::ranges::all_of(series.slices, is_cut)) return cut;  // then the first one is the error
  for (const DicomSlice& slice : series.slices)
    if (const DicomFile& image = images[slice.file]; is_cut(slice) && slice.frame == 0)
      cut.push_back({image.path, image.pixels.unsupported, image.series});
  std::erase_if(series.slices, is_cut);
  return cut;
}

/// Says that a file is a slice of a larger volume; "" if it is not.
std::string about_siblings(const std::string& path, const DicomSeries& series,
                           const std::vector<DicomFile>& images) {
  std::error_code unknown;
  const DicomFile& image = images[series.slices.front().file];
  if (series.slices.size() > 1 || image.path != path || fs::is_directory(path_of(path), unknown)) return "";
  const std::string sibling = sibling_of(image);
  if (sibling.empty()) return "";
  return fmt::format(
      "{}: is one image of a series, and {} is another one; give their directory to read all of them", path,
      sibling);
}

}  // namespace

bool may_be_of_series(std::string_view own, std::string_view other) {
  NamesOfImages names;
  names.add(std::string(own));
  return names.are_like(std::string(other));
}

ImageFiles image_files_at(const std::string& path) {
  std::error_code unknown;
  ImageFiles files = fs::is_directory(path_of(path), unknown) ? images_in_folder(path) : images_of_file(path);
  if (!files.images.empty()) return files;
  if (files.unreadable.empty()) throw BrokenInput(path + ": has no DICOM image");
  const UnreadableImage& first = files.unreadable.front();
  throw BrokenInput("{}: DICOM file: {}", first.path, first.why);
}

std::vector<UnreadableImage> unreadable_in(const DicomSeries& series, const ImageFiles& files) {
  if (files.unreadable.empty()) return {};
  const std::string& uid = files.images[series.slices.front().file].series;
  const NamesOfImages all = names_of(files.images);
  NamesOfImages own;
  for (const DicomSlice& slice : series.slices) own.add(files.images[slice.file].path);
  std::vector<UnreadableImage> in_series;
  for (const UnreadableImage& one : files.unreadable) {
    const bool may_be = !one.series.empty()             ? one.series == uid
                        : all.have_pattern_of(one.path) ? own.have_pattern_of(one.path)
                                                        : true;
    if (may_be) in_series.push_back(one);
  }
  return in_series;
}

std::vector<std::string> warnings_about(const std::string& path, const ImageFiles& files, DicomSeries& series,
                                        bool gaps_ok) {
  std::vector<std::string> warnings;
  std::vector<UnreadableImage> missing = unreadable_in(series, files);
  if (!missing.empty() && !gaps_ok)
    throw BrokenInput(fmt::format("{}: {} cannot be read and may belong to series {}: {}", path,
                                  counted(missing.size(), "file"),
                                  files.images[series.slices.front().file].series, with_reasons(missing)),
                      Problem::slices_missing);
  if (gaps_ok) {
    const std::vector<UnreadableImage> cut = leave_out_cut(series, files.images);
    missing.insert(missing.end(), cut.begin(), cut.end());
  }
  if (!missing.empty())
    warnings.push_back(fmt::format("{}: {} cannot be read, and the volume is without {}: {}", path,
                                   counted(missing.size(), "file"), missing.size() == 1 ? "it" : "them",
                                   with_reasons(missing)));
  // Those of other series are reported when these are read.
  std::vector<UnreadableImage> of_none = files.unreadable;
  std::erase_if(of_none, [&](const UnreadableImage& image) {
    return image.series.empty() || std::ranges::any_of(files.images, [&](const DicomFile& other) {
             return other.series == image.series;
           });
  });
  if (!of_none.empty())
    warnings.push_back(fmt::format("{}: {} cannot be read: {}", path, counted(of_none.size(), "other file"),
                                   with_reasons(of_none)));
  if (!files.others.empty())
    warnings.push_back(fmt::format("{}: {} {}: {}", path, counted(files.others.size(), "file"),
                                   files.others.size() == 1 ? "is not a DICOM image" : "are not DICOM images",
                                   listed(files.others, most_named)));
  if (std::string text = about_siblings(path, series, files.images); !text.empty())
    warnings.push_back(std::move(text));
  return warnings;
}

}  // namespace tagrid
