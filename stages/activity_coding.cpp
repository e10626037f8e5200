#include "stages/activity_coding.h"

#include <array>
#include <bit>

#include "grid/lattice.h"
#include "stages/adaptive_bit.h"
#include "stages/range_coder.h"

namespace tagrid {
namespace {

using Word = std::uint64_t;

// All points of one unit with the same odd axes: what is coded in one pass over the box.
struct Pass {
  std::int64_t unit;
  bool odd[3];
  int odd_count;
  int cycle;
};

// The points of a pass that can be active: their parents inside the box are.
class Candidates {
 public:
  Candidates(const LatticeBits& active, int cube_size)
      : active_(active),
        low_(active.box().low),
        high_(active.box().high),
        cube_size_(cube_size),
        bits_(active.box()) {}

  const LatticeBits& bits() const { return bits_; }

  void find(const Pass& pass) {
    pass_ = pass;
    const std::int64_t u = pass.unit;
    set_mask();
    for (std::int64_t z = low_.z + (pass.odd[2] ? u : 0); z <= high_.z; z += 2 * u)
      for (std::int64_t y = low_.y + (pass.odd[1] ? u : 0); y <= high_.y; y += 2 * u) find_row(y, z);
  }

 private:
  // The x of the pass.
  void set_mask() {
    mask_.assign(active_.words_per_row(), 0);
    for (std::int64_t x = pass_.odd[0] ? pass_.unit : 0; x <= high_.x - low_.x; x += 2 * pass_.unit)
      mask_[static_cast<std::size_t>(x / 64)] |= Word{1} << (x % 64);
  }

  void find_row(std::int64_t y, std::int64_t z) {
    Word* row = bits_.row(y, z);
    const std::size_t n = mask_.size();
    const std::int64_t u = pass_.unit;
    for (std::size_t i = 0; i < n; ++i) row[i] = (row[i] & ~mask_[i]) | mask_[i];
    if (pass_.odd_count == 3) {
      if (2 * u < cube_size_) keep_below_edge_midpoints(row, y, z);
      return;
    }
    if (!pass_.odd[0]) keep_where_x_neighbours(row, y, z);
    if (!pass_.odd[1]) {
      if (y > low_.y) keep_where(row, active_.row(y - u, z));
      if (y < high_.y) keep_where(row, active_.row(y + u, z));
    }
    if (!pass_.odd[2]) {
      if (z > low_.z) keep_where(row, active_.row(y, z - u));
      if (z < high_.z) keep_where(row, active_.row(y, z + u));
    }
  }

  // Clears the points of the pass in `row` that are not in `other`; points of other passes stay.
  void keep_where(Word* row, const Word* other) const {
    for (std::size_t i = 0; i < mask_.size(); ++i) row[i] &= other[i] | ~mask_[i];
  }

  void keep_where_x_neighbours(Word* row, std::int64_t y, std::int64_t z) {
    const Word* other = active_.row(y, z);
    const std::size_t n = mask_.size(), whole = static_cast<std::size_t>(pass_.unit) / 64,
                      part = static_cast<std::size_t>(pass_.unit) % 64;
    const std::int64_t last = high_.x - low_.x;
    for (std::size_t i = 0; i < n; ++i) {
      Word below = i >= whole ? other[i - whole] << part : 0;
      if (part != 0 && i > whole) below |= other[i - whole - 1] >> (64 - part);
      Word above = i + whole < n ? other[i + whole] >> part : 0;
      if (part != 0 && i + whole + 1 < n) above |= other[i + whole + 1] << (64 - part);
      // The ends of the row have one neighbour.
      if (i == 0) below |= 1;
      if (i == static_cast<std::size_t>(last / 64)) above |= Word{1} << (last % 64);
      row[i] &= (below & above) | ~mask_[i];
    }
  }

