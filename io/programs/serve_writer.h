// The other side of the conversation: what a writer program written in C++ needs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "io/programs/writer_conversation.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// What tagrid asks a writer for.
struct WriteRequest {
  std::string path;  ///< an empty file, which the writer fills
  std::string name;  ///< what messages call it
  VolumeInfo info;
  WriterOptions options;
};

/// A volume that a writer program writes.
class ServedOutput {
 public:
  virtual ~ServedOutput() = default;

  std::uint64_t memory = 0;  ///< bytes that all of it takes; the program's own are added
  std::vector<std::string> warnings;

  /// Takes slice z, little endian. Called for each slice, from front to back.
  virtual void write_slice(std::int64_t z, const std::byte* samples) = 0;
  /// Completes the file. Returns what is known of it: names, and values as JSON.
  virtual std::vector<std::pair<std::string, std::string>> finish() = 0;
};

/// Begins a file. Throws UsageError and WorldError.
using BeginServed = std::function<std::unique_ptr<ServedOutput>(const WriteRequest& request)>;

/// Answers requests on the standard input until it ends. Returns the exit code of the program.
int serve_writer(const std::string& name, const BeginServed& begin);

}  // namespace tagrid
