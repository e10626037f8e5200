// A NIfTI file of one part, plain or in gzip.
#include "io/errors/errors.h"
#include "io/formats/nifti/header.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/read_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void nifti(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    const NiftiHeader header = parse_nifti_header(text.substr(0, max_nifti_header_bytes));
    claim(header.volumes > 0 && sample_bytes(header.info.dims, header.info.type).has_value(),
          "a header that was accepted has volumes with a size");
    to_world(header.info.geometry(), Index3{1, 2, 3});
  } catch (const BrokenInput&) {
    // The file may be compressed.
  }
  read_volume(MemoryFile(bytes).path());
  if (bytes.size() <= pipe_holds) read_volume(MemoryPipe(bytes).path());
}

}  // namespace tagrid::fuzz