  // The parents of a cube centre: see parents() in grid/lattice.h.
  void keep_below_edge_midpoints(Word* row, std::int64_t y, std::int64_t z) const {
    const std::int64_t u = pass_.unit;
    const auto shared_corner = [&](std::int64_t c, std::int64_t low) {
      return ((c - low) & (2 * u)) ? c + u : c - u;
    };
    const std::int64_t sy = shared_corner(y, low_.y), sz = shared_corner(z, low_.z);
    for (std::int64_t x = low_.x + u; x <= high_.x; x += 2 * u) {
      const std::int64_t sx = shared_corner(x, low_.x);
      const bool all = active_.test({2 * x - sx, sy, sz}) && active_.test({sx, 2 * y - sy, sz}) &&
                       active_.test({sx, sy, 2 * z - sz});
      if (!all) row[(x - low_.x) / 64] &= ~(Word{1} << ((x - low_.x) % 64));
    }
  }

  const LatticeBits& active_;
  Index3 low_, high_;
  int cube_size_;
  LatticeBits bits_;
  Pass pass_{};
  std::vector<Word> mask_;
};

// Codes the activity bits of a box in both directions: `coder` decides which.
template <class Coder>
class ActivityModel {
 public:
  ActivityModel(Coder& coder, LatticeBits& active, int cube_size)
      : coder_(coder), active_(active), box_(active.box()), candidates_(active, cube_size) {}

  void code_pass(const Pass& pass, const LatticeBits* known) {
    pass_ = pass;
    candidates_.find(pass);
    find_surroundings();
    const std::int64_t u = pass.unit;
    for (std::int64_t z = box_.low.z + (pass.odd[2] ? u : 0); z <= box_.high.z; z += 2 * u)
      for (std::int64_t y = box_.low.y + (pass.odd[1] ? u : 0); y <= box_.high.y; y += 2 * u)
        code_row(y, z, known);
  }

 private:
  static constexpr std::size_t surroundings_steps = 5, neighbour_contexts = 40;

  void code_row(std::int64_t y, std::int64_t z, const LatticeBits* known) {
    const Word* row = candidates_.bits().row(y, z);
    const std::int64_t first = pass_.odd[0] ? pass_.unit : 0, period = 2 * pass_.unit;
    for (std::size_t i = 0; i < active_.words_per_row(); ++i)
      for (Word rest = row[i]; rest != 0; rest &= rest - 1) {
        const auto x = static_cast<std::int64_t>(64 * i) + std::countr_zero(rest);
        if ((x - first) % period != 0) continue;  // of an earlier pass
        const Index3 p{box_.low.x + x, y, z};
        AdaptiveBit& model = models_[context(p)];
        if (model.code(coder_, known != nullptr && known->test(p)))
          if (known == nullptr) active_.set(p);
        if (known != nullptr && known->test(p)) active_.set(p);
      }
  }

  // What is known around a point: the six neighbours of its class (three of them coded already), and points
  // of the pass before, which are all known.
  std::size_t context(Index3 p) const {
    const std::int64_t d = 2 * pass_.unit;
    int on = 0, off = 0, ahead = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Index3 before = p - d * unit_vector(axis), after = p + d * unit_vector(axis);
      if (before[axis] >= box_.low[axis]) {
        if (active_.test(before))
          ++on;
        else
          off += candidates_.bits().test(before);
      }
      if (after[axis] <= box_.high[axis]) ahead += candidates_.bits().test(after);
    }
    std::size_t around = 0;
    if (surroundings_count_ > 0) {
      int count = 0, inside = 0;
      for (int i = 0; i < surroundings_count_; ++i) {
        const Index3 q = p + surroundings_[static_cast<std::size_t>(i)];
        if (!box_.contains(q)) continue;
        ++inside;
        count += active_.test(q);
      }
      around = count == 0 ? 0 : static_cast<std::size_t>(1 + (count * 4 - 1) / std::max(inside, 1));
    }
    // (on, off) with on + off <= 3: 10 pairs.
    static constexpr std::array<std::array<std::size_t, 4>, 4> pair = {
        {{0, 1, 2, 3}, {4, 5, 6, 0}, {7, 8, 0, 0}, {9, 0, 0, 0}}};
    const std::size_t neighbours = pair[static_cast<std::size_t>(on)][static_cast<std::size_t>(off)] * 4 +
                                   static_cast<std::size_t>(ahead);
    const auto cls = static_cast<std::size_t>(pass_.odd_count - 1),
               cycle = static_cast<std::size_t>(pass_.cycle);
    return ((cycle * 3 + cls) * surroundings_steps + around) * neighbour_contexts + neighbours;
  }

