// Meshes of the grid as files. Only what is in all formats is here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/files/spool_file.h"
#include "io/meshes/noted_file.h"
#include "io/meshes/sinks.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

struct MeshContents;
class Hdf5MeshWriter;

/// The arrays of a mesh, little endian, in nameless temporary files until their sizes are known: 24 bytes and
/// a sample per point, 33 bytes per tetrahedron.
struct SpooledMesh {
  SpooledMesh(const std::string& path, SampleType type_of_values)
      : value_type(type_of_values),
        coordinates(SpoolFile::beside(path)),
        values(SpoolFile::beside(path)),
        connectivity(SpoolFile::beside(path)),
        levels(SpoolFile::beside(path)) {}

  SampleType value_type;
  SpoolFile coordinates;   ///< of points, x y z: float64
  SpoolFile values;        ///< of points
  SpoolFile connectivity;  ///< four points of each tetrahedron, from 0 on: int64
  SpoolFile levels;        ///< of tetrahedra: uint8
  std::int64_t points = 0, tetrahedra = 0;
};

/// A file of tetrahedra.
class MeshFile : public NotedFile, public MeshSink {
 public:
  /// Throws UsageError if the output exists and `overwrite` is false.
  MeshFile(const std::string& path, SampleType value_type, bool overwrite)
      : NotedFile(path, overwrite), mesh_(path, value_type) {}

  void add_points(std::span<const double> xyz, std::span<const std::byte> values) override;
  void add_tetrahedra(std::span<const std::int64_t> connectivity,
                      std::span<const std::uint8_t> levels) override;

  std::int64_t point_count() const { return mesh_.points; }
  std::int64_t tetrahedron_count() const { return mesh_.tetrahedra; }

  /// REQUIRES: all indices are those of points.
  void finish() final;

 protected:
  /// Writes all of `mesh_`.
  virtual void write_mesh() = 0;

  /// What the file has: `value` and perhaps `rescaled` of points; `level` and `type` of cells.
  MeshContents contents();

  SpooledMesh mesh_;

 private:
  std::int64_t largest_index_ = -1;
};

// The formats of meshes of the grid.

/// VTK XML unstructured grids (.vtu), for ParaView and VTK; see write_vtu().
///
/// Point data `value` of the sample type and, if that has a slope or an intercept, `rescaled` (Float64); cell
/// data `level` and `type` (level % 3: the primitives I, II, III), both UInt8.
class VtuFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

 private:
  void write_mesh() override;
};

/// VTKHDF unstructured grids (.vtkhdf), for ParaView and VTK. The program tagrid-write-hdf5 writes them.
///
/// The arrays are those of VtuFile.
class VtkhdfFile final : public MeshFile {
 public:
  /// Throws WorldError, too, if the program is not installed.
  VtkhdfFile(const std::string& path, SampleType value_type, bool overwrite);
  ~VtkhdfFile() override;

  std::uint64_t file_bytes() const override;
  std::vector<std::string> warnings() const override;

 private:
  void write_mesh() override;

  std::unique_ptr<Hdf5MeshWriter> hdf5_;
};

/// Binary Gmsh files of version 4.1 (.msh), for Gmsh and for solvers; see write_gmsh().
///
/// One volume with all tetrahedra; it is the physical group "volume", as some solvers want every element in a
/// group. Node data `value`, and element data `level` and `type`, are float64, which holds samples of every
/// type exactly.
class GmshFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

  /// Both throw UsageError if there are more than the format can have.
  void add_points(std::span<const double> xyz, std::span<const std::byte> values) override;
  void add_tetrahedra(std::span<const std::int64_t> connectivity,
                      std::span<const std::uint8_t> levels) override;

 private:
  void write_mesh() override;
};

}  // namespace tagrid
