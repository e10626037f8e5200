// What all ranks do of an encoding in parts: making the parts, and placing them in the one file.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/parts/part_file.h"
#include "io/parts/run_record.h"
#include "io/tag/header.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "pipeline/ranks/ranks.h"
#include "stages/grid/brick_rows.h"

namespace tagrid {

/// What every rank has to know of an encoding in parts.
struct PartOrder {
  std::string input;
  SourceDescription source;
  std::string folder;          ///< where the parts are
  Bytes record;                ///< of the run, see RunRecord
  Resources resources{0};      ///< of each rank; 0 threads: as many as it may run on
  int code_after_signal = -1;  ///< see io/files/temporaries.h: the run can be continued
};

/// Where the blocks of a part begin in the file, and the checksum that precedes them there.
struct PartPlace {
  std::uint64_t position = 0, checksum_before = 0;
};

struct PlaceOrder {
  std::string folder;
  Bytes record;
  std::string file;  ///< that the parts are written into, and that gets its name later
  std::string name;  ///< its name, for messages
  std::vector<PartPlace> places;
};

/// What this rank may take where each may take `given`.
Resources of_this_rank(const Ranks& ranks, Resources given);

/// What reading parts of a volume takes besides their samples. It is open twice, once to look after the run;
/// where rows come as whole slices only, there is one of those.
std::uint64_t memory_besides_parts(const VolumeSource& source);

/// Looks on while this rank works: counts for all ranks together, and ends the work when another one fails.
Watch watch_of(SharedWork& shared);
/// Tells `progress`, which may be empty, what all ranks have done of the samples of a volume.
std::function<void(const SharedNumbers&)> look_for(const Progress& progress,
                                                   const CodingParameters& parameters);

/// Collective. Makes the part files that are not there yet, or not whole.
void make_parts(Ranks& ranks, const PartOrder& order, const Progress& progress = {});

/// Collective. Writes all parts into the file.
void place_parts(Ranks& ranks, const PlaceOrder& order);

/// What part files of a run are called and hold.
class PartsOfRun {
 public:
  /// Throws BrokenInput where the record is none.
  PartsOfRun(std::string folder, const Bytes& record);

  const RunRecord& record() const { return record_; }
  const TagHeader& header() const { return header_; }
  std::uint64_t header_checksum() const { return header_checksum_; }
  const std::vector<BrickRows>& rows() const { return rows_; }
  std::string path(std::int64_t part) const;
  PartId id(std::int64_t part) const;
  std::int64_t count() const { return static_cast<std::int64_t>(rows_.size()); }

 private:
  std::string folder_;
  RunRecord record_;
  TagHeader header_;
  std::uint64_t id_ = 0, header_checksum_ = 0;
  std::vector<BrickRows> rows_;
};

}  // namespace tagrid
