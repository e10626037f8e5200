// The means of blocks, as a volume: the original of an overview.
#pragma once

#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/overview/sums.h"

namespace tagrid {

class MeansSource : public VolumeSource {
 public:
  /// `dims` are those of the volume whose blocks were summed. `sums` must outlive this object.
  MeansSource(SumsFile& sums, const Index3& dims);

  std::uint64_t bytes_read() const override { return 0; }

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override;
  void seek(std::int64_t) override {}
  void end() override {}

  SumsFile& sums_;
  Index3 dims_;
  std::vector<std::byte> stored_;
};

/// The sums of a volume that is read from its first sample on. Temporary files are in `spool`; see SumsFile.
SumsFile sums_of(VolumeSource& volume, const std::string& spool, const std::string& output);

}  // namespace tagrid
