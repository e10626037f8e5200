#include "stages/values/transform/coefficients.h"

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "stages/entropy/limited_encoder.h"
#include "stages/entropy/rans_coder.h"
#include "stages/values/best/residual_model.h"

namespace tagrid {

namespace {
constexpr std::int32_t first_weight = 1 << 15;  ///< of a context, in 2^-16
}

CoefficientModel::CoefficientModel() {
  constexpr std::uint32_t seen_near = 12, seen_expected = 24, seen_flags = 20, seen_signs = 12;
  constexpr int unit = 16;
  for (std::size_t event = 0; event < magnitude_events; ++event) {
    for (std::size_t i = 0; i < near[event].size(); ++i)
      near[event][i] = AdaptiveBit(near_start[event][i] * unit, seen_near);
    for (std::size_t i = 0; i < expected[event].size(); ++i)
      expected[event][i] = AdaptiveBit(expected_start[event][i / orientations] * unit, seen_expected);
    weights[event].fill({first_weight, first_weight});
    Refinement identity;
    for (std::size_t i = 0; i < refinement_steps; ++i)
      identity[i] = squash_table[std::min<std::size_t>(i * 128, 4095)];
    refined[event].fill(identity);
  }
  for (std::size_t i = 0; i < sign_contexts; ++i) sign[i] = AdaptiveBit(sign_start[i] * unit, seen_signs);
  for (std::size_t i = 0; i < far_sign_contexts; ++i)
    far_sign[i] = AdaptiveBit(far_sign_start[i] * unit, seen_signs);
  sign_weights.fill({first_weight, first_weight});
  for (std::size_t i = 0; i < band_contexts; ++i)
    zero_band[i] = AdaptiveBit(band_start[i] * unit, seen_flags);
  for (std::size_t i = 0; i < block_contexts; ++i)
    active_block[i] = AdaptiveBit(block_start[i] * unit, seen_flags);
}

namespace {

constexpr std::uint32_t forget_after = 255, forget_flags_after = 255;
constexpr std::int32_t weight_limit = 1 << 18;
constexpr int mix_shift = 14;  ///< how fast weights learn
constexpr std::uint32_t least_probability = 32;
constexpr std::int64_t block = 4;
constexpr std::int32_t largest_magnitude = 1 << 24;

// What an encoder weighs: a bit costs this part of the square of a step.
constexpr float lambda = 0.07f;
// A block is coded if one of its coefficients is at least this part of a step.
constexpr float least_active = 0.8f;

// Classes of a sum of magnitudes.
constexpr std::array<std::uint8_t, 64> near_class = [] {
  std::array<std::uint8_t, 64> classes{};
  for (std::size_t v = 0; v < 64; ++v)
    classes[v] = static_cast<std::uint8_t>(v < 4    ? v
                                           : v < 6  ? 4
                                           : v < 8  ? 5
                                           : v < 11 ? 6
                                           : v < 15 ? 7
                                           : v < 22 ? 8
                                           : v < 34 ? 9
                                           : v < 60 ? 10
                                                    : 11);
  return classes;
}();
std::size_t class_of_block(std::uint32_t sum) { return sum < 3 ? sum : sum < 6 ? 3 : sum < 15 ? 4 : 5; }

// -log2 of a probability in 2^-8, by its upper 12 bits.
constexpr std::array<std::uint16_t, 4096> make_costs() {
  std::array<std::uint16_t, 4096> costs{};
  for (std::uint32_t i = 0; i < 4096; ++i) {
    // The logarithm of (2i + 1) / 8192, bit by bit: squaring doubles it.
    std::uint64_t v = 2 * i + 1;
    const int whole = static_cast<int>(std::bit_width(v)) - 1;
    v <<= 31 - whole;
    std::uint32_t fraction = 0;
    for (int bit = 0; bit < 8; ++bit) {
      v = v * v >> 31;
      const bool two = v >> 32 != 0;
      fraction = 2 * fraction + two;
      if (two) v >>= 1;
    }
    costs[i] = static_cast<std::uint16_t>(13 * 256 - (static_cast<std::uint32_t>(whole) * 256 + fraction));
  }
  return costs;
}
constexpr std::array<std::uint16_t, 4096> cost_table = make_costs();

/// The magnitudes of a band, as bytes, with zeros around.
struct Magnitudes {
  static constexpr std::int64_t before = 2, after = 2, after_x = 9;

