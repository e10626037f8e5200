#include "pipeline/verify.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "grid/conformity.h"
#include "io/errors.h"
#include "pipeline/memory_plan.h"
#include "pipeline/shared_faces.h"
#include "stages/brick_codec.h"
#include "stages/sample_statistics.h"

namespace tagrid {
namespace {

std::string text(Index3 p) { return fmt::format("({}, {}, {})", p.x, p.y, p.z); }

// Compares decoded slices with the original as they come, a layer of bricks at a time.
class AgainstOriginal {
 public:
  AgainstOriginal(const std::string& name, const CodingParameters& parameters, const std::string& original,
                  const std::optional<RawDescription>& raw)
      : name_(name),
        parameters_(parameters),
        bricks_(parameters.bricks()),
        reader_(open_volume(original, raw)) {
    const VolumeInfo& info = reader_.info();
    if (info.dims != parameters.dims || info.type != parameters.type)
      throw BrokenInput(fmt::format("{}: the original has {} samples of {}, the file {} of {}", original,
                                    text(info.dims), name_of(info.type), text(parameters.dims),
                                    name_of(parameters.type)));
  }

  bool random_access() const { return reader_.random_access(); }
  /// The activity of the next brick of the rows.
  void add_activity(const LatticeBits& active) {
    if (parameters_.surface_error >= 0) active_.push_back(active);
  }

  void compare(const DecodedRows& rows) {
    slice_.resize(rows.slice_bytes());
    decoded_.resize(rows.slice_bytes());
    rows_ = rows.box();
    for (rows_.low.z = rows.box().low.z; rows_.low.z <= rows.box().high.z; ++rows_.low.z) {
      rows_.high.z = rows_.low.z;
      reader_.read_rows(slice_.data(), rows_);
      rows.copy_slice(rows_.low.z, decoded_);
      with_sample_type(parameters_.type, [&](auto type) {
        using T = decltype(type);
        compare_slice(reinterpret_cast<const T*>(slice_.data()), reinterpret_cast<const T*>(decoded_.data()));
      });
    }
    active_.clear();
  }
  /// Everything was compared. Returns the largest error. What the file says of its errors must be what they
  /// are.
  double finish(const TagIndex& index) {
    reader_.finish();
    // Real sums depend on the order of what is added, a little.
    const double real = index.total.sum_squared_real;
    if (worst_ != index.total.max_error || squares_ != index.total.sum_squared_error ||
        !(std::abs(real_squares_ - real) <= 1e-9 * real))
      throw BrokenInput(fmt::format(
          "{}: the index: the errors that it records are not those against this original", name_));
    return worst_;
  }

 private:
  template <class T>
  void compare_slice(const T* original, const T* decoded) {
    const double bound = parameters_.max_error < 0 ? INFINITY : parameters_.max_error;
    const double tightest = parameters_.surface_error < 0 ? bound : parameters_.surface_error;
    for (std::int64_t i = 0; i < rows_.count(); ++i) {
      const double error = sample_error(original[i], decoded[i]);
      worst_ = std::max(worst_, error);
      if constexpr (std::is_integral_v<T>)
        squares_ += static_cast<Uint128>(error) * static_cast<Uint128>(error);
      else
        real_squares_ = Statistics::limited(real_squares_ + error * error);
      if (error <= tightest) continue;
      const Index3 p{i % parameters_.dims.x, rows_.low.y + i / parameters_.dims.x, rows_.low.z};
      if (error > bound || is_active(p))
        throw BrokenInput(fmt::format("{}: voxel {} is {}, the original {}: further apart than {}", name_,
                                      text(p), +decoded[i], +original[i], error > bound ? bound : tightest));
    }
  }

  bool is_active(Index3 p) const {
    if (active_.empty()) return false;
    const auto brick = [&](std::int64_t coordinate) {
      return coordinate == 0
                 ? 0
                 : (coordinate - 1) / (std::int64_t{parameters_.brick_edge} * parameters_.cube_size);
    };
    const std::int64_t row = brick(p.y) - brick(rows_.low.y);
    return active_[static_cast<std::size_t>(row * bricks_.bricks(0) + brick(p.x))].test(p);
  }

