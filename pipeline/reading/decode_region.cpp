#include "io/files/open_source.h"
#include "pipeline/reading/read_region.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/metadata/region.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/tag/whole_bricks.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/decode/graph.h"
#include "pipeline/memory/resources.h"
#include "stages/sample/value_rule.h"

namespace tagrid {
namespace {

// The bricks of a file that is decoded.
class BricksOfRun : public RegionBricks {
 public:
  virtual const TagHeader& header() const = 0;
  /// Null if it is not known before all bricks were read.
  virtual const TagIndex* index() const = 0;
  /// Adds what is known when all bricks were read.
  virtual void finish(DecodeResult& result, const Region& region) = 0;
};

// From a file, by its index.
class BricksByIndex : public BricksOfRun {
 public:
  explicit BricksByIndex(std::shared_ptr<const ByteSource> source) : file_(std::move(source)) {}
  const std::string& name() const override { return file_.name(); }
  const TagHeader& header() const override { return file_.header(); }
  const TagIndex* index() const override { return &file_.index(); }
  void will_read(std::span<const std::int64_t> bricks) override { file_.will_read(bricks); }
  std::optional<BrickBytes> read(std::int64_t brick) override { return file_.read(brick); }
  void finish(DecodeResult& result, const Region&) override {
    result.index = file_.index();
    result.bytes_in = file_.sizes().file;
  }

 private:
  TagBricks file_;
};

// From a pipe, as they come. It is read to its end, so that its writer does not fail, and damage is found.
class BricksOfPipe : public BricksOfRun {
 public:
  explicit BricksOfPipe(const std::string& input) : stream_(input) {}
  const std::string& name() const override { return stream_.name(); }
  const TagHeader& header() const override { return stream_.header(); }
  const TagIndex* index() const override { return nullptr; }
  std::optional<BrickBytes> read(std::int64_t id) override {
    BrickBytes brick;
    do {
      if (!stream_.read_brick(brick)) throw BrokenInput(stream_.name() + ": a brick is missing");
    } while (brick.id < id);
    return brick;
  }
  void finish(DecodeResult& result, const Region&) override {
    stream_.read_to_end();
    result.index = stream_.index();
    result.bytes_in = stream_.sizes().file;
  }

 private:
  TagReader stream_;
};

// Those of a damaged file that are intact.
class SalvagedBricks : public BricksOfRun {
 public:
  explicit SalvagedBricks(std::shared_ptr<const ByteSource> source) : file_(std::move(source)) {
    if (file_.whole_count() == 0)
      throw BrokenInput(file_.name() + ": none of its bricks is intact, so nothing can be decoded");
  }
  const std::string& name() const override { return file_.name(); }
  const TagHeader& header() const override { return file_.header(); }
  const TagIndex* index() const override { return file_.index() ? &*file_.index() : nullptr; }
  std::optional<BrickBytes> read(std::int64_t brick) override {
    return file_.is_whole(brick) ? std::optional(file_.read(brick)) : std::nullopt;
  }
  bool salvages() const override { return true; }
  // A block of another file can fit between two that are lost. The index knows the values of its own.
  bool accepts(const DecodedBrick& brick) const override {
    const auto statistics = file_.statistics(brick.id);
    return !statistics || can_be_of(value_range(brick.samples, file_.header().parameters.type), *statistics,
                                    file_.index()->total.max_error);
  }
  void lose(std::int64_t brick) override { broken_.insert(brick); }
  void finish(DecodeResult& result, const Region& region) override {
    if (file_.index()) result.index = *file_.index();
    result.bytes_in = file_.file_bytes();
    Salvage& salvage = result.salvage.emplace();
    salvage.has_index = file_.index().has_value();
    salvage.is_damaged_elsewhere = file_.is_damaged_elsewhere();
    for (const std::int64_t id : bricks_of(region, file_.header().parameters.bricks()))
      if (!file_.is_whole(id) || broken_.contains(id)) append(salvage.lost, {id, id});
  }

