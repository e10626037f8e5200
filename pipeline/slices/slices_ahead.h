// The slices of a volume: read when they are asked for, or ahead of the encoder if another process decodes them.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "io/volume/volume_source.h"
#include "pipeline/slices/slice_source.h"

namespace tagrid {

/// Reads `rows`, complete rows of one slice; see VolumeSource. Bytes after the last sample make the entire
/// input wrong, so they are checked before anything is finished.
SliceSamples read_input_slice(VolumeSource& source, const Box& rows);
/// The same, with the threads of this arena if the source can be read by several.
SliceSamples read_slice_on_threads(VolumeSource& source, const Box& rows);

/// Gives the slices of a volume. Its own thread, which mostly waits, reads them ahead.
class SlicesAhead : public SliceSource {
 public:
  /// At most `count` slices wait in memory. With 0 there is no thread: rows are read when they are asked for.
  /// `source` must outlive this. REQUIRES: count = 0, or the source is at its beginning.
  SlicesAhead(VolumeSource& source, std::int64_t count);
  ~SlicesAhead() override { end(); }
  SlicesAhead(const SlicesAhead&) = delete;
  SlicesAhead& operator=(const SlicesAhead&) = delete;

  /// As read_slice_on_threads(). REQUIRES: count = 0, or `rows` are the next slice.
  SliceSamples read(const Box& rows) override;
  void stop() override;
  /// Ends the thread; from now on, the source belongs to the caller again.
  void end();

 private:
  void start();
  void read_all();

  VolumeSource& source_;
  std::int64_t count_;
  std::atomic<bool> stopped_{false};  ///< what ends a read that waits
  SliceQueue queue_;
  std::exception_ptr no_longer_needed_;
  std::thread thread_;
};

}  // namespace tagrid
