// Compares a decoded volume, or some of its rows, with the original.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/verify/comparison.h"

namespace tagrid {

/// Throws BrokenInput if the original, named `name`, has another size or type than the file.
void check_original(const std::string& name, const VolumeInfo& original, const CodingParameters& parameters);

/// Compares decoded rows with the original as they arrive: in any order if the original's rows can be read in
/// any order, otherwise in raster order.
class AgainstOriginal : public Comparison {
 public:
  /// `name` and `parameters` are those of the file; the name is for messages. REQUIRES: check_original().
  AgainstOriginal(std::string name, const CodingParameters& parameters,
                  std::unique_ptr<VolumeSource> original);

  void add_activity(const LatticeBits& active) override {
    if (parameters_.surface_error >= 0) active_.push_back(active);
  }
  void add_mesh(Index3 position, const LatticeBits& active, std::vector<std::byte> values) override {
    meshes_.push_back({position, active, std::move(values)});
  }
  void compare(const DecodedRows& rows, Statistics& errors) override;
  void finish() override;

 private:
  struct BrickMesh {
    Index3 position;
    LatticeBits active;
    std::vector<std::byte> values;
  };

  double mesh_error(const BrickMesh& mesh, const Box& rows) const;
  template <class T>
  void compare_slice(const T* original, const T* decoded, Statistics& errors) const;
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
