#include "stages/activity/forecast.h"

#include <algorithm>
#include <bit>

#include "stages/marks/base_edges.h"
#include "stages/marks/heights.h"
#include "stages/marks/subdivide.h"
#include "stages/volume/vector_code.h"

namespace tagrid {

namespace forecast {

using Exceeded = std::array<std::int32_t, EdgeBatch::capacity>;

// Counts the thresholds that each edge exceeds; returns whether any edge exceeds one. The weights are 720
// times the integrals of the products of quadratic B-splines over the three segments, in terms of sums and
// differences of the two ends; sums and differences do not mix.
TAGRID_VECTOR_CODE
bool compare(const EdgeBatch& edges, std::size_t count, float inverse_length, float sixth, float limit,
             Exceeded& exceeded) {
  std::int32_t any = 0;
  TAGRID_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float chord = edges.rise[i] * inverse_length;
    const float stretch = 1.0F + chord * chord;
    const float left = edges.slope_left[i] - chord, right = edges.slope_right[i] - chord;
    const float bend_left = sixth * edges.bend_left[i], bend_right = sixth * edges.bend_right[i];
    const float p = left - right, s = left + right, a = bend_right - bend_left, b = bend_left + bend_right;
    const float even = p * (91.0F * p + 106.0F * b) + 39.0F * (b * b);
    const float odd = s * (117.0F * s - 166.0F * a) + 73.0F * (a * a);
    const float variance = even + odd, bound = limit * (stretch * stretch);
    exceeded[i] = (variance > 0.6F * bound) + (variance > bound) + (variance > 1.6F * bound);
    any |= exceeded[i];
  }
  return any != 0;
}

}  // namespace forecast

namespace {

// 1/sqrt(k) and sqrt(k)/3 for edges with k odd axes.
constexpr float inverse_sqrt[4] = {0, 1, 0.70710678F, 0.57735027F};
constexpr float sqrt_over_three[4] = {0, 1.0F / 3, 0.47140452F, 0.57735027F};

// Bit i is the lowest bit of byte i.
std::uint64_t lowest_bits(std::uint64_t eight_bytes) {
  return ((eight_bytes & 0x0101010101010101U) * 0x0102040810204080U) >> 56;
}

// The inverse: bytes of 0 or 1.
std::uint64_t as_bytes(std::uint64_t eight_bits) {
  const std::uint64_t one_in_each = (eight_bits * 0x0101010101010101U) & 0x8040201008040201U;
  return ((one_in_each + 0x7f7f7f7f7f7f7f7fU) >> 7) & 0x0101010101010101U;
}

// Moves sixteen bits to every second one of thirty-two.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 8) & 0x00ff00ff;
  bits = (bits | bits << 4) & 0x0f0f0f0f;
  bits = (bits | bits << 2) & 0x33333333;
  return (bits | bits << 1) & 0x55555555;
}

using Exceeding = std::array<LatticeBits, Forecast::levels>;

class Forecaster {
 public:
  Forecaster(const CurvatureField& field, const CodingParameters& parameters, float field_scale)
      : field_(field),
        parameters_(parameters),
        rise_scale_(field_scale / CurvatureField::value_divisor),
        limit_(static_cast<float>(
            2369.0 / (static_cast<double>(parameters.accuracy) * static_cast<double>(parameters.accuracy)))) {
    for (LatticeBits& bits : exceeding_) bits = LatticeBits(field.box);
  }

  const Exceeding& run() {
    for_each_row_of_edges(intersection(field_.box, parameters_.domain().volume()), parameters_.cube_size,
                          parameters_.max_level, [&](const RowOfEdges& row) { forecast_row(row); });
    close_under_parents(exceeding_, parameters_.cube_size);
    return exceeding_;
  }

 private:
  void forecast_row(const RowOfEdges& row) {
    const auto unit = static_cast<float>(row.unit);
    const auto odd = static_cast<std::size_t>(row.odd);
    if (none_exceeds(bounds_of(field_, row, rise_scale_), sqrt_over_three[odd] * unit)) return;
    for (std::int64_t from = 0; from < row.count; from += EdgeBatch::capacity) {
      const std::int64_t n = std::min<std::int64_t>(row.count - from, EdgeBatch::capacity);
      load_edges(field_, row, from, n, rise_scale_, edges_);
      if (!forecast::compare(edges_, static_cast<std::size_t>(n), inverse_sqrt[odd] * (0.5F / unit),
                             sqrt_over_three[odd] * unit, limit_, exceeded_))
        continue;
      // If the row was loaded in two runs: every second edge, then the edges between.
      std::int64_t lane = 0;
      for (int first = 0; first < row.runs(); ++first) {
        const std::int64_t count = (n - first + row.runs() - 1) / row.runs();
        for (std::int64_t i = 0; i < count; i += 8)
          set_bits(row.point(from + first + i * row.runs()), 2 * row.unit * row.runs(),
                   eight_at(lane + i, std::min<std::int64_t>(count - i, 8)));
        lane += count;
      }
    }
  }

  // True if no edge of a row can exceed the lowest threshold. Let x be the largest |left| and |right| in
  // compare(), and y the largest |bend_left| and |bend_right|: then p p + s s <= 4 x x and a a + b b <= 4 y
  // y.
  bool none_exceeds(const EdgeBounds& bounds, float sixth) const {
    const float x = bounds.slope + bounds.chord, y = sixth * bounds.bend;
    return 4.0F * (117.0F * (x * x) + 166.0F * (x * y) + 73.0F * (y * y)) < 0.59F * limit_;
  }

