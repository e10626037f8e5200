// A decoded volume, or some rows of it, against the original.
#pragma once

#include <string>
#include <vector>

#include "io/formats/volume_reader.h"
#include "pipeline/decode/decoded_rows.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/statistics.h"

namespace tagrid {

/// Compares decoded rows with the original as they come.
class AgainstOriginal {
 public:
  /// `parameters` outlive it. `name` is that of the file, for messages. Throws BrokenInput where the original
  /// is of another size or type.
  AgainstOriginal(const std::string& name, const CodingParameters& parameters, const std::string& original,
                  const SourceDescription& source);

  /// Whether rows may come in any order; else they come in raster order, all of them.
  bool random_access() const { return reader_.random_access(); }
  /// What reading takes besides rows: see VolumeReader.
  std::uint64_t memory() const { return reader_.memory(); }
  /// See VolumeReader: from then on random_access().
  void spool(const std::string& folder) { reader_.spool(folder); }
  /// The activity of the next brick of the rows that are compared next.
  void add_activity(const LatticeBits& active) {
    if (parameters_.surface_error >= 0) active_.push_back(active);
  }
  /// Adds the errors to `errors`. Throws BrokenInput at the first voxel that is further off than it may be.
  void compare(const DecodedRows& rows, Statistics& errors);
  /// Everything was compared, here or by others. Throws BrokenInput if the original goes on.
  void finish();

 private:
  template <class T>
  void compare_slice(const T* original, const T* decoded, Statistics& errors) const;
  bool is_active(Index3 p) const;

  std::string name_;
  const CodingParameters& parameters_;
  BrickGrid bricks_;
  VolumeReader reader_;
  std::vector<LatticeBits> active_;  ///< of the bricks of the rows; only where they have a bound of their own
  std::vector<std::byte> slice_, decoded_;  ///< of the original, and of the file
  Box rows_;                                ///< of one slice, that are compared
};

}  // namespace tagrid
