#include "io/system/this_process.h"

#include <cerrno>

#include "io/errors/errors.h"
#include "io/system/files.h"

namespace tagrid {

MappedFile::MappedFile(const std::string& path) {
  const Descriptor file = files().open(path, {.read = true});
  FileStatus status;
  if (file < 0 || !files().status(file, status)) throw world_error("cannot open", path, errno);
  size_ = static_cast<std::size_t>(status.size);
  if (size_ == 0) return;
  bytes_ = map(file, size_);
  if (bytes_ == nullptr) throw world_error("cannot map into memory", path, errno);
}

}  // namespace tagrid
