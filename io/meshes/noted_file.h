// What files of meshes and of surfaces have in common.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "io/files/output_file.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// The metadata of a file, besides its arrays.
struct MeshNotes {
  /// The coordinate system of the points: "LPS", "RAS", or as the source names another one, in letters that
  /// every format can hold; "" if it is not known.
  std::string space;
  Rescale rescale = {};  ///< what the values of points mean
  double spacing = 1;    ///< the smallest distance between samples, in units of the points

  bool has_rescale() const { return rescale.slope != 1 || rescale.intercept != 0; }
};

/// "SPACE=LPS", for comments and headers: 3D Slicer looks for such a text. "" if the space is not known.
inline std::string space_comment(const MeshNotes& notes) {
  return notes.space.empty() ? "" : "SPACE=" + notes.space;
}

/// A file that gets its name in commit(). Memory does not grow with the mesh: data that the format wants in
/// another order waits in nameless temporary files beside it. Failures of the system are WorldErrors.
class WholeFile {
 public:
  /// Throws UsageError if the output exists and `overwrite` is false.
  WholeFile(const std::string& path, bool overwrite) : output_(path, overwrite) {}
  virtual ~WholeFile() = default;
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  /// Makes the file durable and gives it its name. REQUIRES: it is complete.
  virtual void commit() { output_.commit(); }
  /// Size of the entire file. REQUIRES: it is complete.
  virtual std::uint64_t file_bytes() const { return output_.position(); }
  /// What the user should know of the file, a sentence each. REQUIRES: it is complete.
  virtual std::vector<std::string> warnings() const { return {}; }

 protected:
  OutputFile output_;
};

/// A file that is made of pieces.
class NotedFile : public WholeFile {
 public:
  using WholeFile::WholeFile;

  /// To be called before the first point. If values have a slope or an intercept, a mesh gets an array
  /// `rescaled`, too.
  void set_notes(MeshNotes notes) { notes_ = std::move(notes); }

  /// Puts the file together. Call it once, after the last tetrahedron or triangle.
  virtual void finish() = 0;

 protected:
  MeshNotes notes_;
};

}  // namespace tagrid
