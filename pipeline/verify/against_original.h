// Compares a decoded volume, or some of its rows, with the original.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/verify/comparison.h"

namespace tagrid {

/// Compares decoded rows with the original as they arrive.
class AgainstOriginal : public Comparison {
 public:
  /// `parameters` must outlive this. `name` is that of the file, for messages. Throws BrokenInput if the
  /// original has another size or type.
  AgainstOriginal(const std::string& name, const CodingParameters& parameters, const std::string& original,
                  const SourceDescription& source);

  /// True if rows may come in any order; otherwise all of them must come in raster order.
  bool random_access() const { return source_->traits().any_rows; }
  /// Memory for reading besides rows; see SourceTraits.
  std::uint64_t memory() const { return source_->traits().memory; }
  /// Copies the original to a temporary file; after this, random_access() is true.
  void spool(const std::string& folder);
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
  const CodingParameters& parameters_;
  BrickGrid bricks_;
  std::unique_ptr<VolumeSource> source_;
  std::vector<LatticeBits> active_;  ///< of the bricks of the rows; only if they have a bound of their own
  std::vector<BrickMesh> meshes_;    ///< of the bricks of the rows; only if the mesh has a bound
  std::vector<std::byte> original_, decoded_;  ///< slices of the original (one or all); one slice of the file
  Box rows_;                                   ///< the rows of one slice that are compared
};

}  // namespace tagrid