  std::size_t offset = 0;  ///< of the first coefficient, in the array of all bands
  std::int64_t row = 0, slice = 0;
  std::size_t blocks_offset = 0;  ///< of the first block, in the array of sums of blocks
  Index3 blocks{};
  bool is_zero = true;

  static std::int64_t padded(std::int64_t n) { return n + before + after; }
};

struct Group {
  alignas(16) std::array<std::int32_t, block> expected, around, parent;
};

template <class Coder>
class CoefficientPass {
 public:
  CoefficientPass(Coder& coder, CoefficientModel& model, const TransformShape& shape,
                  std::span<std::int32_t> coefficients)
      : coder_(coder), model_(model), shape_(shape), coefficients_(coefficients.data()) {
    std::size_t bytes = 0, blocks = 0;
    for (const Band& band : shape.bands) {
      Magnitudes m;
      m.row = band.size.x + Magnitudes::before + Magnitudes::after_x;
      m.slice = m.row * Magnitudes::padded(band.size.y);
      m.offset = bytes + static_cast<std::size_t>(Magnitudes::before * (m.slice + m.row + 1));
      bytes += static_cast<std::size_t>(m.slice * Magnitudes::padded(band.size.z));
      for (int axis = 0; axis < 3; ++axis) m.blocks[axis] = (band.size[axis] + block - 1) / block;
      m.blocks_offset = blocks;
      blocks += static_cast<std::size_t>(m.blocks.x * m.blocks.y * m.blocks.z);
      bands_.push_back(m);
    }
    magnitudes_.resize(bytes);
    signs_.resize(bytes, 1);
    sums_.resize(blocks);
    active_.resize(blocks);
  }

  bool run() {
    code_means();
    for (std::size_t i = 1; i < shape_.bands.size(); ++i) {
      code_band(i);
      if (coder_.exhausted()) return false;
    }
    return true;
  }

 private:
  std::int32_t* row_of(const Band& band, std::int64_t y, std::int64_t z) {
    return coefficients_ + ((band.low.z + z) * shape_.size.y + band.low.y + y) * shape_.size.x + band.low.x;
  }

  static std::int32_t dequantized(std::int64_t level, std::uint32_t step) {
    return static_cast<std::int32_t>(static_cast<std::uint64_t>((level * std::int64_t{step} + 128) >> 8));
  }

  // The lowest band: differences to predictions.
  void code_means() {
    const Band& band = shape_.bands[0];
    const auto n = static_cast<std::size_t>(band.size.x * band.size.y * band.size.z);
    std::vector<std::int32_t> levels(n);
    const std::int64_t row = band.size.x, slice = band.size.x * band.size.y;
    std::int32_t* level = levels.data();
    for (std::int64_t z = 0; z < band.size.z; ++z)
      for (std::int64_t y = 0; y < band.size.y; ++y) {
        std::int32_t* const c = row_of(band, y, z);
        for (std::int64_t x = 0; x < band.size.x; ++x, ++level) {
          std::int64_t sum = 0, count = 0;
          if (x > 0) sum += level[-1], ++count;
          if (y > 0) sum += level[-row], ++count;
          if (z > 0) sum += level[-slice], ++count;
          // Rounded down, also below 0.
          const std::int64_t predicted = count == 0   ? 0
                                         : count == 1 ? sum
                                         : count == 2 ? sum >> 1
                                                      : (sum * 21846) >> 16;
          std::int64_t difference = 0;
          if constexpr (Coder::encoding) {
            const std::int64_t magnitude = (std::abs(std::int64_t{c[x]}) * 256 + band.step / 2) / band.step;
            const std::int64_t limited = std::min<std::int64_t>(magnitude, largest_magnitude);
            difference = (c[x] < 0 ? -limited : limited) - predicted;
          }
          difference = model_.means.code_signed(coder_, difference);
          *level = static_cast<std::int32_t>(
              std::clamp<std::int64_t>(predicted + difference, -largest_magnitude, largest_magnitude));
          c[x] = dequantized(*level, band.step);
        }
      }
  }

