// Tetrahedral meshes as VTK XML unstructured grids (.vtu), for ParaView and VTK.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "io/files/output_file.h"
#include "io/files/spool_file.h"
#include "io/mesh/mesh_sink.h"
#include "stages/volume/sample_type.h"

namespace tagrid {

/// Streams a mesh of tetrahedra to a .vtu file, with only a few buffers in memory: data that VTK needs in
/// separate arrays waits in nameless temporary files beside the output (about 32 bytes per point and 33 per
/// tetrahedron).
///
/// The file has appended raw data, header_type="UInt64", little endian: Float64 points, Int64 connectivity
/// and offsets, UInt8 types (10, VTK_TETRA); point data `value` of the sample type; cell data `level` and
/// `type` (level % 3: the primitives I, II, III), both UInt8. It gets its name only in commit().
///
/// Failures of the system are WorldErrors; UsageError if the output exists and `overwrite` is false.
class VtuWriter : public MeshSink {
 public:
  VtuWriter(const std::string& path, SampleType value_type, bool overwrite);

  void add_points(std::span<const double> xyz, std::span<const std::byte> values) override;
  void add_tetrahedra(std::span<const std::int64_t> connectivity,
                      std::span<const std::uint8_t> levels) override;

  std::int64_t point_count() const { return points_; }
  std::int64_t tetrahedron_count() const { return tetrahedra_; }

  /// Puts the file together. Call it once, after the last tetrahedron. REQUIRES: all indices are those of
  /// points.
  void finish();
  /// Makes the file durable and gives it its name. REQUIRES: finish() was called.
  void commit() { output_.commit(); }
  /// Size of the whole file. REQUIRES: finish() was called.
  std::uint64_t file_bytes() const { return output_.position(); }

 private:
  std::string head() const;

  SampleType value_type_;
  OutputFile output_;
  SpoolFile coordinates_, values_, connectivity_, levels_;
  std::int64_t points_ = 0, tetrahedra_ = 0;
  std::int64_t largest_index_ = -1;
};

}  // namespace tagrid
