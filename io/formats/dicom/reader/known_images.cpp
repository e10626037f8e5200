#include "io/formats/dicom/reader/known_images.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>

#include "io/files/file_attributes.h"
#include "io/files/slice_files.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Seen = std::map<std::string, std::optional<FileStatus>>;

struct Kept {
  std::string path;
  std::shared_ptr<KnownImages> images;
  Clock::time_point compared;
} kept;

bool is_as_before(const std::string& path, const std::optional<FileStatus>& was) {
  return was && is_untouched(path, *was);
}

/// How all files are now on which the images at a path depend. The times of a directory show which names it has.
Seen seen_at(const std::string& path, const ImageFiles& files) {
  Seen seen = {{path, status_of(path)}};
  std::error_code unknown;
  if (fs::is_directory(path_of(path), unknown))
    for (std::string& file : visible_files(path)) seen.emplace(std::move(file), std::nullopt);
  // A DICOMDIR names files elsewhere.
  for (const DicomFile& image : files.images) seen.emplace(image.path, std::nullopt);
  for (const UnreadableImage& image : files.unreadable) seen.emplace(image.path, std::nullopt);
  for (auto& [file, status] : seen) status = status_of(file);
  return seen;
}

/// True if no file was changed so shortly before `begin` that a later change may have the same time.
bool are_settled(const Seen& seen, std::time_t begin) {
  return std::ranges::all_of(seen, [&](const auto& file) {
    return file.second && file.second->changed.seconds + doubt_of_times < begin;
  });
}

}  // namespace

bool KnownImages::are_as_before(const DicomSeries& one) const {
  return seen.empty() || std::ranges::all_of(one.slices, [&](const DicomSlice& slice) {
           const std::string& path = files.images[slice.file].path;
           return is_as_before(path, seen.at(path));
         });
}

void forget_images() { kept = {}; }

std::shared_ptr<KnownImages> images_at(const std::string& path) {
  const auto are_same = [](const auto& file) { return is_as_before(file.first, file.second); };
  if (kept.images && kept.path == path) {
    if (Clock::now() - kept.compared < std::chrono::seconds(1)) return kept.images;
    if (std::ranges::all_of(kept.images->seen, are_same)) {
      kept.compared = Clock::now();
      return kept.images;
    }
  }
  forget_images();
  const std::time_t begin = std::time(nullptr);
  const auto images = std::make_shared<KnownImages>(KnownImages{image_files_at(path), {}});
  images->series = series_of(images->files.images);
  if (images->series.size() < 2) return images;
  if (Seen seen = seen_at(path, images->files); are_settled(seen, begin)) {
    images->seen = std::move(seen);
    kept = {path, images, Clock::now()};
  }
  return images;
}

}  // namespace tagrid
