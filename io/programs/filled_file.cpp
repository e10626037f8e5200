#include "io/programs/filled_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/spool_file.h"
#include "io/files/temporaries.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"

namespace tagrid {

/// A file that another process can open by a path, and that goes.
class FilledFile::Waiting {
 public:
  Waiting(const std::string& folder, const std::string& whose)
      : file_(std::make_unique<FileForLibrary>(folder, whose)),
        slot_(FileForLibrary::has_name() ? register_temporary(path()) : -1) {}
  ~Waiting() {
    file_.reset();
    forget_temporary(slot_);
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  const std::string& path() const { return file_->path(); }
  void copy_to(OutputFile& output) const {
    const FileSource source(path());
    std::vector<std::byte> bytes(std::size_t{1} << 20);
    for (std::uint64_t position = 0, size = source.size(); position < size;) {
      const auto part = std::span(bytes).first(
          static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), size - position)));
      source.read_at(position, part);
      output.write(part);
      position += part.size();
    }
  }

 private:
  std::unique_ptr<FileForLibrary> file_;
  int slot_;
};

FilledFile::FilledFile(OutputFile& file, const std::string& path, const std::optional<std::string>& spool)
    : file_(file), name_(file.name()) {
  if (!file.can_seek()) {
    const std::string folder = spool_folder(spool, path);
    waiting_ = std::make_unique<Waiting>(folder, file.name());
    name_ += fmt::format(" (through a temporary file in {})", folder);
    path_ = waiting_->path();
    return;
  }
  path_ = text_of(absolute_path(path_of(file.temporary())));
  if (const auto status = status_of(file.temporary())) filled_ = *status;
}

FilledFile::~FilledFile() = default;

std::uint64_t FilledFile::complete() {
  if (waiting_) {
    waiting_->copy_to(file_);
    return file_.position();
  }
  const auto status = status_of(file_.temporary());
  if (!status || !status->is_same_file(filled_))
    throw WorldError(file_.name() + ": its writer removed or replaced the file that it was given to fill");
  return status->size;
}

}  // namespace tagrid
