// Measures each stage alone, with one thread, in voxels per second. See docs/dev/benchmarks.md.
//
// A piece of 129 x 129 x 129 samples, eight bricks, is treated as a volume. One piece is from a phantom;
// another is from the ankle, if that lies beside the sources. The input of a stage from the stages before it
// is computed once, and not measured.

#include <benchmark/benchmark.h>

#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>

#include "stages/activity/coding.h"
#include "stages/brick/codec.h"
#include "stages/phantom/phantom.h"
#include "stages/values/few/labels.h"
#include "stages/values/points/coding.h"
#include "stages/values/points/field.h"
#include "stages/values/prediction/weights.h"
#include "stages/values/voxels/codec.h"
#include "tests/support/encode_volume.h"

namespace tagrid {
namespace {

using Sample = std::int16_t;
using Bytes = std::vector<std::uint8_t>;
constexpr int cube_size = 32;
constexpr std::int64_t edge = 129;
constexpr MarkingParameters criterion = {20, 8.0 / 4096, max_level(cube_size)};

/// A brick, and the results of the stages before.
struct Brick {
  Index3 position;
  Box closed, owned;
  std::vector<Sample> around;    ///< samples of the closed box and of the halo of the curvature
  std::vector<Sample> samples;   ///< of the owned box
  std::vector<Sample> vertices;  ///< of the closed box
  LatticeBits region;            ///< marks that affect the activity
  LatticeBits active;
  Forecast forecast;
};

struct Piece {
  oracle::Volume<Sample> volume;
  Domain domain;
  std::vector<Brick> bricks;

  explicit Piece(oracle::Volume<Sample> samples)
      : volume(std::move(samples)), domain{volume.dims, cube_size} {
    const LatticeBits marks = marks_of(volume, cube_size, criterion);
    const BrickGrid grid{domain, 2};
    for (std::int64_t id = 0; id < grid.count(); ++id) {
      Brick& brick = bricks.emplace_back();
      brick.closed = grid.closed_box(grid.position(id));
      brick.owned = grid.owned_box(grid.position(id));
      brick.around = volume.cut(brick.closed.grown(CurvatureField::halo));
      brick.samples = volume.cut(brick.owned);
      brick.vertices = volume.cut(brick.closed);
      brick.region = LatticeBits(region_of_marks(brick.closed, domain));
      copy_bits(marks, brick.region);
      brick.active = subdivide(brick.region, brick.closed, domain);
      brick.position = grid.position(id);
      forecast(brick);
    }
  }

  void forecast(Brick& brick) const {
    CodingParameters parameters{.dims = volume.dims, .field_scale = criterion.field_scale};
    brick.forecast = forecast_activity<Sample>(brick.samples, parameters, brick.position);
  }

