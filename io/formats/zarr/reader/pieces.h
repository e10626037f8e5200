// The samples of an array, piece by piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/zarr/reader/array.h"
#include "io/formats/zarr/reader/store.h"

namespace tagrid {

/// Pieces of an array: from the number first[axis] to the one before end[axis].
struct PieceBox {
  std::vector<std::int64_t> first, end;
};

/// The pieces of one array: its chunks, or the chunks in its shards.
class ZarrPieces {
 public:
  /// Both must outlive this.
  ZarrPieces(const ZarrStore& store, const ZarrArray& array) : store_(store), array_(array) {}

  /// How many pieces in a box were written to the file of the chunk with these numbers, which is there. Throws
  /// BrokenInput.
  std::uint64_t count(const std::vector<std::int64_t>& chunk, const PieceBox& box);
  /// The bytes of the piece with these numbers along each axis, in the order and the byte order of the array;
  /// nothing if it was never written. Throws BrokenInput.
  std::optional<std::vector<std::byte>> read(const std::vector<std::int64_t>& numbers);
  /// The most memory that read() takes.
  std::uint64_t memory() const;

 private:
  static constexpr std::uint64_t never_written = std::numeric_limits<std::uint64_t>::max();
  /// Where a piece is in its shard.
  struct Place {
    std::uint64_t position = 0, size = 0;
    bool is_written() const { return position != never_written || size != never_written; }
  };
  using Index = std::vector<Place>;

  /// Which piece of a chunk.
  struct InChunk {
    std::vector<std::int64_t> chunk;
    std::uint64_t number = 0, count = 1;  ///< of the pieces in the chunk; never_written if there are more
  };

  InChunk in_chunk(const std::vector<std::int64_t>& numbers) const;
  const Index& index_of(const std::string& key, const ByteSource& shard, std::uint64_t pieces);
  std::vector<std::byte> read_at(const ByteSource& shard, const Place& place, const std::string& name) const;

  const ZarrStore& store_;
  const ZarrArray& array_;
  std::map<std::string, Index> indices_;
  std::size_t places_ = 0;  ///< in all indices
};

// Which chunks of a volume were written.

struct ZarrPresence {
  std::uint64_t written = 0;  ///< pieces of the volume
  /// A file whose name would be the key of a chunk if the metadata stated another form of keys, and
  /// the key that the metadata states for this chunk; "" if there is no such file.
  std::string other_key, expected_key;
};

/// Counts the pieces of a volume by listing the folders of the array, so that the time depends on
/// the number of files, not on the size of the array. Reports that it works. Throws BrokenInput,
/// WorldError.
ZarrPresence presence_of(const ZarrStore& store, const ZarrArray& array, ZarrPieces& pieces,
                         const PieceBox& volume);

}  // namespace tagrid