  void code_band(std::size_t number) {
    const Band& band = shape_.bands[number];
    Magnitudes& own = bands_[number];
    const auto blocks = static_cast<std::size_t>(own.blocks.x * own.blocks.y * own.blocks.z);
    const std::span<std::uint8_t> active(active_.data() + own.blocks_offset, blocks);
    bool is_zero = false;
    if constexpr (Coder::encoding) is_zero = !find_active(band, own, active);
    std::size_t siblings = 0;
    for (const int sibling : band.siblings)
      siblings += sibling != no_band && !bands_[static_cast<std::size_t>(sibling)].is_zero;
    const bool parent = band.parent != no_band && !bands_[static_cast<std::size_t>(band.parent)].is_zero;
    const auto context = static_cast<std::size_t>(std::min(band.level, 6)) * 8 + siblings * 2 + parent;
    is_zero = code_adaptive(coder_, is_zero, model_.zero_band[context], forget_flags_after);
    own.is_zero = is_zero;
    if (is_zero) {
      if constexpr (Coder::encoding)
        for (std::int64_t z = 0; z < band.size.z; ++z)
          for (std::int64_t y = 0; y < band.size.y; ++y) std::fill_n(row_of(band, y, z), band.size.x, 0);
      return;
    }
    code_blocks(band, own, active);
    const Around around = around_of(band, own);
    for (std::int64_t z = 0; z < band.size.z; ++z) {
      for (std::int64_t y = 0; y < band.size.y; ++y) {
        std::int32_t* const c = row_of(band, y, z);
        const std::size_t first =
            static_cast<std::size_t>(((z / block) * own.blocks.y + y / block) * own.blocks.x);
        for (std::int64_t x = 0; x < band.size.x; x += block) {
          const std::int64_t n = std::min(block, band.size.x - x);
          const std::size_t at = first + static_cast<std::size_t>(x / block);
          if (active[at] != 0)
            sums_[own.blocks_offset + at] += code_group(band, own, around, c + x, {x, y, z}, n);
          else if constexpr (Coder::encoding)
            std::fill_n(c + x, n, 0);
        }
        if (coder_.exhausted()) return;
      }
    }
  }

  // Of an encoder: which blocks have a coefficient that may not be 0. False if none has.
  bool find_active(const Band& band, const Magnitudes& own, std::span<std::uint8_t> active) {
    const auto least =
        static_cast<std::int32_t>(std::min(static_cast<float>(band.step) * (least_active / 256), 2e9f));
    bool any = false;
    for (std::int64_t z = 0; z < band.size.z; ++z)
      for (std::int64_t y = 0; y < band.size.y; ++y) {
        const std::int32_t* const c = row_of(band, y, z);
        std::uint8_t* const flags = active.data() + ((z / block) * own.blocks.y + y / block) * own.blocks.x;
        for (std::int64_t x = 0; x < band.size.x; ++x)
          if (c[x] > least || c[x] < -least) {
            flags[x / block] = 1;
            any = true;
          }
      }
    return any;
  }

  void code_blocks(const Band& band, const Magnitudes& own, std::span<std::uint8_t> active) {
    if (active.size() == 1) {
      active[0] = 1;
      return;
    }
    const std::int64_t row = own.blocks.x, slice = own.blocks.x * own.blocks.y;
    std::uint8_t* flag = active.data();
    for (std::int64_t z = 0; z < own.blocks.z; ++z)
      for (std::int64_t y = 0; y < own.blocks.y; ++y)
        for (std::int64_t x = 0; x < own.blocks.x; ++x, ++flag) {
          const int neighbours = (x > 0 && flag[-1]) + (y > 0 && flag[-row]) + (z > 0 && flag[-slice]);
          const std::size_t context =
              ((static_cast<std::size_t>(neighbours) * 6 + class_of_block(parent_of_block(band, {x, y, z}))) *
                   6 +
               class_of_block(siblings_of_block(band, {x, y, z}))) *
                  2 +
              (band.level == 1);
          *flag = code_adaptive(coder_, *flag != 0, model_.active_block[context], forget_flags_after);
        }
  }

