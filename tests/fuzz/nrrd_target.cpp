// A volume as in a file: header, blank line, samples. A detached header is one that names the data file "d",
// once or several times: the bytes after its blank line are then given as that file.
#include <algorithm>

#include "io/errors/errors.h"
#include "io/formats/nrrd/header.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/read_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
void nrrd(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  NrrdHeader header;
  const std::size_t blank = text.find("\n\n");
  try {
    header = parse_nrrd_header(text.substr(0, blank));
    const NrrdHeader again = parse_nrrd_header(nrrd_header_text(header.info, "x.raw"));
    claim(again.info.metadata == header.info.metadata && again.info.dims == header.info.dims &&
              again.info.type == header.info.type,
          "what a header says comes back");
    to_world(header.info.geometry(), Index3{1, 2, 3});
  } catch (const BrokenInput&) {
    // The reader finds the end of a header in a different way, so it reads the header, too.
    header.data_files.clear();
  }
  if (header.data_files.empty()) {
    // A header that names its samples is skipped here: it could name any file of this machine.
    if (text.find("ile:") != text.npos || text.find("ILE:") != text.npos) return;
    read_volume(MemoryFile(bytes).path());
    if (bytes.size() <= pipe_holds) read_volume(MemoryPipe(bytes).path());
  } else if (std::ranges::all_of(header.data_files, [](const std::string& name) { return name == "d"; }) &&
             blank != text.npos) {
    static const Folder folder;
    folder.write("d", text.substr(blank + 2));
    read_volume(folder.write("h.nhdr", text.substr(0, blank + 1)));
  }
}

}  // namespace tagrid::fuzz
