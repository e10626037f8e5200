// A .tag file as an image of OME-Zarr 0.5, whose chunks are decoded when somebody reads them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/byte_source.h"
#include "io/tag/bricks.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_sink.h"
#include "pipeline/decode/values.h"
#include "stages/grid/box.h"

namespace tagrid {

/// The arrays "0", the volume, and "1", "2" ..., its overviews that are not damaged, as `decode` writes them,
/// but a chunk has the size of a brick and is not compressed. So a chunk is one brick, unless the file was
/// encoded without a lead. Several threads may call all const functions at once.
class ServedZarr {
 public:
  /// `name`: of the image. `decoders`: how many chunks are decoded at once. Throws BrokenInput and WorldError.
  ServedZarr(std::shared_ptr<const TagBricks> file, const std::string& name, int decoders);

  /// What is served: samples, or values if they are whole numbers of 16 bits.
  const VolumeInfo& info() const { return info_; }
  const KnownFacts& facts() const { return facts_; }
  const Index3& dims() const { return levels_.front().file->parameters().dims; }
  /// Why overviews are left out.
  const std::vector<std::string>& left_out() const { return left_out_; }

  /// The file with a key such as "zarr.json", "0/zarr.json" or "0/c/2/0/1"; null if there is none. Reading a
  /// chunk throws BrokenInput or WorldError. The file must not outlive this object.
  std::shared_ptr<const ByteSource> file(std::string_view key) const;

 private:
  friend class ServedChunk;
  struct Level {
    std::shared_ptr<const TagBricks> file;
    Index3 chunk;  ///< samples
    std::string metadata;
  };

  std::shared_ptr<const ByteSource> chunk_of(const Level& level, std::string_view place) const;
  std::vector<std::byte> decoded(const Level& level, const Index3& chunk) const;

  WrittenNumbers numbers_;
  VolumeInfo info_;
  KnownFacts facts_;
  std::vector<Level> levels_;
  std::vector<std::string> left_out_;
  std::string metadata_;
  mutable std::counting_semaphore<> decoders_;
};

}  // namespace tagrid
