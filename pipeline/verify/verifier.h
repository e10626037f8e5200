// The checks of a verification, for any rows of bricks.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/tag/blocks.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/tag/header.h"
#include "io/volume/volume_info.h"
#include "pipeline/decode/graph.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verify.h"
#include "stages/brick/closed_samples.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/statistics.h"

namespace tagrid {

/// A face of which only one brick was seen: `below`, or the brick after it along `axis`.
struct OpenFace {
  std::int64_t below = 0;
  int axis = 0;
  std::uint64_t checksum = 0;  ///< XXH3 of the content that must be equal on both sides
};

/// Compares the low faces of every brick with those of the bricks below: the activity and, in a file without
/// voxels, the values of the active points. Holds one layer of bricks.
class SharedFaces {
 public:
  explicit SharedFaces(const CodingParameters& parameters)
      : bricks_(parameters.bricks()), size_(size_of(parameters.type)) {}

  /// The most memory, as a double: see AgainstOriginal::memory().
  static double memory(const CodingParameters& parameters);

  /// The first point on which `brick` disagrees with an earlier one. Bricks, all or some, come in order.
  std::optional<Index3> first_difference(const DecodedBrick& brick);
  /// The faces that have not been compared yet.
  std::vector<OpenFace> open_faces() const;

 private:
  struct Face {
    LatticeBits active;
    std::vector<std::byte> points;  ///< of the box of `active`; empty in a file with voxels
  };
  Face cut(const DecodedBrick& brick, const Box& face) const;
  static std::uint64_t checksum(const Face& face);
  static std::optional<Index3> compare(const Face& a, const Face& b, std::size_t sample_size);

  BrickGrid bricks_;
  std::size_t size_;
  std::map<std::pair<std::int64_t, int>, Face> high_faces_;  ///< by brick and axis
  std::vector<OpenFace> open_low_faces_;
};

/// Two bricks that disagree on the face that they share.
struct Disagreement {
  std::int64_t below = 0, above = 0;
};

/// Compares the open faces of all parts of a volume.
class OpenFacePairs {
 public:
  explicit OpenFacePairs(const BrickGrid& bricks) : bricks_(bricks) {}

  /// Parts come in any order.
  void add(const std::vector<OpenFace>& faces);
  /// The first of all added bricks that disagrees with an earlier one. REQUIRES: all parts were added.
  std::optional<Disagreement> first_difference() const;

 private:
  BrickGrid bricks_;
  std::map<std::pair<std::int64_t, int>, std::uint64_t> waiting_;  ///< checksums, by brick and axis
  std::optional<Disagreement> first_;
};

/// Results for some bricks that are correct by themselves.
struct Findings {
  Statistics counted;  ///< active points and samples, and the errors against the original if there is one
  /// False if active points were not counted: bricks do not have the grid, and computing it needs more memory.
  bool has_points = true;
  std::vector<OpenFace> open_faces;
};

/// Compares the values of decoded bricks with the statistics in the index. Both come in the order of the bricks,
/// whichever is first, from two threads. Holds what waits: a stream has a page behind its bricks.
class RangesAndIndex {
 public:
  /// The most memory for a file of so many bricks, as a double: see AgainstOriginal::memory().
  static double memory(double bricks, std::int64_t bricks_in_flight);

  void add(const ValueRange& range);
  void add(std::span<const IndexEntry> entries);

  /// The bricks that were compared.
  std::int64_t compared() const { return compared_; }
  /// The largest error that is needed for them, and the first brick that needs it, counted from 0.
  double least_error() const { return least_error_; }
  std::int64_t worst() const { return worst_; }

 private:
  void compare();

