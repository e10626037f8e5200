// A MetaImage file: header and samples. A detached header is one that names the data file "d", once or several times: the
// bytes after its last line are then given as that file.
#include <algorithm>

#include "io/errors/errors.h"
#include "io/formats/metaimage/header.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/read_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void metaimage(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::size_t end = 0;  // of the line with the data file
  while (end < text.size()) {
    const std::size_t begin = end;
    end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    if (ends_meta_image_header(text.substr(begin, end - begin))) break;
  }
  try {
    const MetaImageHeader header = parse_meta_image_header(text.substr(0, end));
    claim(sample_bytes(header.info.dims, header.info.type).has_value(),
          "a header that was accepted has a size");
    to_world(header.info.geometry(), Index3{1, 2, 3});
    if (header.data_files.empty()) {
      read_volume(MemoryFile(bytes).path());
      if (bytes.size() <= pipe_holds) read_volume(MemoryPipe(bytes).path());
    } else if (std::ranges::all_of(header.data_files, [](const std::string& name) { return name == "d"; })) {
      static const Folder folder;
      folder.write("d", text.substr(end));
      read_volume(folder.write("h.mhd", text.substr(0, end)));
    }
    // Other headers could name any file of this machine.
  } catch (const BrokenInput&) {
  }
}

}  // namespace tagrid::fuzz
