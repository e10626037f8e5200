#include "tools/archive/tag_removal.h"

#include <fmt/format.h>

#include <memory>

#include "io/errors/errors.h"
#include "io/files/byte_source.h"
#include "io/formats/nrrd/geometry.h"
#include "io/formats/table/formats.h"
#include "io/tag/bricks.h"
#include "tools/archive/input_removal.h"

namespace tagrid {
namespace {

/// Why a file of this format cannot replace any .tag file; "" if it may.
std::string lost_by_options(const Decoding& decoding) {
  const Format& format = decoding.format;
  if (!decoding.wanted.is_all()) return "a region or a step gives only a part of the volume";
  if (decoding.vdb.tolerance > 0)
    return "--vdb-tolerance changes samples, and only the .tag file has the original ones";
  if (format.name == "raw") return "samples without a header do not record their size and type";
  if (!format.is_read() && format.read_as.empty())
    return fmt::format("tagrid cannot read {} files, so it cannot verify the output", format.name);
  return "";
}

/// What this .tag file holds and the decoded file would not; "" if that is nothing.
std::string lost_of_content(const TagBricks& file, const Format& format, Numbers wanted) {
  const CodingParameters& parameters = file.parameters();
  if (file.sizes().envelope > 0)
    return "it keeps the source files, which a decoded volume does not replace; tagrid restore restores them";
  if (parameters.mode == FileMode::grid)
    return "it stores only the grid, which a decoded volume does not replace";
  if (parameters.mesh_error >= 0) return "its mesh has a bound, which a decoded volume does not keep";
  const WrittenNumbers numbers = written_numbers(format, wanted, file.header(), &file.index());
  if (numbers.are_values() && is_float_type(numbers.rule.to))
    return fmt::format("values are rounded to {}", name_of(numbers.rule.to));
  const VolumeInfo info = numbers.info(volume_info_of(file.header()));
  if (const auto lost = losses(format, info); !lost.empty()) return lost.front();
  if (std::string lost = lost_attributes(format, info); !lost.empty()) return lost;
  // losses() looks at the pairs of other formats one by one.
  if (!format.keeps_header && !format.slices_are_alike && stripped(info.nrrd_fields) != info.nrrd_fields)
    return fmt::format("{} files have no place for all of its comments and key/value pairs", format.name);
  return "";
}

}  // namespace

std::vector<std::string> replaced_tag(const std::string& input, const std::string& output,
                                      const Decoding& decoding) {
  const char* advice = "leave out --rm";
  if (const std::string lost = lost_by_options(decoding); !lost.empty())
    throw UsageError(fmt::format("--rm: {}; {}", lost, advice));
  auto files = removable_tag(input, output, advice);
  const TagBricks file(std::make_shared<FileSource>(input));
  if (const std::string lost = lost_of_content(file, decoding.format, decoding.numbers); !lost.empty())
    throw UsageError(fmt::format("{}: --rm: {}; {}", input, lost, advice));
  return files;
}

}  // namespace tagrid
