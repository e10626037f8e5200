// The other side of the conversation: what a writer program written in C++ needs.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// What tagrid asks a writer of meshes for.
struct WriteMeshRequest {
  std::string path, name;  ///< as above
  MeshLayout mesh;
  WriterOptions options;
};

/// A file that a writer program writes.
class ServedFile {
 public:
  virtual ~ServedFile() = default;

  std::uint64_t memory = 0;  ///< bytes that all of it takes; the program's own are added
  std::vector<std::string> warnings;

  /// Completes the file. Returns what is known of it: names, and values as JSON.
  virtual std::vector<std::pair<std::string, std::string>> finish() = 0;
};

/// A volume.
class ServedOutput : public ServedFile {
 public:
  /// Takes slice z, little endian. Called for each slice, from front to back.
  virtual void write_slice(std::int64_t z, const std::byte* samples) = 0;
};

/// A mesh.
class ServedMesh : public ServedFile {
 public:
  /// Takes `count` entries of an array from entry `first` on, little endian. Called for all arrays, one after
  /// the other, and for all entries, in order. `array`: its number in MeshLayout::arrays().
  virtual void write_entries(std::size_t array, std::int64_t first, std::int64_t count,
                             const std::byte* entries) = 0;
};

/// Begin a file. They throw UsageError and WorldError.
using BeginServed = std::unique_ptr<ServedOutput> (*)(const WriteRequest& request);
using BeginServedMesh = std::unique_ptr<ServedMesh> (*)(const WriteMeshRequest& request);

/// Answers requests on the standard input until it ends. Without `begin_mesh`, the request for a mesh is
/// unknown. Returns the exit code of the program.
int serve_writer(const std::string& name, BeginServed begin, BeginServedMesh begin_mesh = nullptr);

}  // namespace tagrid
