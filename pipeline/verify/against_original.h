// Compares a decoded volume, or some of its rows, with the original.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/decode/decoded_rows.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/statistics.h"

namespace tagrid {

/// Compares decoded rows with the original: in any order if it can be read so, else in raster order.
class AgainstOriginal {
 public:
  /// `name` (for messages) and `parameters` are those of the file. REQUIRES: the original's size and type.
  AgainstOriginal(std::string name, const CodingParameters& parameters,
                  std::unique_ptr<VolumeSource> original);

  /// The most memory, for `row_count` rows of bricks; a double, see GridSchedule::memory().
  static double memory(const CodingParameters& parameters, std::int64_t row_count, std::int64_t threads);

  /// Takes the activity of the next brick of the rows that will be compared next.
  void add_activity(const LatticeBits& active) {
    if (parameters_.surface_error >= 0) active_.push_back(active);
  }
  /// Takes a brick of those rows, if the mesh has a bound. `values`: of the points of its closed box.
  void add_mesh(Index3 position, const LatticeBits& active, std::vector<std::byte> values) {
    meshes_.push_back({position, active, std::move(values)});
  }
  /// Adds errors to `errors`, also that of the mesh. Throws BrokenInput at the first voxel beyond its bound.
  void compare(const DecodedRows& rows, Statistics& errors);
  /// Called when everything was compared, here or elsewhere. Throws BrokenInput if the original continues.
  void finish();

 private:
  struct BrickMesh {
    Index3 position;
    LatticeBits active;
    std::vector<std::byte> values;
  };

  double mesh_error(const BrickMesh& mesh, const Box& rows) const;
  template <class T>
  void compare_slice(const T* original, const T* decoded, Statistics& errors) const;
  template <class T>
  void check_sides(T original, T decoded, std::int64_t number) const;
  Index3 point_of(std::int64_t number) const;
  bool is_active(Index3 p) const;

  std::string name_;
  CodingParameters parameters_;
  BrickGrid bricks_;
  std::unique_ptr<VolumeSource> source_;
  std::vector<LatticeBits> active_;  ///< of the bricks of the rows; only if they have a bound of their own
  std::vector<BrickMesh> meshes_;    ///< of the bricks of the rows; only if the mesh has a bound
  std::vector<std::byte> original_, decoded_;  ///< slices of the original (one or all); one slice of the file
  Box rows_;                                   ///< the rows of one slice that are compared
};

}  // namespace tagrid
