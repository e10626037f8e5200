#include "stages/criterion/subdivide.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>
#include <vector>

namespace tagrid {
namespace {

using Word = std::uint64_t;

// One bit for each x of a row of `words` words, or of any number of words if `words` is 0: the points that a
// pass reads or sets. Rows are short, so loops whose length the compiler knows take half the time.
template <std::size_t words>
class RowBits {
 public:
  explicit RowBits(std::size_t) {}
  Word& operator[](std::size_t i) { return words_[i]; }
  const Word& operator[](std::size_t i) const { return words_[i]; }
  static constexpr std::size_t size() { return words; }

 private:
  std::array<Word, words> words_{};
};

template <>
class RowBits<0> {
 public:
  explicit RowBits(std::size_t words) : words_(words) {}
  Word& operator[](std::size_t i) { return words_[i]; }
  const Word& operator[](std::size_t i) const { return words_[i]; }
  std::size_t size() const { return words_.size(); }

 private:
  std::vector<Word> words_;
};

template <class Row>
void or_into(Word* row, const Row& bits) {
  for (std::size_t i = 0; i < bits.size(); ++i) row[i] |= bits[i];
}

// row |= bits moved by `distance` towards higher x; `valid` masks bits that would leave the row.
template <class Row>
void or_moved_up(Word* row, const Row& bits, std::size_t distance, const Row& valid) {
  const std::size_t whole = distance / 64, part = distance % 64;
  for (std::size_t i = bits.size(); i-- > whole;) {
    Word moved = bits[i - whole] << part;
    if (part != 0 && i > whole) moved |= bits[i - whole - 1] >> (64 - part);
    row[i] |= moved & valid[i];
  }
}

template <class Row>
void or_moved_down(Word* row, const Row& bits, std::size_t distance) {
  const std::size_t whole = distance / 64, part = distance % 64;
  for (std::size_t i = 0; i + whole < bits.size(); ++i) {
    Word moved = bits[i + whole] >> part;
    if (part != 0 && i + whole + 1 < bits.size()) moved |= bits[i + whole + 1] << (64 - part);
    row[i] |= moved;
  }
}

template <std::size_t words>
class Closure {
 public:
  Closure(std::span<LatticeBits> nested, int cube_size)
      : nested_(nested),
        cube_size_(cube_size),
        low_(nested[0].box().low),
        high_(nested[0].box().high),
        odd_(nested[0].words_per_row()),
        even_(odd_),
        one_(odd_),
        three_(odd_),
        valid_(odd_),
        found_(odd_),
        moved_(odd_),
        part_(odd_) {
    for (std::int64_t x = 0; x <= high_.x - low_.x; ++x) set(valid_, x);
  }

  void run() {
    if (any()) add_parents();
    for (LatticeBits& bits : nested_)
      for_each_point_of({low_, high_}, cube_size_, [&](Index3 p) { bits.set(p); });
  }

 private:
  bool any() const {
    const auto all = std::as_const(nested_[0]).words();
    return std::any_of(all.begin(), all.end(), [](Word word) { return word != 0; });
  }

  void add_parents() {
    for (std::int64_t unit = 1; unit < cube_size_; unit *= 2) {
      prepare(unit);
      for_rows([&](auto y, auto z, bool oy, bool oz) { return !(oy && oz) && edge_midpoints(y, z, oy, oz); });
      for_rows([&](auto y, auto z, bool oy, bool oz) { return (oy || oz) && face_centres(y, z, oy, oz); });
      if (2 * unit < cube_size_)
        for_rows([&](auto y, auto z, bool oy, bool oz) { return oy && oz && cube_centres(y, z); });
    }
  }

  using Row = RowBits<words>;

  static void set(Row& bits, std::int64_t x) {
    bits[static_cast<std::size_t>(x / 64)] |= Word{1} << (x % 64);
  }

  // Masks of the x that are odd and even multiples of the unit, and of those that are 1 and 3 modulo 4.
  void prepare(std::int64_t unit) {
    unit_ = unit;
    for (auto* mask : {&odd_, &even_, &one_, &three_})
      for (std::size_t i = 0; i < mask->size(); ++i) (*mask)[i] = 0;
    for (std::int64_t x = 0; x <= high_.x - low_.x; x += unit) {
      const std::int64_t n = x / unit % 4;
      set(n % 2 ? odd_ : even_, x);
      if (n == 1) set(one_, x);
      if (n == 3) set(three_, x);
    }
  }

  // Calls f(y, z, y is odd, z is odd) for the rows, with one set after the other until f finds no point.
  template <class F>
  void for_rows(F f) {
    for (std::int64_t z = low_.z; z <= high_.z; z += unit_)
      for (std::int64_t y = low_.y; y <= high_.y; y += unit_)
        for (LatticeBits& bits : nested_) {
          bits_ = &bits;
          if (!f(y, z, ((y - low_.y) & unit_) != 0, ((z - low_.z) & unit_) != 0)) break;
        }
  }

