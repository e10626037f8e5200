#include "stages/activity_coding.h"

#include <array>
#include <bit>

#include "grid/lattice.h"
#include "stages/mixer.h"
#include "stages/rans_coder.h"

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

  /// The candidates of this pass, and of those before.
  const LatticeBits& bits() const { return bits_; }
  /// The x of this pass, as a row of bits.
  const std::vector<Word>& mask() const { return mask_; }

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
    for (std::size_t i = 0; i < n; ++i) row[i] |= mask_[i];
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
      : coder_(coder), active_(active), box_(active.box()), candidates_(active, cube_size) {
    const std::int64_t row = static_cast<std::int64_t>(active.words_per_row()) * 64;
    bit_stride_ = {1, row, row * box_.size().y};
  }

  void code_pass(const Pass& pass, const LatticeBits* known) {
    pass_ = pass;
    candidates_.find(pass);
    find_surroundings();
    const std::int64_t u = pass.unit;
    for (std::int64_t z = box_.low.z + (pass.odd[2] ? u : 0); z <= box_.high.z; z += 2 * u)
      for (std::int64_t y = box_.low.y + (pass.odd[1] ? u : 0); y <= box_.high.y; y += 2 * u)
        if (!exhausted()) code_row(y, z, known);
  }

 private:
  void code_row(std::int64_t y, std::int64_t z, const LatticeBits* known) {
    const Word* row = candidates_.bits().row(y, z);
    for (std::size_t i = 0; i < active_.words_per_row(); ++i)
      for (Word rest = row[i] & candidates_.mask()[i]; rest != 0; rest &= rest - 1) {
        const auto x = static_cast<std::int64_t>(64 * i) + std::countr_zero(rest);
        const Index3 p{box_.low.x + x, y, z};
        const bool bit = code_point(p, known != nullptr && known->test(p));
        if (bit) active_.set(p);
      }
  }

  // Broken bytes can end long before the points do.
  bool exhausted() const {
    if constexpr (Coder::encoding)
      return false;
    else
      return coder_.exhausted();
  }

  static constexpr std::size_t per_kind = 1024;  // contexts of one kind in one class and cycle

  // Four views of what is known around a point.
  bool code_point(Index3 p, bool bit) {
    const std::int64_t d = 2 * pass_.unit;
    std::size_t on = 0, off = 0, ahead = 0, directed = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Index3 before = p - d * unit_vector(axis), after = p + d * unit_vector(axis);
      std::size_t state = 0;
      if (before[axis] >= box_.low[axis]) state = active_.test(before) ? 2 : candidates_.bits().test(before);
      on += state == 2;
      off += state == 1;
      const bool candidate_after = after[axis] <= box_.high[axis] && candidates_.bits().test(after);
      ahead += candidate_after;
      directed = directed * 6 + state * 2 + candidate_after;
    }
    const std::size_t around = count_known(p, around_), beside = count_known(p, siblings_);
    const std::size_t neighbours = (on * 4 + off) * 4 + ahead;  // < 64
    const auto cls = static_cast<std::size_t>(pass_.cycle * 3 + pass_.odd_count - 1);
    const std::array<std::size_t, contexts_mixed> contexts = {
        neighbours + 64 * std::min<std::size_t>((around + 1) / 2, 12), directed, around * 32 + beside,
        (beside / 2) * 64 + neighbours};
    std::array<AdaptiveBit*, contexts_mixed> models;
    for (std::size_t i = 0; i < contexts_mixed; ++i)
      models[i] = &models_[(cls * contexts_mixed + i) * per_kind + contexts[i]];
    return code_mixed(coder_, bit, models, mixers_[cls], 255);
  }

  struct Offsets {
    std::array<Index3, 32> steps{};
    std::array<std::int64_t, 32> bits{};
    std::size_t size = 0;
    std::int64_t reach = 0;
  };

  std::size_t count_known(Index3 p, const Offsets& offsets) const {
    std::size_t count = 0;
    if (box_.contains(Box{p, p}.grown(offsets.reach))) {
      const Index3 d = p - box_.low;
      const std::int64_t at = d.x + d.y * bit_stride_[1] + d.z * bit_stride_[2];
      const Word* words = active_.words().data();
      for (std::size_t i = 0; i < offsets.size; ++i) {
        const auto bit = static_cast<std::size_t>(at + offsets.bits[i]);
        count += (words[bit / 64] >> (bit % 64)) & 1;
      }
      return count;
    }
    for (std::size_t i = 0; i < offsets.size; ++i) {
      const Index3 q = p + offsets.steps[i];
      count += box_.contains(q) && active_.test(q);
    }
    return count;
  }

  void add(Offsets& offsets, Index3 d) {
    offsets.steps[offsets.size] = d;
    offsets.bits[offsets.size] = d.x + d.y * bit_stride_[1] + d.z * bit_stride_[2];
    ++offsets.size;
    for (int axis = 0; axis < 3; ++axis) offsets.reach = std::max(offsets.reach, std::abs(d[axis]));
  }

  // Around: points of passes before that are no parents. A cube centre looks at the points of the coarser
  // lattice next to its cell, a face centre at the cube centres beside the two that are its parents, an edge
  // midpoint at the face centres of the four cells around it. Siblings: points of the same class, of other
  // orientation, that share a parent.
  void find_surroundings() {
    around_ = {};
    siblings_ = {};
    const std::int64_t u = pass_.unit;
    if (pass_.odd_count == 3) {
      for (int axis = 0; axis < 3; ++axis)
        for (const std::int64_t far : {-3 * u, 3 * u})
          for (const std::int64_t da : {-u, u})
            for (const std::int64_t db : {-u, u})
              add(around_, far * unit_vector(axis) + da * unit_vector((axis + 1) % 3) +
                               db * unit_vector((axis + 2) % 3));
      for (int axis = 0; axis < 3; ++axis)  // cells before, across an edge
        for (const std::int64_t da : {-2 * u, 2 * u})
          for (const std::int64_t db : {-2 * u, 2 * u})
            add(siblings_, da * unit_vector((axis + 1) % 3) + db * unit_vector((axis + 2) % 3));
    }
    if (pass_.odd_count == 2) {
      const int normal = !pass_.odd[0] ? 0 : !pass_.odd[1] ? 1 : 2;
      for (int axis = 0; axis < 3; ++axis)
        if (axis != normal)
          for (const std::int64_t side : {-u, u})
            for (const std::int64_t step : {-u, u}) {
              add(around_, side * unit_vector(normal) + 2 * step * unit_vector(axis));
              add(siblings_, side * unit_vector(normal) + step * unit_vector(axis));
            }
    }
    if (pass_.odd_count == 1) {
      const int along = pass_.odd[0] ? 0 : pass_.odd[1] ? 1 : 2, a = (along + 1) % 3, b = (along + 2) % 3;
      for (const std::int64_t da : {-u, u})
        for (const std::int64_t db : {-u, u}) {
          for (const std::int64_t dl : {-u, u})
            add(around_, dl * unit_vector(along) + da * unit_vector(a) + db * unit_vector(b));
          add(around_, 2 * da * unit_vector(a) + db * unit_vector(b));
          add(around_, da * unit_vector(a) + 2 * db * unit_vector(b));
          add(siblings_, da * unit_vector(along) + db * unit_vector(a));
          add(siblings_, da * unit_vector(along) + db * unit_vector(b));
        }
    }
  }

  Coder& coder_;
  LatticeBits& active_;
  Box box_;
  std::array<std::int64_t, 3> bit_stride_{};
  Candidates candidates_;
  Pass pass_{};
  Offsets around_, siblings_;
  std::vector<AdaptiveBit> models_{8 * 3 * contexts_mixed * per_kind};
  std::array<Mixer, 8 * 3> mixers_{};
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
  RansEncoder coder(out);
  LatticeBits coded(active.box());
  code_activity(coder, coded, cube_size, max_level, &active);
  coder.finish();
}

Status decode_activity(std::span<const std::uint8_t> bytes, int cube_size, int max_level,
                       LatticeBits& active) {
  RansDecoder coder(bytes);
  code_activity<RansDecoder>(coder, active, cube_size, max_level, nullptr);
  if (!coder.finished()) return Status::broken("the activity has the wrong number of bytes");
  return {};
}

}  // namespace tagrid
