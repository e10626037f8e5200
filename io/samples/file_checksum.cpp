#include "io/samples/file_checksum.h"

#include <vector>

#include "io/bytes/checksum.h"
#include "io/files/file_bytes.h"

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

std::uint64_t checksum_of_samples(VolumeSource& source) {
  RunningChecksum checksum;
  read_to_end(source, [&](std::span<const std::byte> samples) { checksum.add(samples); });
  return checksum.value();
}

}  // namespace tagrid
