// A description of a scanner's program, or a volume of one: VGStudio, Nikon, PyHST, Scanco. The samples that the first three
// describe are 48 bytes in a file beside them.
#include "io/formats/vendors/sections.h"
#include "io/formats/vendors/vendors.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/read_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void vendors(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const auto& [key, value] : parse_sections(text))
    claim(!key.empty() && key.find('\n') == key.npos && value.find('\n') == value.npos,
          "a name and a value are of one line");
  if (begins_isq(text)) {
    read_volume(MemoryFile(bytes).path());
  } else if (begins_vgi(text) || begins_xtekct(text)) {
    // A description that names another file than "a.vol" is skipped: it could name any file of this machine.
    const auto sections = parse_sections(text);
    const auto name = sections.find("file1/name");
    if (begins_vgi(text) && (name == sections.end() || name->second != "a.vol")) return;
    static const Folder folder;
    folder.write("a.vol", std::string(48, 'x'));
    read_volume(folder.write("a.x", text));
  } else if (begins_pyhst(text)) {
    static const Folder folder;
    folder.write("a.vol", std::string(48, 'x'));
    read_volume(folder.write("a.vol.info", text));
  }
}

}  // namespace tagrid::fuzz
