#include "io/meshes/counted_output.h"

namespace tagrid {

CountedOutput::CountedOutput(OutputFile& output, const std::string& path, std::size_t head_bytes)
    : output_(output) {
  buffer_.reserve(std::size_t{1} << 16);
  if (output.can_seek())
    output.write(std::string(head_bytes, '\0'));
  else
    spool_.emplace(SpoolFile::beside(path));
}

void CountedOutput::flush() {
  if (spool_)
    spool_->write(buffer_);
  else
    output_.write(std::span<const std::byte>(buffer_));
  buffer_.clear();
}

void CountedOutput::finish(std::span<const std::byte> head) {
  flush();
  if (!spool_) return output_.write_at(0, head);
  output_.write(head);
  spool_->read_back([&](std::span<const std::byte> part) { output_.write(part); });
}

}  // namespace tagrid
