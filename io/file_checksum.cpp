#include "io/file_checksum.h"

#include <vector>

#include "io/checksum.h"
#include "io/file_bytes.h"

namespace tagrid {

std::uint64_t checksum_of_file(const std::string& path) {
  FileBytes file(path);
  RunningChecksum checksum;
  std::vector<std::byte> bytes(std::size_t{1} << 20);
  for (;;) {
    const std::size_t count = file.read(bytes.data(), bytes.size());
    checksum.add({bytes.data(), count});
    if (count < bytes.size()) return checksum.value();
  }
}

}  // namespace tagrid
