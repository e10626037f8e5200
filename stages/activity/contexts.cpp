#include "stages/activity/contexts.h"

#include <algorithm>
#include <cstdlib>

namespace tagrid {
namespace {

// 64 counters that stop at two: one bit for "one or more", the other for "two or more".
struct UpToTwo {
  Word any = 0, two = 0;

  void add(Word bits) {
    two |= any & bits;
    any |= bits;
  }
};

// 64 counters of five bits.
struct Counters {
  std::array<Word, 5> bits{};

  void add(Word bit) { carry(0, bit); }
  // Adds numbers of two bits.
  void add(Word low, Word high) { carry(0, low), carry(1, high); }

 private:
  void carry(std::size_t place, Word bit) {
    for (std::size_t i = place; i < bits.size(); ++i) {
      const Word next = bits[i] & bit;
      bits[i] ^= bit;
      bit = next;
    }
  }
};

// What is known of the points before one, along x, y and z.
struct Past {
  int surprise = 0;  // active against the forecast, less inactive against the forecast
  std::size_t active = 0, inactive = 0;
};

// Bits 0, 2 and 5: whether the points before it along x, y and z are candidates; bits 1, 4 and 7: whether
// they are expected to be active; bits 3 and 6, and `before` for x: whether they are.
constexpr Past past_of(std::size_t bits, bool before) {
  Past past;
  const auto add = [&past](bool candidate, bool active, bool forecast) {
    if (!candidate) return;
    ++(active ? past.active : past.inactive);
    if (active != forecast) past.surprise += active ? 1 : -1;
  };
  add((bits & 1) != 0, before, (bits & 2) != 0);
  add((bits & 4) != 0, (bits & 8) != 0, (bits & 16) != 0);
  add((bits & 32) != 0, (bits & 64) != 0, (bits & 128) != 0);
  return past;
}

// Tables over the bytes of a point, so that a context takes a few look-ups.
struct ForecastTables {
  std::array<std::uint8_t, 512> surprise{}, past{};  // by past_ and `before`
  std::array<std::uint8_t, 256> near{};

  constexpr ForecastTables() {
    for (std::size_t bits = 0; bits < 512; ++bits) {
      const Past p = past_of(bits & 255, bits >= 256);
      surprise[bits] = static_cast<std::uint8_t>(p.surprise + 3);
      past[bits] = static_cast<std::uint8_t>(4 * p.active + p.inactive);
    }
    for (std::size_t bits = 0; bits < 256; ++bits) {
      const auto bit = [bits](int i) { return static_cast<int>(bits >> i & 1); };
      const int beside = (bit(0) + bit(1)) - (bit(2) + bit(3)),
                around = (bit(4) + bit(5)) - (bit(6) + bit(7));
      near[bits] = static_cast<std::uint8_t>(5 * (beside + 2) + (around + 2));
    }
  }
};
constexpr ForecastTables forecast_tables;

struct PlainTables {
  std::array<std::uint8_t, 512> active{}, directed{};  // by past_ and `before`

