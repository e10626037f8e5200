// An output whose head has counts that are known at the end only.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/output_file.h"
#include "io/files/spool_file.h"

namespace tagrid {

/// Bytes that follow a head of a fixed size. In a file, they are written to their place, and the head at the
/// end; for a pipe, they wait in a nameless temporary file.
class CountedOutput {
 public:
  /// `output` must outlive the object, and nothing has been written to it. `path`: its own.
  CountedOutput(OutputFile& output, const std::string& path, std::size_t head_bytes) : output_(output) {
    buffer_.reserve(std::size_t{1} << 16);
    if (output.can_seek())
      output.write(std::string(head_bytes, '\0'));
    else
      spool_.emplace(SpoolFile::beside(path));
  }

  void append(std::span<const std::byte> bytes) {
    if (buffer_.size() + bytes.size() > buffer_.capacity()) flush();
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  }
  /// Writes the head. What is then written to the output follows the bytes. REQUIRES: a head of the stated
  /// size. To be called once.
  void finish(std::span<const std::byte> head) {
    flush();
    if (!spool_) return output_.write_at(0, head);
    output_.write(head);
    spool_->read_back([&](std::span<const std::byte> part) { output_.write(part); });
  }

 private:
  void flush() {
    if (spool_)
      spool_->write(buffer_);
    else
      output_.write(std::span<const std::byte>(buffer_));
    buffer_.clear();
  }

  OutputFile& output_;
  std::optional<SpoolFile> spool_;
  std::vector<std::byte> buffer_;
};

}  // namespace tagrid
