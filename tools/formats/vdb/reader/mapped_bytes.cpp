#include "tools/formats/vdb/reader/mapped_bytes.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "io/errors/errors.h"

namespace tagrid {

MappedBytes::MappedBytes(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status = {};
  if (file < 0 || fstat(file, &status) != 0) {
    const int error = errno;
    if (file >= 0) close(file);
    throw world_error("cannot open", path, error);
  }
  size_ = static_cast<std::size_t>(status.st_size);
  bytes_ = size_ > 0 ? mmap(nullptr, size_, PROT_READ, MAP_SHARED, file, 0) : nullptr;
  const int error = errno;
  close(file);
  if (bytes_ == MAP_FAILED) throw world_error("cannot map into memory", path, error);
  auto* begin = static_cast<char*>(bytes_);
  setg(begin, begin, begin + size_);
}

MappedBytes::~MappedBytes() {
  if (bytes_ != nullptr) munmap(bytes_, size_);
}

MappedBytes::pos_type MappedBytes::seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode) {
  const off_type begin = from == std::ios::beg   ? 0
                         : from == std::ios::cur ? gptr() - eback()
                                                 : egptr() - eback();
  const auto size = static_cast<off_type>(size_);
  if (offset < -begin || offset > size - begin) return pos_type(off_type(-1));
  setg(eback(), eback() + begin + offset, egptr());
  return {begin + offset};
}

MappedBytes::pos_type MappedBytes::seekpos(pos_type position, std::ios::openmode which) {
  return seekoff(position, std::ios::beg, which);
}

}  // namespace tagrid