  constexpr PlainTables() {
    for (std::size_t bits = 0; bits < 512; ++bits) {
      const auto bit = [bits](int i) { return bits >> i & 1; };
      // Twice the state, 0 no candidate, 1 inactive, 2 active; and whether the point after is a candidate.
      const std::size_t x = bit(0) != 0 ? 2 + 2 * bit(8) : 0, y = 2 * bit(2) + 2 * bit(3),
                        z = 2 * bit(5) + 2 * bit(6);
      directed[bits] = static_cast<std::uint8_t>(((x + bit(1)) * 6 + y + bit(4)) * 6 + z + bit(7));
      active[bits] = static_cast<std::uint8_t>((x == 4) + (y == 4) + (z == 4));
    }
  }
};
constexpr PlainTables plain_tables;

using ForecastModels = std::array<AdaptiveBit, ForecastContexts::sizes[0] + ForecastContexts::sizes[1]>;

ForecastModels forecast_models() {
  // Of points with the forecast 0 .. 3 inside the box, and at its border. Fitted to scans.
  constexpr int of_near[2][4] = {{-830, -249, 719, 1484}, {-526, -121, 452, 993}},
                of_past[2][4] = {{-16, 354, 1040, 982}, {76, 329, 631, 668}};
  ForecastModels models;
  std::size_t next = 0;
  for (int c = 0; c < 24; ++c)
    for (int surprise = -3; surprise <= 3; ++surprise)
      for (int beside = -2; beside <= 2; ++beside)
        for (int around = -2; around <= 2; ++around)
          models[next++] =
              AdaptiveBit(of_near[c / 4 % 2][c % 4] + 400 * surprise + 64 * beside + 96 * around);
  for (int c = 0; c < 24; ++c)
    for (int past = 0; past < 16; ++past)
      for (int forecasts = 0; forecasts < 10; ++forecasts)
        models[next++] =
            AdaptiveBit(of_past[c / 4 % 2][c % 4] + 160 * (past / 4) - 320 * (past % 4) - 80 * forecasts);
  return models;
}

}  // namespace

std::vector<AdaptiveBit> ForecastContexts::models() {
  static const ForecastModels models = forecast_models();
  return {models.begin(), models.end()};
}

Word ForecastContexts::at_border(std::int64_t y, std::int64_t z, std::size_t i) const {
  const Box& box = active_.box();
  if (y == box.low.y || y == box.high.y || z == box.low.z || z == box.high.z) return ~Word{0};
  const auto last = static_cast<std::size_t>(box.size().x - 1);
  return (i == 0 ? Word{1} : 0) | (i == last / 64 ? Word{1} << (last % 64) : 0);
}

void ForecastContexts::begin_pass(const Pass& pass) {
  pass_ = pass;
  slices_.clear();
  const auto slice_of = [this](Index3 step) -> Slice& {
    auto slice = std::find_if(slices_.begin(), slices_.end(), [&](const Slice& s) { return s.dz == step.z; });
    if (slice == slices_.end()) slice = slices_.insert(slice, {step.z, 0, false, {}, {}});
    if (std::abs(step.y) < 32)
      slice->rows |= Word{1} << (32 + step.y);
    else
      slice->far_away = true;
    return *slice;
  };
  const Surroundings surroundings(pass);
  for (const Index3 step : surroundings.beside()) slice_of(step).beside.add(step);
  for (const Index3 step : surroundings.around()) slice_of(step).around.add(step);
}

void ForecastContexts::look(std::int64_t y, std::int64_t z, std::size_t i) {
  const auto neighbour = [&](Index3 step) { return NeighbourWord(active_, y, z, i, step); };
  const std::int64_t d = 2 * pass_.unit;
  const LatticeBits &likely = forecast_.at_least(1), &expected = forecast_.at_least(2),
                    &certain = forecast_.at_least(3);

  const NeighbourWord x_before = neighbour({-d, 0, 0}), y_before = neighbour({0, -d, 0}),
                      z_before = neighbour({0, 0, -d}), self = neighbour({});
  past_.transpose({x_before.of(candidates_), x_before.of(expected), y_before.of(candidates_),
                   y_before.of(active_), y_before.of(expected), z_before.of(candidates_),
                   z_before.of(active_), z_before.of(expected)});

  Counters forecasts;
  for (const NeighbourWord& word :
       {x_before, y_before, z_before, neighbour({d, 0, 0}), neighbour({0, d, 0}), neighbour({0, 0, d})}) {
    const Word two = word.of(expected);  // The sets are nested: this is the second bit of the number.
    forecasts.add((word.of(likely) & ~two) | word.of(certain), two);
  }
  const Word two = self.of(expected);
  own_.transpose({(self.of(likely) & ~two) | self.of(certain), two, at_border(y, z, i), forecasts.bits[1],
                  forecasts.bits[2], forecasts.bits[3], forecasts.bits[4], 0});

  look_near(y, z, i);
}

void ForecastContexts::look_near(std::int64_t y, std::int64_t z, std::size_t i) {
  any_near_ = false;
  UpToTwo more_beside, less_beside, more_around, less_around;
  for (const Slice& slice : slices_) {
    if (!slice.far_away && (surprises_.rows_around(y, z + slice.dz) & slice.rows) == 0) continue;
    any_near_ = true;
    for (const Index3 step : slice.beside.all()) {
      const NeighbourWord word(active_, y, z, i, step);
      more_beside.add(word.of(surprises_.more()));
      less_beside.add(word.of(surprises_.less()) & word.of(candidates_));
    }
    for (const Index3 step : slice.around.all()) {
      const NeighbourWord word(active_, y, z, i, step);
      more_around.add(word.of(surprises_.more()));
      less_around.add(word.of(surprises_.less()));
    }
  }
  if (any_near_)
    near_.transpose({more_beside.any, more_beside.two, less_beside.any, less_beside.two, more_around.any,
                     more_around.two, less_around.any, less_around.two});
}

PointContext ForecastContexts::at(int x, bool before) const {
  const std::size_t past = past_[x] | std::size_t{before} << 8, own = own_[x];
  const std::size_t of_point = static_cast<std::size_t>(pass_.odd_count - 1) * 8 + (own & 7);
  const std::size_t near = any_near_ ? near_[x] : 0;
  return {{(of_point * 7 + forecast_tables.surprise[past]) * 25 + forecast_tables.near[near],
           sizes[0] + (of_point * 16 + forecast_tables.past[past]) * 10 + (own >> 3)},
          own & 3};
}

void PlainContexts::look(std::int64_t y, std::int64_t z, std::size_t i) {
  const auto neighbour = [&](Index3 step) { return NeighbourWord(active_, y, z, i, step); };
  const std::int64_t d = 2 * pass_.unit;
  const NeighbourWord y_before = neighbour({0, -d, 0}), z_before = neighbour({0, 0, -d});
  past_.transpose({neighbour({-d, 0, 0}).of(candidates_), neighbour({d, 0, 0}).of(candidates_),
                   y_before.of(candidates_), y_before.of(active_), neighbour({0, d, 0}).of(candidates_),
                   z_before.of(candidates_), z_before.of(active_), neighbour({0, 0, d}).of(candidates_)});
  Counters around, beside;
  for (const Index3 step : surroundings_.around()) around.add(neighbour(step).of(active_));
  for (const Index3 step : surroundings_.beside()) beside.add(neighbour(step).of(active_));
  const auto counts = [](const Counters& c) {
    return BytesOfPoints::Words{c.bits[0], c.bits[1], c.bits[2], c.bits[3], c.bits[4]};
  };
  around_.transpose(counts(around));
  beside_.transpose(counts(beside));
}

PointContext PlainContexts::at(int x, bool before) const {
  const std::size_t past = past_[x] | std::size_t{before} << 8, around = (around_[x] + 1) / 2;
  const auto odd = static_cast<std::size_t>(pass_.odd_count - 1);
  return {{((odd * 13 + around) * 4 + plain_tables.active[past]) * 9 + beside_[x],
           sizes[0] + (odd * 216 + plain_tables.directed[past]) * 13 + around},
          odd};
}

}  // namespace tagrid
