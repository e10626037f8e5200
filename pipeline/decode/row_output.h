// Writes decoded rows of bricks to a volume that is written in any order, or in raster order.
#pragma once

#include <optional>
#include <string>

#include "io/files/spool_file.h"
#include "io/volume/volume_sink.h"
#include "pipeline/decode/decoded_rows.h"

namespace tagrid {

/// Passes samples to a sink: at their position or, if the sink takes raster order only, through a temporary
/// file that holds one layer of bricks.
class RowOutput {
 public:
  /// `spool_folder`: the folder of the temporary file; "" if rows come in the order in which the sink takes
  /// them.
  RowOutput(VolumeSink& sink, const std::string& spool_folder, const std::string& name);

  /// REQUIRES: rows come in the order of their bricks.
  void write(const DecodedRows& rows);

 private:
  void through_spool(const DecodedRows& rows, SpoolFile& spool);

  VolumeSink& sink_;
  std::optional<SpoolFile> spool_;
};

}  // namespace tagrid
