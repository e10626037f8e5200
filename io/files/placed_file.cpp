#include "io/files/placed_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "io/files/errors.h"
#include "io/files/system_call.h"

namespace tagrid {

PlacedFile::PlacedFile(const std::string& path, std::string name) : name_(std::move(name)) {
  descriptor_ = uninterrupted([&] { return open(path.c_str(), O_WRONLY | O_CLOEXEC); });
  if (descriptor_ < 0) throw world_error("cannot open its temporary file", name_, errno);
}

PlacedFile::~PlacedFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

void PlacedFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  if (!write_all_at(descriptor_, position, bytes)) throw world_error("cannot write", name_, errno);
}

void PlacedFile::finish() {
  if (uninterrupted([&] { return fsync(descriptor_); }) != 0) throw world_error("cannot write", name_, errno);
  // Network file systems report some failed writes only in close().
  if (close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR)
    throw world_error("cannot write", name_, errno);
}

}  // namespace tagrid
