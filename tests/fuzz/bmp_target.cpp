// A BMP file.
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/bmp/image.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void bmp(Bytes bytes) {
  const MemoryFile memory(bytes);
  const FileSource file(memory.path());
  try {
    const BmpImage image = bmp_image(file);
    claim(begins_bmp({reinterpret_cast<const char*>(bytes.data()), bytes.size()}),
          "what is read is recognised");
    const auto size = static_cast<std::size_t>(image.width * image.height);
    claim(size <= bytes.size(), "a file has all samples that it is said to have");
    std::vector<std::byte> samples(size);
    read_bmp(file, image, samples);
  } catch (const BrokenInput&) {
  }
}

}  // namespace tagrid::fuzz
