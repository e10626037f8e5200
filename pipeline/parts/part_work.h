// The work of all ranks in an encoding in parts: they make the parts, and then place them in the output file.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/parts/part_file.h"
#include "io/parts/run_record.h"
#include "io/tag/header.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/parts/partition.h"
#include "pipeline/progress/progress.h"
#include "pipeline/ranks/ranks.h"
#include "stages/grid/brick_grid.h"

namespace tagrid {

/// The data that every rank needs for an encoding in parts.
struct PartOrder {
  std::string input;
  SourceDescription source;
  std::string folder;          ///< the directory of the parts
  Bytes record;                ///< of the run, see RunRecord
  Resources resources{0};      ///< per rank; 0 threads: all that the rank may use
  int code_after_signal = -1;  ///< if not negative, the run can be continued; see io/files/temporaries.h
};

/// The position of some blocks of a part in the file, between pages of the index, and the checksum of
/// everything before them.
struct PartPlace {
  std::uint64_t position = 0, checksum_before = 0;
  std::int64_t bricks = 0;
};

struct PlaceOrder {
  std::string folder;
  Bytes record;
  std::string file;  ///< the file that the parts are written into; it gets its name later
  std::string name;  ///< its final name, for messages
  std::vector<std::vector<PartPlace>> places;  ///< of each part, in the order of its bricks
};

/// This rank's share of `given`, which are the resources of each rank.
Resources of_this_rank(const Ranks& ranks, Resources given);

/// The memory for reading a volume in parts besides samples: the volume is open twice, to read parts and to
/// control the run. If rows cannot be read in any order, a slice is buffered.
std::uint64_t memory_besides_parts(const VolumeSource& source);

/// Watches the work of this rank: adds it to the common sum, and ends it if another rank fails.
class SharedWatch : public Watch {
 public:
  explicit SharedWatch(SharedWork& shared) : shared_(shared) {}
  void before_reading() override {
    if (shared_.stop) throw Stopped();
  }
  void done(std::uint64_t bytes) override {
    before_reading();
    shared_.add_done(static_cast<std::int64_t>(bytes));
  }

 private:
  SharedWork& shared_;
};
/// Passes the progress of all ranks together, in samples of the volume, to `progress`, which may be empty.
SharedWork::Look look_for(const Progress& progress, const CodingParameters& parameters);

/// Collective. Makes the part files that are missing or damaged.
void make_parts(Ranks& ranks, const PartOrder& order, const Progress& progress = {});

/// Collective. Writes all parts into the file.
void place_parts(Ranks& ranks, const PlaceOrder& order);

/// The names and contents of a run's part files.
class PartsOfRun {
 public:
  /// Throws BrokenInput if the record is not valid.
  PartsOfRun(std::string folder, const Bytes& record);

  const RunRecord& record() const { return record_; }
  const TagHeader& header() const { return header_; }
  std::uint64_t header_checksum() const { return header_checksum_; }
  const std::vector<BrickRows>& rows() const { return rows_; }
  std::string path(std::int64_t part) const;
  /// True if the file will have overviews, so that parts have the sums of their blocks.
  bool has_sums() const { return has_sums_; }
  /// The blocks whose sums a part has.
  Box blocks(std::int64_t part) const;
  PartId id(std::int64_t part) const;
  std::int64_t count() const { return static_cast<std::int64_t>(rows_.size()); }

 private:
  std::string folder_;
  RunRecord record_;
  TagHeader header_;
  std::uint64_t id_ = 0, header_checksum_ = 0;
  std::vector<BrickRows> rows_;
  bool has_sums_ = false;
};

/// How many slices of a source are kept in memory for the parts that follow, if its rows cannot be read in
/// any order: those that a part needs, as far as the limit on memory allows.
std::int64_t slices_kept_for_parts(const VolumeSource& source, const PartsOfRun& parts,
                                   const EncodePlan& plan, const Resources& resources);

}  // namespace tagrid
