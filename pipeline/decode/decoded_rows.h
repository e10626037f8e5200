// Collects the decoded samples of some rows of bricks, brick by brick.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "pipeline/grid/slices.h"
#include "pipeline/threads/node_times.h"
#include "pipeline/threads/threads.h"
#include "stages/brick/codec.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Samples of a few rows of bricks of one layer, and then of the next few rows. They are stored by brick:
/// memory grows with the decoded bricks, not with the width that a header claims.
class DecodedRows {
 public:
  /// Goes through `all`, `together` rows at a time, or fewer at the end of a layer. `size`: bytes of the
  /// values that samples have become; 0: they are as in the file.
  DecodedRows(const CodingParameters& parameters, const BrickRows& all, std::int64_t together,
              std::size_t size = 0);
  /// The most memory of rows, and of parts in which `threads` pass them on; see GridSchedule::memory().
  static double memory(const CodingParameters& parameters, std::int64_t together, std::int64_t threads,
                       std::size_t size = 0);

  /// Adds the samples that the next brick owns, x fastest.
  void add(std::vector<std::byte> samples) { samples_.push_back(std::move(samples)); }
  bool complete() const { return static_cast<std::int64_t>(samples_.size()) == rows_.count(bricks_); }
  /// Drops its bricks; the next brick is the first one of the following rows.
  void begin_next();

  /// The samples that the bricks own, as points of the lattice: complete rows of complete slices.
  const Box& box() const { return box_; }
  /// Bytes of the rows of one slice.
  std::size_t slice_bytes() const;
  /// Bytes of all samples.
  std::size_t bytes() const { return static_cast<std::size_t>(box_.count()) * size_; }

  /// The samples that a brick owns, x fastest.
  struct Part {
    Box box{{0, 0, 0}, {-1, -1, -1}};
    const std::byte* samples = nullptr;
  };
  /// Those of the brick that owns a sample. REQUIRES: complete(), box().contains(p).
  Part part_with(Index3 p) const;
  /// Copies rows y_low .. y_high of slice `z` to `out`, x fastest. REQUIRES: as for part_with().
  void copy_rows(std::int64_t z, std::int64_t y_low, std::int64_t y_high, std::span<std::byte> out) const;
  /// Calls use(slice) for the part of every slice that lies in `samples`, in the order of z: complete rows.
  /// REQUIRES: as for part_with(); all rows of `samples` are here.
  template <class Use>
  void for_each_slice(const Box& samples, Use use) const {
    assert(box_.low.y <= samples.low.y && box_.high.y >= samples.high.y);
    const Box box = intersection(box_, samples);
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z) {
      const auto bytes = static_cast<std::size_t>(box.size().x * box.size().y) * size_;
      std::shared_ptr<std::byte[]> slice(new std::byte[bytes]);
      copy_rows(z, box.low.y, box.high.y, {slice.get(), bytes});
      use(SliceSamples(std::move(slice)));
    }
  }
  /// The number of the first sample of the layer, in raster order.
  std::int64_t first_of_layer() const {
    const Box volume = bricks_.domain.volume();
    return volume.offset({volume.low.x, volume.low.y, box_.low.z});
  }
  /// True if the bricks are the last ones of their layer.
  bool end_layer() const { return box_.high.y == bricks_.domain.volume().high.y; }
  /// Copies all rows of slice `z`.
  void copy_slice(std::int64_t z, std::span<std::byte> out) const {
    copy_rows(z, box_.low.y, box_.high.y, out);
  }
  /// Calls use(first, std::span<const std::byte>) for all samples in raster order, one stretch of consecutive
  /// samples of the volume at a time. `first` is the number of its first sample, in raster order.
  template <class Use>
  void for_each_part(Use use) const {
    for_each_part(box_.low.z, box_.high.z, use);
  }
  /// The same in any order, on as many threads as have nothing else to do. An exception ends it.
  template <class Use>
  void for_each_part_at_once(Use use) const {
    share_rows(box_.size().z, slice_bytes(), 1, [&](std::int64_t first, std::int64_t count) {
      const TimeOfNode time(Node::write_samples);
      for_each_part(box_.low.z + first, box_.low.z + first + count - 1, use);
    });
  }
  /// Enough bytes for a write to be efficient. Parts have no more, or one row.
  static constexpr std::size_t part_bytes = bytes_of_task;

 private:
  template <class Use>
  void for_each_part(std::int64_t z_low, std::int64_t z_high, const Use& use) const {
    const Box volume = bricks_.domain.volume();
    const std::size_t row = static_cast<std::size_t>(volume.size().x) * size_;
    const auto step = static_cast<std::int64_t>(std::max(part_bytes / row, std::size_t{1}));
    std::vector<std::byte> part;
    part.reserve(std::max(part_bytes, row));
    std::int64_t first = 0, next = 0;
    const auto hand_out = [&] {
      if (!part.empty()) use(first, std::span<const std::byte>(part));
      part.clear();
    };
    for (std::int64_t z = z_low; z <= z_high; ++z)
      for (std::int64_t y = box_.low.y; y <= box_.high.y; y += step) {
        const std::int64_t last = std::min(y + step - 1, box_.high.y),
                           start = volume.offset({volume.low.x, y, z});
        const std::size_t size = static_cast<std::size_t>(last - y + 1) * row;
        if (start != next || part.size() + size > part_bytes) hand_out();
        if (part.empty()) first = start;
        next = start + (last - y + 1) * volume.size().x;
        part.resize(part.size() + size);
        copy_rows(z, y, last, std::span(part).last(size));
      }
    hand_out();
  }

  Box owned(std::int64_t in_rows) const {
    const std::int64_t nx = bricks_.bricks(0);
    return bricks_.owned_box({in_rows % nx, rows_.y_low + in_rows / nx, rows_.z_low});
  }
  void begin(std::int64_t y, std::int64_t z);

  BrickGrid bricks_;
  BrickRows all_;
  std::int64_t together_;
  std::size_t size_;  ///< of a sample
  BrickRows rows_;    ///< the current rows
  Box box_;
  std::vector<std::vector<std::byte>> samples_;  ///< by brick, in the order of their numbers
};

/// Takes what is decoded. Every brick was decoded without an error. Never called by two threads at once.
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// True if bricks are wanted, with their grids.
  virtual bool takes_bricks() const { return false; }
  /// Takes every brick, in order, before write() has its samples. May move the rest out.
  virtual void take(DecodedBrick& /*brick*/) {}
  /// Takes groups of rows of bricks in the order of their numbers.
  virtual void write(const DecodedRows& rows) = 0;
};

/// Passes rows to a function.
template <class Write>
class RowsTo : public RowSink {
 public:
  explicit RowsTo(Write write) : write_(std::move(write)) {}
  void write(const DecodedRows& rows) override { write_(rows); }

 private:
  Write write_;
};

/// Passes bricks to a function, and rows to another.
template <class Take, class Write>
class BricksTo : public RowsTo<Write> {
 public:
  BricksTo(Take take, Write write) : RowsTo<Write>(std::move(write)), take_(std::move(take)) {}
  bool takes_bricks() const override { return true; }
  void take(DecodedBrick& brick) override { take_(brick); }

 private:
  Take take_;
};
/// For whoever needs bricks only.
inline constexpr auto ignore_rows = [](const DecodedRows&) {};

}  // namespace tagrid
