// Meshes of tetrahedra as files. Only what is in all formats is here.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/spool_file.h"
#include "io/meshes/noted_file.h"
#include "io/meshes/sinks.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

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

  /// Passes the rescaled values of all points on, in pieces; see for_each_piece().
  template <class Use>
  void for_each_rescaled(Use use);

  SpooledMesh mesh_;

 private:
  std::int64_t largest_index_ = -1;
};

/// Calls use(first, bytes) for all entries of a spooled array, in order, in pieces of complete entries.
/// `first` is the number of the first entry of the piece.
template <class Use>
void for_each_piece(SpoolFile& array, std::size_t entry_bytes, Use use) {
  constexpr std::size_t most = std::size_t{1} << 20;
  std::vector<std::byte> piece(most / entry_bytes * entry_bytes);
  for (std::uint64_t position = 0; position < array.size(); position += piece.size()) {
    piece.resize(std::min<std::uint64_t>(piece.size(), array.size() - position));
    array.read_at(position, piece);
    use(static_cast<std::int64_t>(position / entry_bytes), std::span<const std::byte>(piece));
  }
}

template <class Use>
void MeshFile::for_each_rescaled(Use use) {
  with_sample_type(mesh_.value_type, [&](auto type) {
    using T = decltype(type);
    std::vector<std::byte> numbers;
    for_each_piece(mesh_.values, sizeof(T), [&](std::int64_t first, std::span<const std::byte> piece) {
      const std::size_t count = piece.size() / sizeof(T);
      // A piece of numbers has no more bytes than one of samples may have.
      for (std::size_t begin = 0; begin < count;) {
        const std::size_t end = std::min(count, begin + (std::size_t{1} << 16));
        numbers.resize((end - begin) * sizeof(double));
        for (std::size_t i = begin; i < end; ++i)
          store_little_endian(numbers.data() + (i - begin) * sizeof(double),
                              notes_.rescale.slope * static_cast<double>(load_little_endian<T>(
                                                         piece.data() + i * sizeof(T))) +
                                  notes_.rescale.intercept);
        use(first + static_cast<std::int64_t>(begin), std::span<const std::byte>(numbers));
        begin = end;
      }
    });
  });
}

/// The primitive of a tetrahedron (0, 1, 2: I, II, III), from its level.
inline std::byte primitive_of(std::byte level) {
  return static_cast<std::byte>(std::to_integer<unsigned>(level) % 3);
}

// The formats of meshes of tetrahedra.

/// VTK XML unstructured grids (.vtu), for ParaView and VTK.
///
/// The file has appended raw data, header_type="UInt64", little endian: Float64 points, Int64 connectivity
/// and offsets, UInt8 types (10, VTK_TETRA); point data `value` of the sample type and, if that has a slope
/// or an intercept, `rescaled` (Float64); cell data `level` and `type` (level % 3: the primitives I, II,
/// III), both UInt8.
class VtuFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

 private:
  void write_mesh() override;
  std::string head() const;
};

/// VTKHDF unstructured grids (.vtkhdf), for ParaView and VTK. The program tagrid-write-hdf5 writes them.
///
/// The arrays are those of VtuFile.
class VtkhdfFile final : public MeshFile {
 public:
  /// Throws WorldError, too, if the program is not installed.
  VtkhdfFile(const std::string& path, SampleType value_type, bool overwrite);

  /// The most bytes of memory that the program may take.
  static constexpr std::uint64_t memory_of_writer = std::uint64_t{96} << 20;

  std::uint64_t file_bytes() const override { return bytes_; }
  std::vector<std::string> warnings() const override { return warnings_; }

 private:
  void write_mesh() override;

  std::string path_, program_;
  std::uint64_t bytes_ = 0;
  std::vector<std::string> warnings_;
};

/// Binary Gmsh files of version 4.1 (.msh), for Gmsh and for solvers.
///
/// One volume with all tetrahedra; it is the physical group "volume", as some solvers want every element in a
/// group. Nodes and elements are numbered from 1 on, in the order in which they come. Node data `value`, and
/// element data `level` and `type`, are float64, which holds samples of every type exactly.
class GmshFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

  /// Both throw UsageError if there are more than the format can have.
  void add_points(std::span<const double> xyz, std::span<const std::byte> values) override;
  void add_tetrahedra(std::span<const std::int64_t> connectivity,
                      std::span<const std::uint8_t> levels) override;

 private:
  void write_mesh() override;
  void write_entities();
  void write_nodes();
  void write_elements();
  /// `pass_numbers` passes the numbers of all nodes or elements to a function.
  template <class Pass>
  void write_data(const char* section, const char* name, std::int64_t count, Pass pass_numbers);
  void write_data_of_nodes();
  void write_data_of_elements(const char* name, std::byte (*number_of)(std::byte level));
};

/// Throws UsageError if a file cannot have so many nodes, or elements: it numbers what has data with 32 bits.
void check_gmsh_count(std::int64_t count, const char* what, const std::string& name);

}  // namespace tagrid