  bool find(std::int64_t y, std::int64_t z, const Row& mask) {
    const Word* row = bits_->row(y, z);
    Word any = 0;
    for (std::size_t i = 0; i < found_.size(); ++i) any |= found_[i] = row[i] & mask[i];
    return any != 0;
  }

  void to_y_neighbours(std::int64_t y, std::int64_t z) {
    if (y > low_.y) or_into(bits_->row(y - unit_, z), found_);
    if (y < high_.y) or_into(bits_->row(y + unit_, z), found_);
  }
  void to_z_neighbours(std::int64_t y, std::int64_t z) {
    if (z > low_.z) or_into(bits_->row(y, z - unit_), found_);
    if (z < high_.z) or_into(bits_->row(y, z + unit_), found_);
  }
  void to_x_neighbours(std::int64_t y, std::int64_t z) {
    or_moved_up(bits_->row(y, z), found_, static_cast<std::size_t>(unit_), valid_);
    or_moved_down(bits_->row(y, z), found_, static_cast<std::size_t>(unit_));
  }

  // These return true if the row has points of the class.
  bool edge_midpoints(std::int64_t y, std::int64_t z, bool oy, bool oz) {
    if (!find(y, z, oy || oz ? even_ : odd_)) return false;
    if (oy || oz) to_x_neighbours(y, z);
    if (!oy) to_y_neighbours(y, z);
    if (!oz) to_z_neighbours(y, z);
    return true;
  }

  bool face_centres(std::int64_t y, std::int64_t z, bool oy, bool oz) {
    if (!find(y, z, oy && oz ? even_ : odd_)) return false;
    if (oy && oz) to_x_neighbours(y, z);
    if (!oy) to_y_neighbours(y, z);
    if (!oz) to_z_neighbours(y, z);
    return true;
  }

  // A cube centre next to the corner (shared_x, shared_y, shared_z) of its parent cell needs the midpoints of
  // the three edges that leave this corner: on each edge, one coordinate is across the cell instead of
  // shared.
  bool cube_centres(std::int64_t y, std::int64_t z) {
    if (!find(y, z, odd_)) return false;
    const auto shared = [&](std::int64_t c, std::int64_t low) {
      return ((c - low) & (2 * unit_)) ? c + unit_ : c - unit_;
    };
    const std::int64_t shared_y = shared(y, low_.y), shared_z = shared(z, low_.z);
    const std::int64_t across_y = 2 * y - shared_y, across_z = 2 * z - shared_z;
    const auto distance = static_cast<std::size_t>(unit_);

    move_apart(one_, three_, distance);  // to the shared x: down from 1, up from 3 (modulo 4 units)
    or_into(bits_->row(across_y, shared_z), moved_);
    or_into(bits_->row(shared_y, across_z), moved_);
    move_apart(three_, one_, distance);
    or_into(bits_->row(shared_y, shared_z), moved_);
    return true;
  }

  void move_apart(const Row& down, const Row& up, std::size_t distance) {
    for (std::size_t i = 0; i < moved_.size(); ++i) moved_[i] = 0;
    Row& part = part_;
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = found_[i] & up[i];
    or_moved_up(&moved_[0], part, distance, valid_);
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = found_[i] & down[i];
    or_moved_down(&moved_[0], part, distance);
  }

  std::span<LatticeBits> nested_;
  LatticeBits* bits_ = nullptr;  ///< the set that is being processed
  int cube_size_;
  Index3 low_, high_;
  std::int64_t unit_ = 1;
  Row odd_, even_, one_, three_, valid_, found_, moved_, part_;
};

}  // namespace

void close_under_parents(std::span<LatticeBits> nested, int cube_size) {
  if (nested.empty() || nested[0].box().empty()) return;
  switch (nested[0].words_per_row()) {
    case 1:
      return Closure<1>(nested, cube_size).run();
    case 2:
      return Closure<2>(nested, cube_size).run();
    case 3:
      return Closure<3>(nested, cube_size).run();
    default:
      return Closure<0>(nested, cube_size).run();
  }
}

void close_under_parents(LatticeBits& bits, int cube_size) {
  close_under_parents(std::span(&bits, 1), cube_size);
}

Box region_of_marks(const Box& closed_box, const Domain& domain) {
  return intersection(closed_box.grown(domain.cube_size), domain.padded());
}

std::uint64_t working_bytes_of_closure(Index3 size) {
  constexpr std::uint64_t rows = 8;  // see Closure
  return rows * LatticeBits::working_bytes({size.x, 1, 1});
}

std::uint64_t working_bytes_of_subdivision(const Box& closed_box, const Domain& domain) {
  const Index3 region = region_of_marks(closed_box, domain).size();
  return LatticeBits::working_bytes(region) + LatticeBits::working_bytes(closed_box.size()) +
         std::max(working_bytes_of_closure(region), working_bytes_of_copying_bits(region.x));
}

LatticeBits subdivide(LatticeBits marks, const Box& closed_box, const Domain& domain) {
  assert(marks.box() == region_of_marks(closed_box, domain));
  close_under_parents(marks, domain.cube_size);
  LatticeBits active(closed_box);
  copy_bits(marks, active);
  return active;
}

}  // namespace tagrid
