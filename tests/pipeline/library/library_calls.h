// Calls of the library as a user makes them, with files in memory that count reads and can be told to fail.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"
#include "tagrid/tagrid.h"

namespace tagrid {

/// A file in memory.
struct MemoryFile {
  std::string bytes;
  std::mutex mutex = {};
  std::vector<std::pair<std::uint64_t, std::uint64_t>> reads = {};  // begin and end
  int fails_at = -1;                                                // the call that fails

  tagrid_input input() {
    tagrid_input input;
    tagrid_input_init(&input);
    input.user = this;
    input.name = "memory";
    input.size = [](void* self, uint64_t* size) {
      *size = static_cast<MemoryFile*>(self)->bytes.size();
      return 0;
    };
    input.read_at = [](void* self, uint64_t offset, void* buffer, size_t count) {
      return static_cast<MemoryFile*>(self)->read_at(offset, buffer, count);
    };
    return input;
  }

 private:
  int read_at(uint64_t offset, void* buffer, size_t count) {
    const std::lock_guard lock(mutex);
    if (static_cast<int>(reads.size()) == fails_at) return 5;
    reads.emplace_back(offset, offset + count);
    if (offset > bytes.size() || count > bytes.size() - offset) return 7;
    std::memcpy(buffer, bytes.data() + offset, count);
    return 0;
  }
};

struct CloseReader {
  void operator()(tagrid_reader* reader) const { tagrid_reader_close(reader); }
};
struct CloseEncoder {
  void operator()(tagrid_encoder* encoder) const { tagrid_encoder_close(encoder); }
};
using ReaderHandle = std::unique_ptr<tagrid_reader, CloseReader>;
using EncoderHandle = std::unique_ptr<tagrid_encoder, CloseEncoder>;

inline ReaderHandle open_reader(MemoryFile& file, tagrid_status* status = nullptr) {
  tagrid_reader* reader = nullptr;
  const tagrid_input input = file.input();
  const tagrid_status result = tagrid_reader_open(&input, &reader);
  if (status != nullptr) *status = result;
  return ReaderHandle(reader);
}

/// The result of an encoding.
struct Encoded {
  tagrid_status status = TAGRID_OK;
  std::string message = {};
  std::string bytes = {};
  tagrid_info info = {};
  int writes = 0;
  int write_fails_at = -1;

  static int write(void* self, const void* bytes, size_t count) {
    auto* to = static_cast<Encoded*>(self);
    if (to->writes++ == to->write_fails_at) return 9;
    to->bytes.append(static_cast<const char*>(bytes), count);
    return 0;
  }
};

/// Encodes, some slices at a time.
inline Encoded encode(const tagrid_encode_options& options, const void* samples,
                      const tagrid_call* call = nullptr, std::int64_t slices_at_once = 3,
                      int write_fails_at = -1) {
  Encoded encoded{.write_fails_at = write_fails_at};
  tagrid_encoder* opened = nullptr;
  encoded.status = tagrid_encoder_open(&options, Encoded::write, &encoded, call, &opened);
  const EncoderHandle encoder(opened);
  const auto slice =
      static_cast<std::size_t>(options.dims[0] * options.dims[1]) * tagrid_sample_size(options.type);
  for (std::int64_t z = 0; z < options.dims[2] && encoded.status == TAGRID_OK; z += slices_at_once)
    encoded.status =
        tagrid_encoder_write(opened, static_cast<const char*>(samples) + static_cast<std::size_t>(z) * slice,
                             std::min(slices_at_once, options.dims[2] - z), nullptr);
  encoded.info.struct_size = sizeof encoded.info;
  if (encoded.status == TAGRID_OK) encoded.status = tagrid_encoder_finish(opened, &encoded.info);
  encoded.message = tagrid_encoder_message(opened);
  return encoded;
}

inline tagrid_encode_options encode_options(Index3 dims, SampleType type) {
  tagrid_encode_options options;
  tagrid_encode_options_init(&options);
  for (int axis = 0; axis < 3; ++axis) options.dims[axis] = dims[axis];
  options.type = static_cast<tagrid_type>(type);
  // Small bricks, so that small volumes have many.
  options.cube = 4;
  options.brick = 2;
  if (size_of(type) > 2) options.range[0] = 0, options.range[1] = 100;
  return options;
}

template <class T>
MemoryFile encoded_file(Index3 dims, const std::vector<T>& samples, bool grid_only = false,
                        double max_error = 0) {
  tagrid_encode_options options = encode_options(dims, sample_type_of<T>());
  options.grid_only = grid_only;
  if (!grid_only) options.max_error = max_error;
  const Encoded encoded = encode(options, samples.data());
  if (encoded.status != TAGRID_OK) throw std::runtime_error(encoded.message);
  return {encoded.bytes};
}

inline tagrid_call call_of(int threads, tagrid_progress progress = nullptr, void* user = nullptr) {
  tagrid_call call;
  tagrid_call_init(&call);
  call.threads = threads;
  call.progress = progress;
  call.progress_user = user;
  return call;
}

inline tagrid_box whole_box(Index3 dims) { return {{0, 0, 0}, {dims.x, dims.y, dims.z}}; }

inline tagrid_info info_of(const tagrid_reader* reader) {
  tagrid_info info;
  tagrid_info_init(&info);
  tagrid_reader_info(reader, &info);
  return info;
}

inline tagrid_mesh_options mesh_options(const tagrid_box* box = nullptr) {
  tagrid_mesh_options options;
  tagrid_mesh_options_init(&options);
  options.box = box;
  return options;
}

/// Counts calls of progress, and cancels one of them.
struct CountedProgress {
  int calls = 0, stop_at = -1;
  std::uint64_t done = 0, total = 0;

  static int report(void* user, uint64_t done, uint64_t total) {
    auto& progress = *static_cast<CountedProgress*>(user);
    EXPECT_GE(done, progress.done);
    EXPECT_LE(done, total);
    progress.done = done, progress.total = total;
    return progress.calls++ == progress.stop_at ? 1 : 0;
  }
};

/// A box within the volume.
template <class Random>
tagrid_box any_box(Index3 dims, Random& random) {
  tagrid_box box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(dims[axis]));
    const auto b = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(dims[axis]));
    box.low[axis] = std::min(a, b);
    box.high[axis] = std::max(a, b) + 1;
  }
  return box;
}

}  // namespace tagrid
