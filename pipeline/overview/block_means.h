// The means of the blocks of a volume, as volumes: computed when they are read, or of sums that were stored.
// The latter are the originals of overviews.
#pragma once

#include <cstdint>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/overview/sums.h"
#include "stages/overview/block_sums.h"

namespace tagrid {

/// The samples of the overview with factor 4. Reads no more of the volume than the blocks that are wanted.
class BlockMeans : public VolumeSource {
 public:
  /// `volume` must outlive this object. REQUIRES: volume.traits().any_rows.
  explicit BlockMeans(VolumeSource& volume);

  std::uint64_t bytes_read() const override { return volume_.bytes_read(); }

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override;
  void seek(std::int64_t) override {}
  void end() override {}

  VolumeSource& volume_;
  SumsLayout layout_;
};

/// What the bricks of the overview with a factor take of the bytes of that with factor 4, about: each level has a 64th of
/// the samples of the one before, which are less alike. A 50th to a 16th was measured.
double share_of_level(int factor);

/// The means of blocks whose sums are in a file.
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
