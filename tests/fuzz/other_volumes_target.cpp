// A volume whose header and samples are one file, of a format that has no target of its own: NumPy, MRC, EDF, VFF, AmiraMesh.
#include <algorithm>
#include <array>

#include "io/errors/errors.h"
#include "io/formats/amira/mesh_file.h"
#include "io/formats/mrc/map.h"
#include "io/formats/npy/array.h"
#include "io/formats/table/formats.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/read_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
namespace {

/// Any bytes are a header or are refused.
template <class Parse>
void parse(Parse header_of) {
  try {
    const auto header = header_of();
    claim(sample_bytes(header.info.dims, header.info.type).has_value(),
          "a header that was accepted has a size");
    to_world(header.info.geometry(), Index3{1, 2, 3});
  } catch (const BrokenInput&) {
  }
}

}  // namespace

void other_volumes(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  parse([&] { return parse_mrc_header(text); });
  parse([&] { return parse_amira_header(text); });
  try {
    const NpyHeader header = parse_npy_header(text);
    claim(header.volumes > 0 && sample_bytes(header.dims, header.type).has_value(),
          "a header that was accepted has volumes with a size");
  } catch (const BrokenInput&) {
  }
  // Headers of other formats could name any file of this machine.
  constexpr std::array names = {"npy", "mrc", "edf", "vff", "amira"};
  const Format* format = format_of(text.substr(0, bytes_to_recognize()));
  if (format == nullptr || std::ranges::find(names, format->name) == names.end()) return;
  read_volume(MemoryFile(bytes).path());
  if (bytes.size() <= pipe_holds) read_volume(MemoryPipe(bytes).path());
}

}  // namespace tagrid::fuzz