  // The magnitudes of all parents of a block.
  std::uint32_t parent_of_block(const Band& band, Index3 at) const {
    if (band.parent == no_band) return 0;
    const Magnitudes& parent = bands_[static_cast<std::size_t>(band.parent)];
    if (parent.is_zero) return 0;
    const Index3 size = shape_.bands[static_cast<std::size_t>(band.parent)].size;
    Index3 low, end;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = at[axis] * block >> band.parent_shift[axis];
      end[axis] = std::min(low[axis] + (block >> band.parent_shift[axis]), size[axis]);
    }
    std::uint32_t sum = 0;
    for (std::int64_t z = low.z; z < end.z; ++z)
      for (std::int64_t y = low.y; y < end.y; ++y)
        for (std::int64_t x = low.x; x < end.x; ++x) sum += *at_of(parent, {x, y, z});
    return sum;
  }
  std::uint32_t siblings_of_block(const Band& band, Index3 at) const {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < 3 && band.siblings[i] != no_band; ++i) {
      const Magnitudes& sibling = bands_[static_cast<std::size_t>(band.siblings[i])];
      const std::int64_t z = at.z >> band.sibling_shift[i];
      if (sibling.is_zero || at.x >= sibling.blocks.x || at.y >= sibling.blocks.y || z >= sibling.blocks.z)
        continue;
      sum += sums_[sibling.blocks_offset +
                   static_cast<std::size_t>((z * sibling.blocks.y + at.y) * sibling.blocks.x + at.x)];
    }
    return sum;
  }

  const std::uint8_t* at_of(const Magnitudes& m, Index3 at) const {
    return magnitudes_.data() + m.offset + at.z * m.slice + at.y * m.row + at.x;
  }

  /// What coefficients of a band are expected from.
  struct Around {
    const std::int16_t* weights;
    std::array<std::int64_t, own_features> own;  ///< offsets of neighbours, in the order of their weights
    const Magnitudes* parent = nullptr;
    std::array<const Magnitudes*, 3> siblings{};
    std::size_t level_context;
  };

  Around around_of(const Band& band, const Magnitudes& own) const {
    const std::int64_t r = own.row, s = own.slice;
    Around a;
    a.weights = feature_weights[static_cast<std::size_t>(band.orientation + 8 * (band.level > 1))].data();
    a.own = {-1,    -r, -s,     -1 - r, 1 - r,      -1 - s,    1 - s,      -r - s,
             r - s, -2, -2 * r, -2 * s, -1 - r - s, 1 - r - s, -1 + r - s, 1 + r - s};
    if (band.parent != no_band && !bands_[static_cast<std::size_t>(band.parent)].is_zero)
      a.parent = &bands_[static_cast<std::size_t>(band.parent)];
    for (std::size_t i = 0; i < 3 && band.siblings[i] != no_band; ++i) {
      const auto number = static_cast<std::size_t>(band.siblings[i]);
      if (!bands_[number].is_zero) a.siblings[i] = &bands_[number];
    }
    a.level_context = static_cast<std::size_t>(std::min(band.level - 1, 3)) * 3;
    return a;
  }