  void mark(Brick& brick, LatticeBits& marks) const {
    const Samples<Sample> samples{brick.closed.grown(CurvatureField::halo), brick.around.data()};
    mark_curvature(samples, brick.closed, domain, criterion, marks);
  }
};

Piece phantom() {
  const Index3 dims = {256, 256, 256}, low = {64, 64, 64};
  oracle::Volume<Sample> volume{{edge, edge, edge}, {}};
  std::vector<Sample> slice(static_cast<std::size_t>(dims.x * dims.y));
  for (std::int64_t z = 0; z < edge; ++z) {
    phantom_slice<Sample>(dims, 1, low.z + z, slice);
    for (std::int64_t y = 0; y < edge; ++y) {
      const auto row = slice.begin() + (low.y + y) * dims.x + low.x;
      volume.samples.insert(volume.samples.end(), row, row + edge);
    }
  }
  return Piece(std::move(volume));
}

/// Nothing if the volume is missing.
std::unique_ptr<Piece> ankle() {
  const auto whole = read_volume<Sample>("vhf_ankle.raw", {512, 512, 150});
  if (whole.samples.empty()) return nullptr;
  const Index3 low = {192, 192, 10};  // half of it tissue
  const Box box{low, low + Index3{edge - 1, edge - 1, edge - 1}};
  return std::make_unique<Piece>(oracle::Volume<Sample>{box.size(), whole.cut(box)});
}

/// Measures a function of a brick on all bricks of a piece, one after the other.
void measure(const std::string& name, Piece& piece, std::function<void(Brick&)> stage) {
  benchmark::RegisterBenchmark(name.c_str(), [&piece, stage](benchmark::State& state) {
    for (auto _ : state)
      for (Brick& brick : piece.bricks) stage(brick);
    const auto voxels = static_cast<double>(piece.volume.samples.size());
    state.counters["voxels/s"] = benchmark::Counter(voxels, benchmark::Counter::kIsIterationInvariantRate);
  })->Unit(benchmark::kMillisecond);
}

/// Bytes of every brick, encoded once.
using Coded = std::map<const Brick*, Bytes>;

void check(const Status& status) {
  if (!status.ok()) throw std::runtime_error("a stage does not decode what it encoded");
}

void grid_stages(const std::string& of, Piece& piece) {
  measure(of + "/Marking", piece, [&piece](Brick& brick) {
    LatticeBits marks(brick.closed);
    piece.mark(brick, marks);
    benchmark::DoNotOptimize(marks.words().data());
  });
  measure(of + "/Subdivide", piece, [&piece](Brick& brick) {
    benchmark::DoNotOptimize(subdivide(brick.region, brick.closed, piece.domain));
  });
  auto coded = std::make_shared<Coded>();
  for (const Brick& brick : piece.bricks)
    encode_activity(brick.active, brick.forecast, cube_size, max_level(cube_size), (*coded)[&brick]);
  measure(of + "/ActivityForecast", piece, [&piece](Brick& brick) { piece.forecast(brick); });
  measure(of + "/ActivityEncode", piece, [](Brick& brick) {
    Bytes bytes;
    encode_activity(brick.active, brick.forecast, cube_size, max_level(cube_size), bytes);
    benchmark::DoNotOptimize(bytes.data());
  });
  measure(of + "/ActivityDecode", piece, [coded](Brick& brick) {
    LatticeBits active(brick.closed);
    check(decode_activity(coded->at(&brick), brick.forecast, cube_size, max_level(cube_size), active));
  });
}

void voxel_stages(const std::string& of, Piece& piece, std::int64_t max_error) {
  const std::string suffix = "/E:" + std::to_string(max_error);
  const VoxelBounds bounds{max_error, -1};
  auto coded = std::make_shared<Coded>();
  const auto encode = [bounds](const Brick& brick, Bytes& bytes) {
    std::vector<Sample> back(brick.samples.size());
    encode_voxels<Sample>(brick.samples, {brick.owned, nullptr, bounds}, back, bytes).finish();
  };
  for (const Brick& brick : piece.bricks) encode(brick, (*coded)[&brick]);
  measure(of + "/VoxelEncode" + suffix, piece, [encode](Brick& brick) {
    Bytes bytes;
    encode(brick, bytes);
    benchmark::DoNotOptimize(bytes.data());
  });
  measure(of + "/VoxelDecode" + suffix, piece, [coded, bounds](Brick& brick) {
    std::vector<Sample> back(brick.samples.size());
    std::vector<std::uint8_t> carried;
    check(decode_voxels<Sample>(coded->at(&brick), {brick.owned, nullptr, bounds}, back, carried));
  });
  measure(of + "/PredictionFit" + suffix, piece, [max_error](Brick& brick) {
    const double noise = static_cast<double>(max_error * (max_error + 1)) / 3;
    benchmark::DoNotOptimize(
        fit_weights<Sample>(brick.samples, brick.owned.size(), all_taps, brick.samples.front(), 8191, noise));
  });
}

void point_stages(const std::string& of, Piece& piece, std::int64_t point_error) {
  const std::string suffix = "/E:" + std::to_string(point_error);
  auto stored = std::make_shared<std::map<const Brick*, std::vector<Sample>>>();
  auto coded = std::make_shared<Coded>();
  for (const Brick& brick : piece.bricks) {
    std::vector<Sample>& values = (*stored)[&brick];
    for (const Sample value : brick.vertices) values.push_back(stored_point(value, point_error));
    encode_points<Sample>(values, brick.active, cube_size, point_error, (*coded)[&brick]);
  }
  measure(of + "/PointEncode" + suffix, piece, [stored, point_error](Brick& brick) {
    Bytes bytes;
    encode_points<Sample>(stored->at(&brick), brick.active, cube_size, point_error, bytes);
    benchmark::DoNotOptimize(bytes.data());
  });
  measure(of + "/PointDecode" + suffix, piece, [coded, point_error](Brick& brick) {
    std::vector<Sample> values(brick.vertices.size());
    check(decode_points<Sample>(coded->at(&brick), brick.active, cube_size, point_error, values));
  });
}

void interpolation_stage(const std::string& of, Piece& piece) {
  measure(of + "/Interpolation", piece, [](Brick& brick) {
    std::vector<std::int32_t> values(brick.vertices.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = to_fixed<std::int32_t>(brick.vertices[i], cube_size);
    interpolate<std::int32_t>(brick.active, brick.closed, cube_size, values);
    benchmark::DoNotOptimize(values.data());
  });
}

/// Labels of bricks of 64 x 64 x 64 voxels: 1,700 balls in 320 x 320 x 128 voxels, later ones over earlier ones.
/// With `count` = 2, all have the same label.
std::vector<std::vector<std::uint16_t>> labels_of_balls(std::uint32_t count) {
  constexpr std::int64_t side = 64;
  constexpr Index3 dims = {320, 320, 128};
  const Box whole = Box::of_size(dims);
  std::vector<std::uint16_t> volume(static_cast<std::size_t>(whole.count()));
  std::mt19937 random(1);
  const auto below = [&](std::int64_t end) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(end));
  };
  for (int ball = 0; ball < 1700; ++ball) {
    const Index3 centre = {below(dims.x), below(dims.y), below(dims.z)};
    const std::int64_t radius = 4 + below(9);
    const auto label = static_cast<std::uint16_t>(1 + below(count - 1));
    const Box box = intersection(Box{centre, centre}.grown(radius), whole);
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x) {
          const Index3 d = Index3{x, y, z} - centre;
          if (d.x * d.x + d.y * d.y + d.z * d.z <= radius * radius)
            volume[static_cast<std::size_t>((z * dims.y + y) * dims.x + x)] = label;
        }
  }
  std::vector<std::vector<std::uint16_t>> bricks;
  for (std::int64_t z = 0; z < dims.z; z += side)
    for (std::int64_t y = 0; y < dims.y; y += side)
      for (std::int64_t x = 0; x < dims.x; x += side) {
        std::vector<std::uint16_t>& brick = bricks.emplace_back();
        for (std::int64_t row = 0; row < side * side; ++row) {
          const auto first = volume.begin() + ((z + row / side) * dims.y + y + row % side) * dims.x + x;
          brick.insert(brick.end(), first, first + side);
        }
      }
  return bricks;
}

