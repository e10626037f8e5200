// What write_mesh() and write_surface() share: the request, and the .tag file whose grid is passed on.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/meshes/noted_file.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

template <class Options>
struct GridRun {
  std::string input;        ///< the .tag file; "-": the standard input
  std::int64_t volume = 0;  ///< its number; not 0 only in a regular file
  std::string output;  ///< its name chooses the format; "-": the standard output, in the first of the formats
  Options options = {};
  Resources resources{1};
  Progress progress = {};
};

struct GridResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;              ///< of the .tag file
  std::uint64_t bytes_out = 0;             ///< of the output
  std::vector<std::string> warnings = {};  ///< what the user should know of the output
};

/// Of a regular file, only the bricks of a region are read. From a pipe, or without a region, all come.
class GridInput {
 public:
  /// `volume`: see GridRun. `is_part`: a region is wanted. Throws UsageError if the output is in the way, BrokenInput, WorldError.
  GridInput(const std::string& path, std::int64_t volume, bool is_part, const std::string& output,
            bool overwrite);

  const TagHeader& header() const { return bricks_ ? bricks_->header() : stream_->header(); }
  const std::string& name() const { return bricks_ ? bricks_->name() : stream_->name(); }
  const TagIndex& index() const { return bricks_ ? bricks_->index() : stream_->index(); }
  std::uint64_t bytes() const { return bricks_ ? bricks_->sizes().file : stream_->sizes().file; }

  /// The space of the coordinates and the meaning of values, as far as the header has them.
  MeshNotes notes() const;
  /// The result of a run that made `output`, a MeshFile or a SurfaceFile.
  template <class File>
  GridResult result_in(const File& output) const {
    return {header(), index(), bytes(), output.file_bytes(), output.warnings()};
  }

  /// The bricks that will be passed, for this box of samples.
  Box positions(const std::optional<Box>& box) const;
  /// Throws MemoryLimit if pass_to() with a taker of so many bytes would exceed the limit.
  void check_memory(const Box& positions, std::uint64_t taker_bytes, const Resources& resources) const;
  /// See take_all() and take_some(). To be called once.
  void pass_to(GridTaker& taker, const Box& positions, std::uint64_t taker_bytes, const Resources& resources,
               const Progress& progress);

  /// The file, which has not been read yet. REQUIRES: no region is wanted.
  TagReader& stream() { return *stream_; }

 private:
  std::unique_ptr<TagBricks> bricks_;
  std::unique_ptr<TagReader> stream_;
};

}  // namespace tagrid
