// Outputs as they were written, without parity that was added since.
#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "io/bytes/checksum.h"
#include "io/files/file_bytes.h"
#include "io/parity/layout.h"
#include "io/system/files.h"
#include "tools/archive/records.h"

namespace tagrid {
namespace {

/// The output as it was written: without parity that was added since. Nullptr if there is no such file.
std::shared_ptr<const ByteSource> as_written(const KnownOutput& known, const std::string& path) {
  const auto status = status_of(path);
  if (!status || !status->is_file()) return nullptr;
  auto file = std::make_shared<FileSource>(path);
  if (file->size() == known.bytes_out) return file;
  const auto parity = parity_at_end(*file);
  return parity && parity->file_size == known.bytes_out ? beginning_of(file, known.bytes_out) : nullptr;
}

std::uint64_t checksum_of(const ByteSource& file) {
  RunningChecksum checksum;
  std::vector<std::byte> bytes(std::size_t{1} << 20);
  for (std::uint64_t position = 0; position < file.size();) {
    const auto part = std::span(bytes).first(std::min<std::uint64_t>(bytes.size(), file.size() - position));
    file.read_at(position, part);
    checksum.add(part);
    position += part.size();
  }
  return checksum.value();
}

}  // namespace

bool has_written_size(const KnownOutput& known, const std::string& path) {
  // Whoever replaces a file need not be allowed to read it.
  return is_file_of_size(path, known.bytes_out) || as_written(known, path) != nullptr;
}

bool is_as_written(const KnownOutput& known, const std::string& path) {
  const auto file = as_written(known, path);
  return file && checksum_text(checksum_of(*file)) == known.output_checksum;
}

}  // namespace tagrid
