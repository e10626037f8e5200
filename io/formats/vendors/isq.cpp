// Scanco's .isq. The layout follows InsightSoftwareConsortium/ITKIOScanco (Apache-2.0), which describes it.

#include <fmt/format.h>

#include <array>
#include <string>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/vendors/vendors.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/rescale.h"
#include "io/samples/file_samples.h"
#include "io/samples/slices_in_files.h"
#include "io/text/foreign_number.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

constexpr std::size_t block = 512;

}  // namespace

bool begins_isq(std::string_view bytes) { return bytes.starts_with("CTDATA-HEADER_V1"); }

std::unique_ptr<VolumeSource> open_isq(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription&) {
  const std::string name = file->name();
  if (path == "-" || !file->size())
    throw UsageError(name + ": is a Scanco file, which can only be read from a file; save it to one first");
  const std::string header(file->peek(block));
  if (header.size() < block) throw BrokenInput(name + ": ends within its header");
  const auto number = [&](std::size_t at) {
    return load_little_endian<std::int32_t>(reinterpret_cast<const std::byte*>(header.data()) + at);
  };
  const Index3 dims{number(44), number(48), number(52)};
  if (number(16) != 3)
    throw BrokenInput(fmt::format("{}: samples of type {} are not supported, only those of type 3 (16 bits)",
                                  name, number(16)));
  if (!sample_bytes(dims, SampleType::int16) || !is_volume_size(dims))
    throw BrokenInput(
        fmt::format("{}: a volume cannot have {} samples", name, described(dims, SampleType::int16)));
  if (number(508) < 0) throw BrokenInput(fmt::format("{}: its samples begin in block {}", name, number(508)));
  const std::uint64_t offset = (static_cast<std::uint64_t>(number(508)) + 1) * block;

  SourceFacts facts;
  facts.files = {path};
  Geometry geometry;
  const std::array<std::int64_t, 3> sizes = {dims.x, dims.y, dims.z};
  std::vector<ForeignNumber> distances;
  std::vector<std::string> names;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The size of the whole axis is in micrometers.
    distances.push_back(foreign_number(number(56 + 4 * axis) / 1000.0 / static_cast<double>(sizes[axis])));
    names.push_back(fmt::format("{}: the size of axis {} in its header", name, axis + 1));
  }
  set_spacing(distances, names, NegativeSpacing::is_unknown, geometry, facts.warnings);
  if (geometry.has_spacing) geometry.units.fill("mm");
  Rescale rescale;
  if (number(88) > 1)
    rescale = {1.0 / number(88), 0, "1/cm"};
  else if (number(88) < 0)
    facts.scale_doubt = fmt::format(
        "{}: mu_scaling in its header is {}, and must be positive; what values samples mean "
        "is unknown",
        name, number(88));
  KeyValues pairs;
  add_rescale(rescale, pairs);
  std::string patient = header.substr(128, 40);
  patient.erase(std::min(patient.find('\0'), patient.size()));
  patient.erase(patient.find_last_not_of(' ') + 1);
  if (!patient.empty()) pairs.emplace_back("isq_name", patient);
  constexpr std::array<std::pair<const char*, std::size_t>, 14> fields = {{{"patient_index", 28},
                                                                           {"scanner_id", 32},
                                                                           {"slice_thickness_um", 68},
                                                                           {"slice_increment_um", 72},
                                                                           {"slice_1_pos_um", 76},
                                                                           {"min_data_value", 80},
                                                                           {"max_data_value", 84},
                                                                           {"mu_scaling", 88},
                                                                           {"nr_of_samples", 92},
                                                                           {"nr_of_projections", 96},
                                                                           {"scanner_type", 104},
                                                                           {"sampletime_us", 108},
                                                                           {"energy", 168},
                                                                           {"intensity", 172}}};
  for (const auto& [field, at] : fields)
    pairs.emplace_back(fmt::format("isq_{}", field), std::to_string(number(at)));
  facts.info = {dims, SampleType::int16, Metadata(geometry, pairs)};
  facts.rescale = rescale;
  facts.holds_other_bytes = true;
  // Files are filled up to whole blocks.
  const std::uint64_t end = offset + *sample_bytes(dims, SampleType::int16);
  SamplesPlace place{.start = offset};
  if (*file->size() > end && *file->size() - end >= block) allow_more(*file, place, facts);
  return placed_samples(std::move(facts),
                        {{0, offset, dims.z, *sample_bytes({dims.x, dims.y, 1}, SampleType::int16), false}});
}

}  // namespace tagrid