void label_stages(const std::string& of, std::uint32_t count) {
  constexpr Index3 size = {64, 64, 64};
  const auto bricks = std::make_shared<std::vector<std::vector<std::uint16_t>>>(labels_of_balls(count));
  const auto coded = std::make_shared<std::vector<Bytes>>();
  for (const auto& labels : *bricks) append_labels(labels, size, count, coded->emplace_back());
  const auto measure_labels = [&](const std::string& name, const std::function<void(std::size_t)>& stage) {
    benchmark::RegisterBenchmark((of + name).c_str(), [bricks, stage](benchmark::State& state) {
      for (auto _ : state)
        for (std::size_t i = 0; i < bricks->size(); ++i) stage(i);
      const auto voxels = static_cast<double>(bricks->size() * bricks->front().size());
      state.counters["voxels/s"] = benchmark::Counter(voxels, benchmark::Counter::kIsIterationInvariantRate);
    })->Unit(benchmark::kMillisecond);
  };
  measure_labels("/LabelEncode", [bricks, count](std::size_t i) {
    Bytes bytes;
    append_labels((*bricks)[i], size, count, bytes);
    benchmark::DoNotOptimize(bytes.data());
  });
  const auto back = std::make_shared<std::vector<std::uint16_t>>(bricks->front().size());
  measure_labels("/LabelDecode", [coded, back, count](std::size_t i) {
    check(decode_labels((*coded)[i], size, count, *back));
  });
}

void all_stages(const std::string& of, Piece& piece) {
  grid_stages(of, piece);
  for (const std::int64_t max_error : {0, 2, 20}) voxel_stages(of, piece, max_error);
  for (const std::int64_t point_error : {0, 1}) point_stages(of, piece, point_error);
  interpolation_stage(of, piece);
}

}  // namespace
}  // namespace tagrid

int main(int count, char** arguments) {
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 64;
  tagrid::Piece phantom = tagrid::phantom();
  tagrid::all_stages("phantom", phantom);
  const std::unique_ptr<tagrid::Piece> ankle = tagrid::ankle();
  if (ankle)
    tagrid::all_stages("ankle", *ankle);
  else
    std::cerr << "no ankle: " TAGRID_SOURCE_DIR "/../shared/data/vhf_ankle.raw is missing\n";
  tagrid::label_stages("mask", 2);
  tagrid::label_stages("balls", 1000);
  benchmark::AddCustomContext("build", TAGRID_BUILD_TYPE);
  benchmark::AddCustomContext("compiler", __VERSION__);
  benchmark::RunSpecifiedBenchmarks();
}
