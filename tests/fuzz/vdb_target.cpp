#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/read_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void vdb(Bytes bytes) { read_volume(MemoryFile(bytes).path()); }

}  // namespace tagrid::fuzz
