// Surfaces as files. Only what is in all formats is here.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/files/output_file.h"
#include "io/meshes/mesh_notes.h"
#include "io/meshes/surface_sink.h"

namespace tagrid {

/// A file that gets its name in commit(). Data that the format wants in another order waits in nameless
/// temporary files beside it, so memory does not grow. Failures of the system are WorldErrors.
class SurfaceFile : public SurfaceSink {
 public:
  /// Throws UsageError if the output exists and `overwrite` is false.
  SurfaceFile(const std::string& path, bool overwrite) : output_(path, overwrite) {}

  /// The metadata of the file, besides its triangles. To be called before the first piece.
  void set_notes(MeshNotes notes) { notes_ = std::move(notes); }

  /// Puts the file together. To be called once, after the last piece.
  virtual void finish() = 0;
  /// Makes the file durable and gives it its name. REQUIRES: finish() was called.
  void commit() { output_.commit(); }
  /// Size of the entire file. REQUIRES: finish() was called.
  std::uint64_t file_bytes() const { return output_.position(); }
  /// What the user should know of the file, a sentence each. REQUIRES: finish() was called.
  virtual std::vector<std::string> warnings() const { return {}; }

 protected:
  OutputFile output_;
  MeshNotes notes_;
};

/// One of the formats of surfaces.
struct SurfaceFormat {
  std::string_view name;
  std::string_view extension;
  std::unique_ptr<SurfaceFile> (*create)(const std::string& path, bool overwrite);
};

std::span<const SurfaceFormat> surface_formats();

/// The format that the name of a file says; PLY for "-". Throws UsageError if it says none.
const SurfaceFormat& surface_format_of(const std::string& path);

}  // namespace tagrid
