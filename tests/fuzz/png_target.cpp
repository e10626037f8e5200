// A PNG file.
#include "io/errors/errors.h"
#include "io/formats/png/outline.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void png(Bytes bytes) {
  const MemoryFile memory(bytes);
  try {
    const PngOutline outline = png_outline(FileSource(memory.path()));
    claim(begins_gray_png({reinterpret_cast<const char*>(bytes.data()), bytes.size()}),
          "what is read is recognised");
    claim(outline.width > 0 && outline.height > 0 && (outline.bits == 8 || outline.bits == 16),
          "an image has samples");
    claim(outline.after < bytes.size(), "the chunks are in the file");
  } catch (const BrokenInput&) {
  }
}

}  // namespace tagrid::fuzz