  std::mutex mutex_;
  std::deque<ValueRange> ranges_;
  std::deque<IndexEntry> entries_;
  std::int64_t compared_ = 0, worst_ = 0;
  double least_error_ = 0;
};

/// Plans how a file is verified. `any_order`: rows of the original can be read so. `besides`: memory of the reader of
/// an original. Throws as plan_decoding() does.
DecodePlan plan_verifying(const CodingParameters& parameters, const Resources& resources,
                          bool any_order = true, std::uint64_t besides = 0);

/// What verifying a file takes besides the file.
struct VerifySetup {
  DecodePlan plan;
  std::unique_ptr<AgainstOriginal> against = nullptr;  ///< comparison with an original; null if there is none
  bool any_order = true;                               ///< rows may be compared in any order
  bool again = false;                                  ///< the original can be read once more
  Metadata metadata_of_original = {};
  bool is_original_headerless = false;  ///< it has no place for a scale of values
};

/// Opens the original of the file `name`, if one is given, and plans how the file is verified. The
/// envelope takes `of_envelope` bytes of memory. Throws as verify_file() does.
VerifySetup verify_setup(const std::string& name, const TagHeader& header,
                         const std::optional<std::string>& original, const SourceDescription& source,
                         const Resources& resources, std::uint64_t of_envelope = 0);

/// The same with an original that is open, without what only its file tells.
VerifySetup setup_against(const std::string& name, const CodingParameters& parameters,
                          std::unique_ptr<VolumeSource> original, const Resources& resources,
                          std::uint64_t besides = 0);

/// The checks of the bricks of a file, whose header was checked when it was opened. The checksum of every
/// brick is checked with that of the brick before it, so that all parts together check the entire chain.
class Verifier {
 public:
  /// Reads a file front to back, once: all rows at once. add_page() must be called for each page of the index.
  /// `reader` must outlive the verifier.
  Verifier(TagReader& reader, VerifySetup setup)
      : reader_(&reader), header_(reader.header()), index_(reader.index()), setup_(std::move(setup)) {}
  /// Reads rows of bricks in any order, and compares with `index`, which is that of the file. Both must outlive the
  /// verifier. REQUIRES: setup.any_order.
  Verifier(const TagBricks& file, const TagIndex& index, VerifySetup setup)
      : file_(&file), header_(file.header()), index_(index), setup_(std::move(setup)) {}
  Verifier(const Verifier&) = delete;
  Verifier& operator=(const Verifier&) = delete;

  const CodingParameters& parameters() const { return header_.parameters; }

  /// Verifies the bricks of `rows`. Opens these and, for a part of the volume whose mesh is measured or whose
  /// grid is derived, rows around them; of all of the volume, bricks are opened once. The index is complete
  /// after the bricks of `rows` were read. The caller checks what depends on other bricks, using the
  /// findings. Throws BrokenInput at the first error.
  Findings verify(const BrickRows& rows, Watch& watch);

  /// The entries of the next page of the index.
  void add_page(std::span<const IndexEntry> entries) { ranges_.add(entries); }

  /// Call this when all bricks have been verified, here or elsewhere. `counted` is the sum of the findings, all
  /// of which have points, or not; `sizes` are those of the file. Throws BrokenInput if the index differs.
  VerifyResult finish(const Statistics& counted, bool has_points, const TagSizes& sizes);

  /// Throws BrokenInput for two neighboring bricks whose common face differs, and says where.
  [[noreturn]] void tell_difference(const Disagreement& bricks) const;

 private:
  const std::string& name() const { return file_ ? file_->name() : reader_->name(); }
  /// Decodes rows of bricks.
  void decode_rows(const BrickRows& rows, RowSink& sink, Watch& watch) const;
  /// The samples on the low faces of `rows`, which bricks below own.
  ClosedSamples low_faces(const BrickRows& rows) const;
  /// Checks the grid of a brick by itself and against the bricks before it, and counts its active points.
  void check_grid(const DecodedBrick& brick, SharedFaces& faces, Statistics& counted) const;
  void compare_with_index(const Statistics& counted, bool has_points) const;
  [[noreturn]] void fail_index(const std::string& what) const;
  [[noreturn]] void fail_brick(std::int64_t brick, const char* what, Index3 p) const;

  TagReader* reader_ = nullptr;  ///< one of these two
  const TagBricks* file_ = nullptr;
  const TagHeader& header_;
  const TagIndex& index_;
  VerifySetup setup_;
  RangesAndIndex ranges_;  ///< of a file that is read front to back
};

}  // namespace tagrid
