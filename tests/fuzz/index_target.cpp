// The first two bytes of the input: the cube size, whether the rest is compressed, whether samples are
// floats, whether the mesh has a bound, and the announced size of the compressed part.
#include <vector>

#include "io/bytes/zstd_bytes.h"
#include "io/tag/index.h"
#include "stages/grid/lattice.h"
#include "tests/fuzz/targets.h"
#include "tools/report/info.h"

namespace tagrid::fuzz {
namespace {

void parse(std::span<const std::byte> fields, int cube_size, bool floats, bool mesh) {
  const IndexForm form{max_level(cube_size), floats, mesh};
  // As many pages as there would be if nothing else were there.
  const std::uint64_t none = least_directory_size(0, form), one = least_directory_size(1, form) - none;
  const auto pages = static_cast<std::int64_t>(fields.size() < none ? 0 : (fields.size() - none) / one);
  TagIndex index;
  if (!parse_directory(fields, pages, form, index).ok()) return;
  claim(std::ssize(index.pages) == pages, "an index has all pages");
  const std::vector<std::byte> again = serialize_directory(index, form);
  claim(
      !index.unknown_sections.empty() || std::equal(fields.begin(), fields.end(), again.begin(), again.end()),
      "an index is written as it was");
  TagHeader header;
  header.parameters.dims = {9, 8, 7};
  header.parameters.cube_size = cube_size;
  header.parameters.field_scale = 1;
  if (mesh) header.parameters.mesh_error = 1;
  if (floats) header.parameters.type = SampleType::float32;
  const TagSummary file = {header, index, {1, 2, 3, 4, 5, 6, 7}, {}, {}};
  claim(!info_json(file).dump().empty(), "any index can be reported");
  claim(!info_text(file).empty(), "any index can be printed");
}

}  // namespace

void index(Bytes bytes) {
  if (bytes.size() < 2) return;
  const int cube_size = 4 << (bytes[0] & 7) % 7;
  const bool floats = (bytes[0] & 16) != 0, mesh = (bytes[0] & 32) != 0;
  const auto rest = std::as_bytes(bytes.subspan(2));
  if ((bytes[0] & 8) == 0) return parse(rest, cube_size, floats, mesh);
  const std::size_t size = bytes[1] * std::size_t{8};
  std::vector<std::byte> fields, again;
  if (!zstd_decompress(rest, size, fields).ok()) return;
  claim(fields.size() == size, "as much is unpacked as was announced");
  claim(zstd_decompress(zstd_compress(fields), size, again).ok() && again == fields,
        "what was packed comes back");
  parse(fields, cube_size, floats, mesh);
}

}  // namespace tagrid::fuzz
