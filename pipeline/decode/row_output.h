// Decoded rows of bricks, into a volume that is written in any order or in raster order.
#pragma once

#include <optional>
#include <string>

#include "io/files/spool_file.h"
#include "io/formats/volume_writer.h"
#include "pipeline/decode/decoded_rows.h"

namespace tagrid {

/// Hands samples on to a writer: at their place, or where that takes them in raster order only, through a
/// temporary file of one layer of bricks.
class RowOutput {
 public:
  /// `spool_folder`: of the temporary file; "" where rows come as the writer takes them.
  RowOutput(VolumeWriter& writer, const std::string& spool_folder, const std::string& name);

  /// REQUIRES: rows come in the order of their bricks.
  void write(const DecodedRows& rows);

 private:
  void through_spool(const DecodedRows& rows, SpoolFile& spool);

  VolumeWriter& writer_;
  std::optional<SpoolFile> spool_;
};

}  // namespace tagrid
