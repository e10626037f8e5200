// Which chunks of a volume were written.
#pragma once

#include <cstdint>
#include <string>

#include "io/formats/zarr/reader/array.h"
#include "io/formats/zarr/reader/pieces.h"
#include "io/formats/zarr/reader/store.h"

namespace tagrid {

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