  // Points of the pass before, around a point of this one, that are no parents of it. Face centres look at
  // the cube centres beside the two that are their parents, edge midpoints at the face centres of the four
  // cells around them.
  void find_surroundings() {
    surroundings_count_ = 0;
    const std::int64_t u = pass_.unit;
    const auto add = [&](Index3 d) { surroundings_[static_cast<std::size_t>(surroundings_count_++)] = d; };
    if (pass_.odd_count == 2) {
      const int normal = !pass_.odd[0] ? 0 : !pass_.odd[1] ? 1 : 2;
      for (int axis = 0; axis < 3; ++axis)
        if (axis != normal)
          for (const std::int64_t side : {-u, u})
            for (const std::int64_t step : {-2 * u, 2 * u})
              add(side * unit_vector(normal) + step * unit_vector(axis));
    }
    if (pass_.odd_count == 1) {
      const int along = pass_.odd[0] ? 0 : pass_.odd[1] ? 1 : 2, a = (along + 1) % 3, b = (along + 2) % 3;
      for (const std::int64_t da : {-u, u})
        for (const std::int64_t db : {-u, u}) {
          for (const std::int64_t dl : {-u, u})
            add(dl * unit_vector(along) + da * unit_vector(a) + db * unit_vector(b));
          add(2 * da * unit_vector(a) + db * unit_vector(b));
          add(da * unit_vector(a) + 2 * db * unit_vector(b));
        }
    }
  }

  Coder& coder_;
  LatticeBits& active_;
  Box box_;
  Candidates candidates_;
  Pass pass_{};
  std::array<Index3, 16> surroundings_{};
  int surroundings_count_ = 0;
  std::vector<AdaptiveBit> models_{8 * 3 * surroundings_steps * neighbour_contexts};
};

void set_root_corners(LatticeBits& active, int cube_size) {
  const Box& box = active.box();
  for (std::int64_t z = box.low.z; z <= box.high.z; z += cube_size)
    for (std::int64_t y = box.low.y; y <= box.high.y; y += cube_size)
      for (std::int64_t x = box.low.x; x <= box.high.x; x += cube_size) active.set({x, y, z});
}

// `known` is null when decoding.
template <class Coder>
void code_activity(Coder& coder, LatticeBits& active, int cube_size, int max_level,
                   const LatticeBits* known) {
  set_root_corners(active, cube_size);
  ActivityModel<Coder> model(coder, active, cube_size);
  int cycle = 0;
  for (std::int64_t unit = cube_size / 2; unit >= 1; unit /= 2, ++cycle)
    for (int odd_count = 3; odd_count >= 1; --odd_count) {
      if (3 * cycle + 4 - odd_count > max_level) return;
      for (unsigned axes = 1; axes < 8; ++axes)
        if (std::popcount(axes) == odd_count)
          model.code_pass({unit, {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0}, odd_count, cycle},
                          known);
    }
}

}  // namespace

void encode_activity(const LatticeBits& active, int cube_size, int max_level,
                     std::vector<std::uint8_t>& out) {
  RangeEncoder coder(out);
  LatticeBits coded(active.box());
  code_activity(coder, coded, cube_size, max_level, &active);
  coder.finish();
}

Status decode_activity(std::span<const std::uint8_t> bytes, int cube_size, int max_level,
                       LatticeBits& active) {
  RangeDecoder coder(bytes);
  code_activity<RangeDecoder>(coder, active, cube_size, max_level, nullptr);
  if (!coder.finished()) return Status::broken("the activity has the wrong number of bytes");
  return {};
}

}  // namespace tagrid
