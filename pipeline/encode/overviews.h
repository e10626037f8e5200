// Overviews: averaged levels of a volume, encoded after its last brick and nested in its file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/output_file.h"
#include "io/files/spool_file.h"
#include "io/tag/file.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "pipeline/memory/resources.h"
#include "pipeline/overview/sums.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// Writes bytes to a temporary file, which must outlive it.
class SpoolSink : public ByteSink {
 public:
  explicit SpoolSink(SpoolFile& file) : file_(file) {}
  void write(std::span<const std::byte> bytes) override { file_.write(bytes); }

 private:
  SpoolFile& file_;
};

/// Encodes the overviews of a file with these factors, which increase, and passes them to `out`. `sums` are
/// those of blocks of 4. Temporary files are in `resources.spool`, which must be given. An
/// exception of watch.before_reading() ends the work. Throws WorldError.
void write_overviews(const TagHeader& file, const std::vector<int>& factors, const Statistics& total,
                     SumsFile sums, const Resources& resources, const std::string& output, MemberSink& out,
                     Watch& watch);

/// The overviews of a file that one process writes front to back: adds up blocks while bricks are encoded,
/// and then writes the members. Does nothing if the file has none.
class OverviewsOfStream {
 public:
  /// Creates the temporary file of the sums in `resources.spool`, which must be given. Throws WorldError,
  /// whose message names `output`.
  OverviewsOfStream(TagHeader header, std::vector<int> factors, const Resources& resources,
                    std::string output);

  /// What takes the sums while the volume is encoded; nullptr if there are no overviews.
  SumsSink* sums() { return sums_ ? &*sums_ : nullptr; }
  /// Writes the overviews. To be called once, after the last brick and the envelope. See write_overviews().
  void write(TagWriter& writer, Watch& watch);

 private:
  TagHeader header_;
  std::vector<int> factors_;
  Resources resources_;
  std::string output_;
  std::optional<SumsFile> sums_;
};

}  // namespace tagrid
