// The samples of an array, piece by piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/formats/zarr/array.h"
#include "tools/formats/zarr/store.h"

namespace tagrid {

/// The pieces of one array: its chunks, or the chunks in its shards.
class ZarrPieces {
 public:
  /// Both must outlive this.
  ZarrPieces(const ZarrStore& store, const ZarrArray& array) : store_(store), array_(array) {}

  /// The bytes of the piece with these numbers along each axis, in the order and the byte order of the array;
  /// nothing if it was never written. Throws BrokenInput.
  std::optional<std::vector<std::byte>> read(const std::vector<std::int64_t>& numbers);
  /// The most memory that read() takes.
  std::uint64_t memory() const;

 private:
  struct Place {
    std::uint64_t position = 0, size = 0;
  };
  using Index = std::vector<Place>;

  const Index& index_of(const std::string& key, const ByteSource& shard, std::uint64_t pieces);
  std::vector<std::byte> read_at(const ByteSource& shard, const Place& place, const std::string& name) const;

  const ZarrStore& store_;
  const ZarrArray& array_;
  std::map<std::string, Index> indices_;
  std::size_t places_ = 0;  ///< in all indices
};

}  // namespace tagrid
