#include "tools/formats/hdf5/reader/memory_file.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr std::uint64_t stat_block = 512;

struct stat status_of_descriptor(int descriptor) {
  struct stat status = {};
  if (fstat(descriptor, &status) != 0) throw world_error("cannot look at", "a file in memory", errno);
  return status;
}

}  // namespace

MemoryFile::MemoryFile() : descriptor_(memfd_create("plain", MFD_CLOEXEC)) {
  if (descriptor_ < 0) throw world_error("cannot make", "a file in memory", errno);
}

MemoryFile::~MemoryFile() { close(descriptor_); }

std::string MemoryFile::path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

std::uint64_t MemoryFile::size() const {
  return static_cast<std::uint64_t>(status_of_descriptor(descriptor_).st_size);
}
std::uint64_t MemoryFile::memory() const {
  return static_cast<std::uint64_t>(status_of_descriptor(descriptor_).st_blocks) * stat_block;
}

std::string MemoryFile::bytes(std::uint64_t begin, std::uint64_t end) const {
  std::string bytes(end - begin, '\0');
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(begin + done));
    if (count <= 0) throw world_error("cannot read", "a file in memory", count < 0 ? errno : EIO);
    done += static_cast<std::size_t>(count);
  }
  return bytes;
}

}  // namespace tagrid
