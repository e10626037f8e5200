#include "tools/formats/dicom/said_of_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "io/errors/errors.h"
#include "tools/formats/dicom/decoder.h"
#include "tools/formats/dicom/pixel_element.h"

namespace tagrid {
namespace {

std::string file_name(const DicomFile& file) { return std::filesystem::path(file.path).filename().string(); }

struct Said {
  const DicomNote* note;
  const DicomFile* first;
  std::size_t files;
};

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
      where = said.files == 1 ? fmt::format(" ({})", file_name(*said.first))
                              : fmt::format(" ({} and {} more)", file_name(*said.first), said.files - 1);
    else if (files.size() > 1)
      where = fmt::format(" ({} and all others)", file_name(*said.first));
    texts.push_back(fmt::format("{}: {}{}", name, said.note->text, where));
  }
  return texts;
}

void note_more_inflated_frames(DicomFile& file) {
  const std::uint64_t wanted = file.frames.size() * file.pixels.frame_bytes(),
                      bytes = DicomDecoder(file).bytes_of_samples();
  if (bytes < wanted)
    throw BrokenInput(fmt::format(
        "{}: DICOM file: its pixels have {} bytes, but {} x {} samples of {} bits in {} frames have {}",
        file.path, bytes, file.pixels.columns, file.pixels.rows, file.pixels.allocated, file.frames.size(),
        wanted));
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
                                    name, file_name(file), file.concatenated,
                                    file.concatenated - found->second,
                                    file.concatenated - found->second == 1 ? "is" : "are"));
      parts.erase(found);
    }
  return texts;
}

}  // namespace tagrid