  // All but what the coefficients of this group say of each other.
  void look_around(const Band& band, const Magnitudes& own, const Around& around, Index3 at,
                   Group& group) const {
    const std::uint8_t* const here = at_of(own, at);
    const std::int16_t* const w = around.weights;
    std::array<std::int32_t, block> expected{}, near{}, parent{};
    const auto add = [&](std::size_t i, std::int32_t of_sum) {
      const std::uint8_t* const m = here + around.own[i];
      for (std::size_t k = 0; k < block; ++k) {
        expected[k] += w[i] * m[k];
        near[k] += of_sum * m[k];
      }
    };
    for (const std::size_t i : {1, 2}) add(i, 2);
    for (const std::size_t i : {4, 6, 7, 8, 10, 11, 12, 13, 14, 15, 3, 5}) add(i, 1);
    if (around.parent != nullptr) {
      const Magnitudes& p = *around.parent;
      const std::uint8_t* const first =
          at_of(p, {at.x >> band.parent_shift.x, at.y >> band.parent_shift.y, at.z >> band.parent_shift.z});
      for (std::size_t k = 0; k < block; ++k) {
        const std::uint8_t* const m = first + (k >> band.parent_shift.x);
        const std::int32_t along_x = m[-1] + m[1], along_y = m[-p.row] + m[p.row],
                           along_z = m[-p.slice] + m[p.slice];
        expected[k] += w[16] * m[0] + w[17] * along_x + w[18] * along_y + w[19] * along_z;
        parent[k] = 2 * m[0] + along_x + along_y + along_z;
      }
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (around.siblings[i] == nullptr) continue;
      const Magnitudes& s = *around.siblings[i];
      const std::int64_t z = at.z >> band.sibling_shift[i];
      const std::uint8_t* const m = at_of(s, {at.x, at.y, z});
      for (std::size_t k = 0; k < block; ++k)
        expected[k] += w[20 + i] * m[k] + w[23 + i] * (m[static_cast<std::ptrdiff_t>(k) - 1] + m[k + 1] +
                                                       m[static_cast<std::ptrdiff_t>(k) - s.row] +
                                                       m[static_cast<std::ptrdiff_t>(k) + s.row] +
                                                       m[static_cast<std::ptrdiff_t>(k) - s.slice] +
                                                       m[static_cast<std::ptrdiff_t>(k) + s.slice]);
    }
    group = {expected, near, parent};
  }

  /// Returns the sum of the magnitudes.
  std::uint32_t code_group(const Band& band, const Magnitudes& own, const Around& around, std::int32_t* c,
                           Index3 at, std::int64_t n) {
    Group group;
    look_around(band, own, around, at, group);
    std::uint8_t* m = magnitudes_.data() + own.offset + at.z * own.slice + at.y * own.row + at.x;
    std::uint32_t sum = 0;
    const float per_step = 256.0f / static_cast<float>(band.step);
    for (std::size_t k = 0; k < static_cast<std::size_t>(n); ++k, ++m, ++c) {
      const std::int32_t left = m[-1], left_2 = m[-2];
      const std::int32_t expected = std::clamp(
          group.expected[k] + around.weights[0] * left + around.weights[9] * left_2, 0, (1 << 22) - 1);
      const std::size_t expected_class = std::min(log_scale<1>(static_cast<std::uint32_t>(expected)), 31u);
      const std::int32_t near = std::min(group.around[k] + 2 * left + left_2, 63),
                         parent = std::min(group.parent[k], 63);
      Context context;
      context.near = static_cast<std::size_t>(near_class[static_cast<std::size_t>(near)] * 12 +
                                              near_class[static_cast<std::size_t>(parent)]);
      context.expected = expected_class * orientations + static_cast<std::size_t>(band.orientation);
      context.mixer = around.level_context + (expected_class == 0 ? 0 : expected_class < 16 ? 1 : 2);
      context.refined = expected_class / 2;
      std::int32_t magnitude = 0;
      bool negative = false;
      if constexpr (Coder::encoding) {
        negative = *c < 0;
        magnitude = encode_magnitude(context, static_cast<float>(std::abs(std::int64_t{*c})) * per_step);
      } else {
        magnitude = decode_magnitude(context);
      }
      if (magnitude > 0) {
        negative = code_sign(band, around, m, negative);
        sum += static_cast<std::uint32_t>(*m = static_cast<std::uint8_t>(std::min(magnitude, 255)));
      }
      *c = dequantized(negative ? -std::int64_t{magnitude} : magnitude, band.step);
    }
    return sum;
  }

