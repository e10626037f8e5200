#include "io/formats/nrrd/text_header.h"

#include <set>

#include "io/errors/errors.h"
#include "io/samples/data_files.h"
#include "io/samples/slices_in_files.h"

namespace tagrid {

std::string read_header_text(FileBytes& file, const TextHeaderFormat& format) {
  std::string text;
  for (std::size_t line_start = 0;; line_start = text.size()) {
    if (!file.read_line(text, format.most_bytes - text.size()))
      throw BrokenInput("{}: the {} header does not end within {} bytes", file.name(), format.name,
                        format.most_bytes);
    const std::string_view line = std::string_view(text).substr(line_start);
    if (line.empty() || format.is_last(line)) return text;
  }
}

PlainFile plain_header(const std::string& path, const TextHeaderFormat& format,
                       std::optional<std::uint64_t> end) {
  FileBytes file(path);
  const std::string text = read_header_text(file, format);
  return {path,
          true,
          {PlainPiece::given(format.plain(text)),
           PlainPiece::stretch(0, file.position(), end.value_or(file.size().value_or(0)))}};
}

std::unique_ptr<VolumeSource> open_data_files(const TextHeaderFormat& format, SourceFacts facts,
                                              const std::string& path, const std::string& header_name,
                                              std::uint64_t header_bytes,
                                              const std::vector<std::string>& data_files, bool outside_ok,
                                              const OpenSamples& open) {
  std::set<std::string> known;  // a file may be named twice
  for (const std::string& name : data_files)
    if (const std::string file = path_of_data_file(path, name); known.insert(file).second)
      facts.files.push_back(file);
  require_inside(path, {known.begin(), known.end()}, outside_ok, facts.warnings);
  // Two copies of the header, and two of each path.
  for (const std::string& file : known) facts.traits.memory += 4 * (file.size() + 2 * sizeof file);
  if (data_files.size() == 1) {
    auto file = open_data_file(facts.files.back(), data_files.front(), header_name, format.name);
    return open(std::move(file), std::move(facts), header_bytes);
  }
  const auto count = static_cast<std::int64_t>(data_files.size());
  VolumeInfo part = facts.info;
  part.dims.z /= count;
  return joined(std::move(facts), count, [=](std::int64_t i) {
    const std::string& name = data_files[static_cast<std::size_t>(i)];
    const std::string file = path_of_data_file(path, name);
    SourceFacts of_part;
    of_part.info = part;
    of_part.files = {file};
    return open(open_data_file(file, name, header_name, format.name), std::move(of_part),
                i == 0 ? header_bytes : 0);
  });
}

}  // namespace tagrid