  // The thresholds that up to eight edges exceed, with the first edge in the lowest byte.
  std::uint64_t eight_at(std::int64_t lane, std::int64_t count) const {
    std::uint64_t eight = 0;
    for (std::int64_t i = count; i-- > 0;)
      eight = eight << 8 | static_cast<std::uint64_t>(exceeded_[static_cast<std::size_t>(lane + i)]);
    return eight;
  }

  // Sets the bits of up to eight points in a row, at the distance `step` from each other.
  void set_bits(Index3 p, std::int64_t step, std::uint64_t exceeded) {
    if (exceeded == 0) return;  // the most frequent case
    const std::array<std::uint64_t, Forecast::levels> bits = {lowest_bits(exceeded | exceeded >> 1),
                                                              lowest_bits(exceeded >> 1),
                                                              lowest_bits(exceeded & exceeded >> 1)};
    const auto x = static_cast<std::size_t>(p.x - field_.box.low.x);
    for (std::size_t level = 0; level < bits.size(); ++level) {
      std::uint64_t* row = exceeding_[level].row(p.y, p.z);
      // All in one word: batches begin at a multiple of 8 steps, or less than one step after it.
      if (step == 2 || step == 4)
        row[x / 64] |= (step == 2 ? spread(bits[level]) : spread(spread(bits[level]))) << (x % 64);
      else
        for (std::uint64_t rest = bits[level]; rest != 0; rest &= rest - 1)
          exceeding_[level].set(p + step * std::countr_zero(rest) * unit_vector(0));
    }
  }

  const CurvatureField& field_;
  const CodingParameters& parameters_;
  float rise_scale_, limit_;
  EdgeBatch edges_{};
  forecast::Exceeded exceeded_{};
  Exceeding exceeding_;
};

// The samples of `box`; points outside `owned` get the value of the nearest point in it.
template <class T>
std::vector<T> extended(std::span<const T> samples, const Box& owned, const Box& box) {
  std::vector<T> values;
  values.reserve(static_cast<std::size_t>(box.count()));
  const std::int64_t width = owned.size().x;
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
      const auto row = samples.begin() + owned.offset(owned.nearest({owned.low.x, y, z}));
      values.insert(values.end(), static_cast<std::size_t>(owned.low.x - box.low.x), row[0]);
      values.insert(values.end(), row, row + width);
      values.insert(values.end(), static_cast<std::size_t>(box.high.x - owned.high.x), row[width - 1]);
    }
  return values;
}

}  // namespace

Forecast::Forecast(const std::array<LatticeBits, levels>& exceeding)
    : values_(64 * exceeding[0].words().size()) {
  for (std::size_t word = 0; word < exceeding[0].words().size(); ++word) {
    if (exceeding[0].words()[word] == 0) continue;  // then there are none in the other sets either
    for (std::size_t byte = 0; byte < 8; ++byte) {
      std::uint64_t sums = 0;
      for (const LatticeBits& bits : exceeding) sums += as_bytes(bits.words()[word] >> (8 * byte) & 255);
      for (std::size_t i = 0; i < 8; ++i)
        values_[64 * word + 8 * byte + i] = static_cast<std::uint8_t>(sums >> (8 * i));
    }
  }
}

std::uint64_t working_bytes_of_forecast(SampleType type, Index3 size) {
  const Index3 read = Box::of_size(size).grown(CurvatureField::halo).size();
  const auto count = [](const Index3& n) { return static_cast<std::uint64_t>(n.x * n.y * n.z); };
  const std::uint64_t heights = is_wide_type(type) ? count(size) * sizeof(double) : 0,
                      values = count(read) * (is_wide_type(type) ? sizeof(double) : size_of(type)),
                      bits = LatticeBits::working_bytes(size),
                      forecast = CurvatureField::working_bytes(size) + Forecast::levels * bits +
                                 std::max(working_bytes_of_closure(size), Forecast::working_bytes(size));
  return values + std::max(heights, forecast);
}

template <class T>
Forecast forecast_activity(std::span<const T> samples, const CodingParameters& parameters, Index3 brick) {
  const Box closed = parameters.bricks().closed_box(brick), owned = parameters.bricks().owned_box(brick),
            read = closed.grown(CurvatureField::halo);
  CurvatureField field;
  if constexpr (is_wide<T>) {
    const std::vector<double> heights =
        extended<double>(heights_of<T>(samples, parameters.range_low, parameters.field_scale), owned, read);
    evaluate_curvature(Samples<double>{read, heights.data()}, closed, 1, field);
    return Forecast(Forecaster(field, parameters, 1).run());
  } else {
    if (all_equal(samples))
      return Forecast(Exceeding{LatticeBits(closed), LatticeBits(closed), LatticeBits(closed)});
    const std::vector<T> values = extended<T>(samples, owned, read);
    evaluate_curvature(Samples<T>{read, values.data()}, closed, parameters.field_scale, field);
    return Forecast(Forecaster(field, parameters, static_cast<float>(parameters.field_scale)).run());
  }
}

#define TAGRID_INSTANTIATE(T)                                                                         \
  template Forecast forecast_activity(std::span<const T> samples, const CodingParameters& parameters, \
                                      Index3 brick);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