  struct Context {
    std::size_t near, expected, mixer, refined;
  };
  /// One event, before it is known.
  struct Prediction {
    std::array<AdaptiveBit*, 2> bits;
    CoefficientModel::Weights* weights;
    std::uint16_t* between;  ///< null: not refined
    std::uint32_t part;
    std::array<std::int32_t, 2> inputs;
    std::uint32_t mixed, probability;
  };

  static Prediction predict(AdaptiveBit& first, AdaptiveBit& second, CoefficientModel::Weights& weights,
                            CoefficientModel::Refinement* refinement) {
    Prediction p;
    p.bits = {&first, &second};
    p.inputs = {first.stretched(), second.stretched()};
    p.weights = &weights;
    const std::int32_t sum = p.inputs[0] * (weights[0] >> 4) + p.inputs[1] * (weights[1] >> 4);
    const auto mixed = static_cast<std::uint32_t>(std::clamp(sum >> 12, -2047, 2047) + 2048);
    p.mixed = squash_table[mixed];
    p.between = nullptr;
    std::uint32_t refined = p.mixed;
    if (refinement != nullptr) {
      p.between = refinement->data() + (mixed >> 7);
      p.part = mixed & 127;
      refined = (p.between[0] * (128 - p.part) + p.between[1] * p.part) >> 7;
    }
    p.probability =
        std::clamp<std::uint32_t>((p.mixed + refined) >> 1, least_probability, 65536 - least_probability);
    return p;
  }
  Prediction predict(std::size_t event, const Context& context) {
    return predict(model_.near[event][context.near], model_.expected[event][context.expected],
                   model_.weights[event][context.mixer], &model_.refined[event][context.refined]);
  }

  static void learn(const Prediction& p, bool bit) {
    const std::int32_t target = bit ? 65535 : 0, error = target - static_cast<std::int32_t>(p.mixed);
    if (p.between != nullptr) {
      std::uint16_t& nearer = p.between[p.part > 64];
      nearer = static_cast<std::uint16_t>(nearer + ((target - nearer) >> 6));
    }
    for (std::size_t i = 0; i < 2; ++i) {
      std::int32_t& weight = (*p.weights)[i];
      weight = std::clamp(weight + ((p.inputs[i] * error + (1 << (mix_shift - 1))) >> mix_shift),
                          -weight_limit, weight_limit);
      p.bits[i]->learn(bit, forget_after);
    }
  }

  bool code_sign(const Band& band, const Around& around, const std::uint8_t* m, bool negative) {
    std::uint8_t* const s = signs_.data() + (m - magnitudes_.data());
    const auto of = [&](std::size_t neighbour) { return std::size_t{s[around.own[neighbour]]}; };
    const auto orientation = static_cast<std::size_t>(band.orientation);
    const std::size_t near = (orientation * 27 + of(0) * 9 + of(1) * 3 + of(2)) * 2 + (band.level == 1),
                      far = orientation * 81 + of(9) * 27 + of(10) * 9 + of(11) * 3 + of(8);
    const Prediction p =
        predict(model_.sign[near], model_.far_sign[far], model_.sign_weights[orientation], nullptr);
    negative = coder_.code(negative, p.probability);
    learn(p, negative);
    *s = negative ? 0 : 2;
    return negative;
  }

  static float cost(const Prediction& p, bool bit) {
    return static_cast<float>(cost_table[(bit ? p.probability : 65536 - p.probability) >> 4]) *
           (lambda / 256);
  }