  std::string name_;
  const CodingParameters& parameters_;
  BrickGrid bricks_;
  VolumeReader reader_;
  std::vector<LatticeBits> active_;  ///< of the bricks of the rows; only where they have a bound of their own
  std::vector<std::byte> slice_, decoded_;  ///< of the original, and of the file
  Box rows_;                                ///< of one slice, that are compared
  double worst_ = 0;
  Uint128 squares_ = 0;
  double real_squares_ = 0;
};

// What the index says, against what the bricks hold.
class StatisticsCheck {
 public:
  explicit StatisticsCheck(const CodingParameters& parameters) : parameters_(parameters) {}

  void add(const DecodedBrick& brick) {
    const Index3 position = parameters_.bricks().position(brick.id);
    count_active(brick.active, parameters_, position, counted_);
    with_sample_type(parameters_.type, [&](auto type) {
      using T = decltype(type);
      const auto* first = reinterpret_cast<const T*>(brick.samples.data());
      double low = INFINITY, high = -INFINITY;
      for (std::size_t i = 0; i < brick.samples.size() / sizeof(T); ++i) {
        if (!is_finite(first[i])) continue;
        low = std::min(low, static_cast<double>(first[i]));
        high = std::max(high, static_cast<double>(first[i]));
      }
      ranges_.push_back({low, high});
    });
    counted_.samples += brick.samples.size() / size_of(parameters_.type);
  }
  std::uint64_t active_points() const {
    std::uint64_t sum = 0;
    for (const auto n : counted_.active) sum += n;
    return sum;
  }
  void compare(const TagReader& reader) const {
    const TagIndex& index = reader.index();
    const auto fail = [&](const std::string& what) {
      throw BrokenInput(reader.name() + ": the index: " + what);
    };
    if (index.total.active != counted_.active) fail("active points are not as many as in the bricks");
    if (!(index.total.max_error >= 0)) fail("the recorded error is no number");
    if (index.total.samples != counted_.samples) fail("the number of samples does not fit");
    const double bound = parameters_.max_error;
    if (bound >= 0 && !(index.total.max_error <= bound)) fail("the recorded error is above the bound");
    for (std::size_t i = 0; i < ranges_.size(); ++i)
      // Without finite samples both are infinite, and their difference is no number.
      if (std::abs(ranges_[i].first - index.bricks[i].low) > index.total.max_error ||
          std::abs(ranges_[i].second - index.bricks[i].high) > index.total.max_error)
        fail(fmt::format("the value range of brick {} is not that of its voxels", i));
  }

 private:
  const CodingParameters& parameters_;
  Statistics counted_;
  std::vector<std::pair<double, double>> ranges_;
};

}  // namespace

VerifyResult verify_file(const std::string& input, const std::string& original,
                         const std::optional<RawDescription>& raw, const Resources& resources,
                         const Progress& progress) {
  TagReader reader(input);
  const CodingParameters& parameters = reader.parameters();
  std::optional<AgainstOriginal> against;
  if (!original.empty()) against.emplace(reader.name(), parameters, original, raw);
  const bool any_order = !against || against->random_access();
  const DecodePlan plan =
      plan_decoding(parameters, resources, any_order ? DecodeUse::verify : DecodeUse::verify_stream);
  SharedFaces faces(parameters);
  StatisticsCheck statistics(parameters);
  const std::uint64_t total = sample_bytes(parameters.dims, parameters.type).value();
  std::uint64_t done = 0;

  DecodeStreams streams;
  streams.name = reader.name();
  streams.read_brick = [&](BrickBytes& brick) { return reader.read_brick(brick); };
  streams.inspect_brick = [&](const DecodedBrick& brick) {
    const auto fail = [&](const std::string& what, Index3 p) {
      throw BrokenInput(fmt::format("{}: brick {}: {} at {}", reader.name(), brick.id, what, text(p)));
    };
    if (const auto p =
            first_nonconforming_point(brick.active, parameters.domain().padded(), parameters.cube_size))
      fail("the grid is not conforming", *p);
    if (const auto p = faces.first_difference(brick)) fail("it disagrees with its neighbour", *p);
    statistics.add(brick);
    if (against) against->add_activity(brick.active);
  };
  streams.write_rows = [&](const DecodedRows& layer) {
    if (against) against->compare(layer);
    done += layer.bytes();
    if (progress) progress(done, total);
  };
  run_decode_graph(parameters, BrickRows::all(parameters.bricks()), plan.budget, streams);
  statistics.compare(reader);

  VerifyResult result{reader.header(),
                      reader.index(),
                      reader.sizes().file,
                      parameters.bricks().count(),
                      statistics.active_points(),
                      std::nullopt};
  if (against) result.max_error = against->finish(reader.index());
  return result;
}

}  // namespace tagrid