 private:
  WholeBricks file_;
  std::set<std::int64_t> broken_;  // intact, but not decodable, or not of this file
};

std::shared_ptr<const ByteSource> source_to_salvage(const DecodeRun& run) {
  std::shared_ptr<const ByteSource> file = open_source(run.input);
  // Of the first volume, damage at the end of the file is reported, too.
  return run.volume.value_or(0) == 0 ? file : DamagedTag(std::move(file)).volume(*run.volume);
}

std::unique_ptr<BricksOfRun> bricks_of(const DecodeRun& run) {
  if (run.fill) return std::make_unique<SalvagedBricks>(source_to_salvage(run));
  if (is_regular_input(run.input)) return std::make_unique<BricksByIndex>(source_of(run));
  return std::make_unique<BricksOfPipe>(run.input);
}

// Sets every sample to the value that stands for those of lost bricks.
void fill_with(double value, SampleType type, std::vector<std::byte>& samples) {
  with_sample_type(type, [&](auto sample) {
    using S = decltype(sample);
    auto* first = reinterpret_cast<S*>(samples.data());
    std::fill(first, first + samples.size() / sizeof(S), static_cast<S>(value));
  });
}

VolumeInfo info_of(const TagHeader& header, const Region& region) {
  const CodingParameters& parameters = header.parameters;
  const Index3 first = parameters.domain().samples_at(region.box).low;
  VolumeInfo info{
      region.shape(), parameters.type,
      metadata_of_region(header.metadata, first, region.step, region.shape().z, parameters.dims.z)};
  // Formats that must say a place put both the whole and the part where samples are 1 apart.
  const Geometry& whole = header.metadata.geometry();
  if (whole.has_directions) return info;
  const auto place = to_world(whole, first);
  auto origin = info.geometry().origin;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (std::isnan(whole.spacing[axis])) origin[axis] = place[axis];
  info.metadata.set_origin(origin);
  return info;
}

// The region in pieces: some rows of bricks of one layer, with the whole extent of the region along x.
class Pieces {
 public:
  Pieces(const Region& region, const BrickGrid& bricks, std::int64_t rows)
      : region_(region), bricks_(bricks), rows_(rows) {
    y_ = bricks.owner(region.box.low.y);
    z_ = bricks.owner(region.box.low.z);
  }
  /// Sets `piece` to the next piece that has samples; returns false after the last one.
  bool next(Region& piece) {
    while (z_ <= bricks_.owner(region_.box.high.z)) {
      const std::int64_t last = std::min(y_ + rows_ - 1, bricks_.owner(region_.box.high.y));
      Box box = {bricks_.owned_box({0, y_, z_}).low, bricks_.owned_box({0, last, z_}).high};
      box.low.x = region_.box.low.x;
      box.high.x = region_.box.high.x;
      y_ = last + 1;
      if (y_ > bricks_.owner(region_.box.high.y)) {
        y_ = bricks_.owner(region_.box.low.y);
        ++z_;
      }
      numbers_ = region_.numbers_in(box);
      if (numbers_.empty()) continue;
      piece = {{region_.sample(numbers_.low), region_.sample(numbers_.high)}, region_.step};
      return true;
    }
    return false;
  }
  /// For the last piece: the numbers of its samples in the region, along each axis.
  const Box& numbers() const { return numbers_; }