  /// Chooses a magnitude that is small for its bits. `a`: the magnitude in steps.
  std::int32_t encode_magnitude(const Context& context, float a) {
    const auto nearest = static_cast<std::int32_t>(std::min(a + 0.5f, static_cast<float>(largest_magnitude)));
    std::array<Prediction, magnitude_events> events;
    events[0] = predict(0, context);
    std::int32_t chosen = nearest;
    if (nearest > 0) {
      const auto last = static_cast<std::size_t>(std::min<std::int32_t>(nearest, magnitude_events - 1));
      for (std::size_t e = 1; e <= last; ++e) events[e] = predict(e, context);
      if (nearest < static_cast<std::int32_t>(magnitude_events)) {
        // The costs of this magnitude and of the one below it, without the events that they share; at last 0.
        const auto n = static_cast<std::size_t>(nearest);
        const float off = a - static_cast<float>(nearest);
        float best =
            off * off + cost(events[n], false) + cost(events[n - 1], true) + (nearest == 1 ? lambda : 0);
        const float below = (off + 1) * (off + 1) + cost(events[n - 1], false);
        if (below < best) {
          best = below;
          chosen = nearest - 1;
        }
        if (nearest == 2) {
          // Compared with 0, 1 and 2 have a sign and exceed 0.
          best += cost(events[0], true) + lambda;
          if (a * a + cost(events[0], false) < best) chosen = 0;
        }
      }
    }
    const std::int32_t unary = std::min<std::int32_t>(chosen, magnitude_events);
    for (std::int32_t e = 0; e <= unary && e < static_cast<std::int32_t>(magnitude_events); ++e) {
      const Prediction& event = events[static_cast<std::size_t>(e)];
      coder_.code(chosen > e, event.probability);
      learn(event, chosen > e);
    }
    if (unary == static_cast<std::int32_t>(magnitude_events))
      model_.far.code(coder_, static_cast<std::uint64_t>(chosen - unary));
    return chosen;
  }

  std::int32_t decode_magnitude(const Context& context) {
    for (std::size_t e = 0; e < magnitude_events; ++e) {
      const Prediction event = predict(e, context);
      const bool more = coder_.code(false, event.probability);
      learn(event, more);
      if (!more) return static_cast<std::int32_t>(e);
    }
    return static_cast<std::int32_t>(
        std::min<std::uint64_t>(magnitude_events + model_.far.code(coder_, 0), largest_magnitude));
  }

  Coder& coder_;
  CoefficientModel& model_;
  const TransformShape& shape_;
  std::int32_t* coefficients_;
  std::vector<Magnitudes> bands_;
  std::vector<std::uint8_t> magnitudes_, active_;
  std::vector<std::uint8_t> signs_;  ///< 0: negative, 1: the coefficient is 0, 2: positive
  std::vector<std::uint32_t> sums_;  ///< of the magnitudes of blocks
};

}  // namespace

std::uint64_t working_bytes_of_coefficients(Index3 size) {
  std::uint64_t most = 0;
  for (int split = 0; split < split_count; ++split) {
    const TransformShape shape = transform_shape(size, static_cast<Split>(split), 1, 0);
    std::uint64_t bytes = shape.bands.size() * (sizeof(Band) + sizeof(Magnitudes));
    for (const Band& band : shape.bands) {
      // Magnitudes and signs.
      bytes +=
          2 * static_cast<std::uint64_t>((band.size.x + Magnitudes::before + Magnitudes::after_x) *
                                         Magnitudes::padded(band.size.y) * Magnitudes::padded(band.size.z));
      std::uint64_t blocks = sizeof(std::uint32_t) + sizeof(std::uint8_t);
      for (int axis = 0; axis < 3; ++axis)
        blocks *= static_cast<std::uint64_t>((band.size[axis] + block - 1) / block);
      bytes += blocks;
    }
    const Index3 means = shape.bands[0].size;
    bytes += static_cast<std::uint64_t>(means.x * means.y * means.z) * sizeof(std::int32_t);
    most = std::max(most, bytes);
  }
  return most;
}

template <class Coder>
bool code_coefficients(Coder& coder, CoefficientModel& model, const TransformShape& shape,
                       std::span<std::int32_t> coefficients) {
  return CoefficientPass<Coder>(coder, model, shape, coefficients).run();
}

template bool code_coefficients(LimitedEncoder&, CoefficientModel&, const TransformShape&,
                                std::span<std::int32_t>);
template bool code_coefficients(RansDecoder&, CoefficientModel&, const TransformShape&,
                                std::span<std::int32_t>);

}  // namespace tagrid
