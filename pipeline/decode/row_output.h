// Decoded rows of bricks, into a volume that is written in any order or in raster order.
#pragma once

#include <optional>
#include <string>

#include "io/files/spool_file.h"
#include "io/volume/volume_sink.h"
#include "pipeline/decode/decoded_rows.h"

namespace tagrid {

/// Hands samples on to a sink: at their place, or where that takes them in raster order only, through a
/// temporary file of one layer of bricks.
class RowOutput {
 public:
  /// `spool_folder`: of the temporary file; "" where rows come as the sink takes them.
  RowOutput(VolumeSink& sink, const std::string& spool_folder, const std::string& name);

  /// REQUIRES: rows come in the order of their bricks.
  void write(const DecodedRows& rows);

 private:
  void through_spool(const DecodedRows& rows, SpoolFile& spool);

  VolumeSink& sink_;
  std::optional<SpoolFile> spool_;
};

}  // namespace tagrid