 private:
  const Region& region_;
  const BrickGrid& bricks_;
  std::int64_t rows_, y_ = 0, z_ = 0;
  Box numbers_;
};

// Bytes of the samples of the largest piece with that many rows of bricks.
std::uint64_t bytes_of_piece(const Region& region, const CodingParameters& p, std::int64_t rows,
                             std::size_t sample_bytes) {
  const Index3 shape = region.shape();
  const std::int64_t edge = p.bricks().length();
  const auto at_most = [&](std::int64_t samples, int axis) {
    return std::min(shape[axis], (samples + region.step[axis]) / region.step[axis]);
  };
  return static_cast<std::uint64_t>(shape.x * at_most(rows * edge + 1, 1) * at_most(edge + 1, 2)) *
         sample_bytes;
}

struct RegionPlan {
  int threads = 1;
  std::int64_t rows = 1;  ///< rows of bricks in a piece
  std::uint64_t memory = 0;
};

// Finds the largest pieces that fit into memory, and then the largest number of threads.
RegionPlan plan_region(const Region& region, const CodingParameters& p, const WrittenNumbers& numbers,
                       const Resources& resources, bool any_order, std::uint64_t besides) {
  const BrickGrid bricks = p.bricks();
  const std::int64_t all = bricks.owner(region.box.high.y) - bricks.owner(region.box.low.y) + 1;
  const std::size_t value_bytes = numbers.value_bytes(),
                    sample_bytes = value_bytes > 0 ? value_bytes : size_of(p.type);
  // While the samples of a brick become values, both are there.
  const std::uint64_t values_of_brick =
      static_cast<std::uint64_t>(bricks.owned_box({0, 0, 0}).count()) * value_bytes;
  const auto needed = [&](int threads, std::int64_t rows) {
    return memory_of_reading(p, threads) + 2 * bytes_of_piece(region, p, rows, sample_bytes) +
           static_cast<std::uint64_t>(threads) * values_of_brick + besides + resources.besides;
  };
  const std::int64_t least = any_order ? 1 : all;
  const auto best = [&](std::uint64_t limit) -> std::optional<RegionPlan> {
    for (int threads = resources.threads; threads >= 1; --threads)
      for (std::int64_t rows = all; rows >= least; rows = rows > 1 ? (rows + 1) / 2 : 0)
        if (needed(threads, rows) <= limit) return RegionPlan{threads, rows, needed(threads, rows)};
    return std::nullopt;
  };
  const RegionPlan plan = within(resources, best, RegionPlan{1, least, needed(1, least)});
  if (!resources.memory || plan.memory <= *resources.memory) return plan;
  const Index3 n = region.shape();
  throw MemoryLimit(fmt::format("decoding a region of {} x {} x {} {}", n.x, n.y, n.z, name_of(p.type)),
                    {.needed = plan.memory, .allowed = *resources.memory});
}

}  // namespace

FinishedDecode decode_region(const DecodeRun& run, const Resources& resources) {
  const std::unique_ptr<BricksOfRun> of_run = bricks_of(run);
  const TagHeader& header = of_run->header();
  const CodingParameters& parameters = header.parameters;
  const Region region = region_of(run.region, parameters);
  const WrittenNumbers numbers = written_numbers(run.format, run.numbers, header, of_run->index());
  const VolumeInfo of_samples = info_of(header, region), info = numbers.info(of_samples);
  if (run.fill && !is_value_of(info.type, *run.fill))
    throw UsageError("a fill of {}: is not a value of type {}", *run.fill, name_of(info.type));
  DecodeOutput output(run, of_samples, numbers, parameters);
  const RegionPlan plan = output.plan([&](std::uint64_t memory) {
    // Of a damaged file, the places of all bricks are known.
    const std::uint64_t places = run.fill ? static_cast<std::uint64_t>(parameters.bricks().count()) * 48 : 0;
    return plan_region(region, parameters, numbers, resources, output.any_order(), memory + places);
  });
  const std::shared_ptr<VolumeSink> sink = output.begin();

  const BrickGrid bricks = parameters.bricks();
  ProgressWatch watch(run.progress, sample_bytes(info.dims, info.type).value());
  std::vector<std::byte> samples;
  Pieces pieces(region, bricks, plan.rows);
  for (Region piece; pieces.next(piece);) {
    const Index3 shape = piece.shape();
    samples.resize(memory_size(sample_bytes(shape, info.type).value()));
    const std::size_t row = static_cast<std::size_t>(shape.x) * size_of(info.type),
                      slice = static_cast<std::size_t>(shape.y) * row;
    const Strides strides = {static_cast<std::int64_t>(size_of(info.type)), static_cast<std::int64_t>(row),
                             static_cast<std::int64_t>(slice)};
    if (run.fill) fill_with(*run.fill, info.type, samples);
    read_region(*of_run, parameters, piece, {samples.data(), strides, numbers}, plan.threads);
    for (std::int64_t z = 0; z < shape.z; ++z) {
      const Box& places = pieces.numbers();
      const std::int64_t first = ((places.low.z + z) * info.dims.y + places.low.y) * info.dims.x;
      sink->write_samples(first, std::span(samples).subspan(static_cast<std::size_t>(z) * slice, slice));
    }
    watch.done(samples.size());
  }
  DecodeResult result = {.header = header,
                         .index = {},
                         .bytes_out = sink->bytes_written(),
                         .memory = plan.memory,
                         .facts = sink->facts(),
                         .warnings = sink->warnings(),
                         .numbers = numbers,
                         .dims = info.dims,
                         .metadata = info.metadata};
  of_run->finish(result, region);
  return {std::move(result), sink};
}

}  // namespace tagrid
