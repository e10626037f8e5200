// An encoder, for Python.
#pragma once

#include <pybind11/numpy.h>
#include <unistd.h>

#include <mutex>
#include <string>

#include "call.h"
#include "tagrid/tagrid.h"

namespace tagrid_python {

/// Threads may take turns. An exception of `write` ends the encoding, and the waiting call raises it.
class Encoder {
 public:
  /// `options`: the members of tagrid_encode_options by name; those that are missing have their defaults. But
  /// `overviews` is a sequence without the 0, and `spool` must be there. `write` takes the bytes of the file,
  /// in order. `read`: None, or read(first, count) returns so many samples of the volume.
  Encoder(const py::dict& options, py::function write, py::object read, int threads,
          std::uint64_t memory_limit, py::object progress);
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder();

  /// Takes slices: an array (slices, y, x) of the type of the samples, with any strides.
  void write(const py::array& slices);
  /// Returns the information about the file, which is complete then.
  py::dict finish();
  /// Cancels the encoding if it is not finished. Raises ArgumentError in a callback of the encoder.
  void close();

 private:
  static int take(void* self, const void* bytes, std::size_t count) noexcept;
  static int give(void* self, std::int64_t first, std::int64_t count, void* samples) noexcept;
  template <class Work>
  int called_back(Work work) noexcept;
  template <class Work>
  void work(Work work);
  void cancel();
  /// A child process that was forked has neither the threads of the encoder nor its file.
  bool is_of_this_process() const { return getpid() == process_; }
  /// Raises ArgumentError where the call would wait for ever.
  void check_caller() const;

  Call call_;
  py::function write_;
  py::object read_;
  Raised raised_;
  tagrid_type type_ = TAGRID_UINT8;
  std::int64_t width_ = 0, height_ = 0;
  const pid_t process_;
  std::mutex turn_;
  tagrid_encoder* encoder_ = nullptr;
};

}  // namespace tagrid_python
