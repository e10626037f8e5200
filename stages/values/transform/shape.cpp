#include "stages/values/transform/shape.h"

#include <algorithm>

namespace tagrid {
namespace {

constexpr std::int64_t least_length = 4;

// What a coefficient of 1 becomes in samples: the norm of its basis function along one axis, in 2^-10. By whether
// the band is high, and by the number of splits. A test computes them.
constexpr std::uint64_t norms[2][most_levels + 1] = {{1024, 1167, 1374, 1596, 1840, 2117, 2434},
                                                     {1024, 909, 1007, 1200, 1403, 1621, 1866}};

// At a face, the errors of coefficients and of their mirror images add up. So in the finest high bands, the first and
// the last coefficients have finer steps.
constexpr int levels_with_fine_ends = 2;
std::uint32_t step_at_end(std::uint32_t step) {
  return static_cast<std::uint32_t>((3 * std::uint64_t{step} + 2) >> 2);
}

// A band along one axis.
struct Part {
  bool high = false;
  int splits = 0;
};

class Maker {
 public:
  Maker(TransformShape& shape, std::uint32_t step, int fraction_bits)
      : shape_(shape), step_(std::uint64_t{step} << (fraction_bits + 32)) {}

  /// Returns the number of the band, or no_band if it is empty.
  int add(const std::array<Part, 3>& parts, int level) {
    Band band;
    std::uint64_t norm = 1;
    band.level = std::max(level, 1);
    for (int axis = 0; axis < 3; ++axis) {
      const auto& [high, splits] = parts[static_cast<std::size_t>(axis)];
      const auto& lengths = shape_.lengths[static_cast<std::size_t>(axis)];
      const auto n = static_cast<std::size_t>(splits);
      band.low[axis] = high ? lengths[n] : 0;
      band.size[axis] = high ? lengths[n - 1] - lengths[n] : lengths[n];
      if (band.size[axis] == 0) return no_band;
      if (high) band.orientation |= 1 << axis;
      norm *= norms[high][n];
    }
    band.is_mean = shape_.bands.empty();
    band.steps[0] = static_cast<std::uint32_t>(std::max<std::uint64_t>((step_ + norm / 2) / norm, 1));
    for (std::size_t ends = 0; ends < band.steps.size(); ++ends) {
      band.steps[ends] = band.steps[0];
      for (std::size_t axis = 0; axis < 3; ++axis)
        if ((ends >> axis & 1) != 0 && parts[axis].high && parts[axis].splits <= levels_with_fine_ends)
          band.steps[ends] = step_at_end(band.steps[ends]);
      band.finer[ends] = static_cast<std::uint32_t>((std::uint64_t{band.steps[0]} << 8) / band.steps[ends]);
    }
    shape_.bands.push_back(band);
    return static_cast<int>(shape_.bands.size()) - 1;
  }

  /// `before`: bands of the same level, in the order of their coding. First those that are high along a common
  /// axis, the last of them first.
  void add_siblings(int to, const std::vector<int>& before) {
    for (const bool common : {true, false})
      for (auto i = before.rbegin(); i != before.rend(); ++i)
        if (((shape_.bands[static_cast<std::size_t>(*i)].orientation & band(to).orientation) != 0) == common)
          add_sibling(to, *i, 0);
  }
  void add_sibling(int to, int sibling, int shift) {
    for (std::size_t i = 0; i < 3; ++i)
      if (band(to).siblings[i] == no_band) {
        band(to).siblings[i] = sibling;
        band(to).sibling_shift[i] = shift;
        return;
      }
  }
  /// `parents`: by orientation, of the next level.
  void set_parent(int of, const std::array<int, 8>& parents, int axes) {
    Band& b = band(of);
    b.parent = parents[static_cast<std::size_t>(b.orientation)];
    if (b.parent == no_band) return;
    for (int axis = 0; axis < axes; ++axis) b.parent_shift[axis] = b.level + 1 <= shape_.levels(axis);
  }
  Band& band(int number) { return shape_.bands[static_cast<std::size_t>(number)]; }

 private:
  TransformShape& shape_;
  std::uint64_t step_;
};

// The part of an axis in a band of a level.
Part part_of(const TransformShape& shape, int axis, int level, bool high) {
  return high ? Part{true, level} : Part{false, std::min(level, shape.levels(axis))};
}

constexpr std::array<int, 8> no_parents = {no_band, no_band, no_band, no_band,
                                           no_band, no_band, no_band, no_band};

void add_dyadic_bands(TransformShape& shape, Maker& maker) {
  const int levels = std::max({shape.levels(0), shape.levels(1), shape.levels(2)});
  const auto parts = [&](int level, int orientation) {
    return std::array<Part, 3>{part_of(shape, 0, level, (orientation & 1) != 0),
                               part_of(shape, 1, level, (orientation & 2) != 0),
                               part_of(shape, 2, level, (orientation & 4) != 0)};
  };
  maker.add(parts(levels, 0), levels);
  auto parents = no_parents;
  for (int level = levels; level >= 1; --level) {
    std::vector<int> here;
    auto of_level = no_parents;
    for (const int orientation : {1, 2, 4, 3, 5, 6, 7}) {
      bool is_split = true;
      for (int axis = 0; axis < 3; ++axis)
        if ((orientation >> axis & 1) != 0 && shape.levels(axis) < level) is_split = false;
      if (!is_split) continue;
      const int band = maker.add(parts(level, orientation), level);
      if (band == no_band) continue;
      maker.set_parent(band, parents, 3);
      maker.add_siblings(band, here);
      here.push_back(band);
      of_level[static_cast<std::size_t>(orientation)] = band;
    }
    parents = of_level;
  }
}

// Of the low band along z, then of the high bands, from the coarsest on.
Part part_along_z(int splits, int number) {
  return number == 0 ? Part{false, splits} : Part{true, splits - number + 1};
}

void add_bands_split_along_z(TransformShape& shape, Maker& maker) {
  const int levels = std::max(shape.levels(0), shape.levels(1)), parts = shape.levels(2) + 1;
  const auto add = [&](int level, int orientation, int part) {
    return maker.add({part_of(shape, 0, level, (orientation & 1) != 0),
                      part_of(shape, 1, level, (orientation & 2) != 0), part_along_z(parts - 1, part)},
                     level);
  };
  for (int part = 0; part < parts; ++part) add(levels, 0, part);
  std::vector<std::array<int, 8>> parents(static_cast<std::size_t>(parts), no_parents);
  for (int level = levels; level >= 1; --level) {
    auto along_z = no_parents;  // the bands of the part before, by their orientation along x and y
    for (int part = 0; part < parts; ++part) {
      auto& of_part = parents[static_cast<std::size_t>(part)];
      std::vector<int> here;
      auto of_level = no_parents, now = no_parents;
      for (const int orientation : {1, 2, 3}) {
        if (((orientation & 1) != 0 && shape.levels(0) < level) ||
            ((orientation & 2) != 0 && shape.levels(1) < level))
          continue;
        const int band = add(level, orientation, part);
        if (band == no_band) continue;
        maker.set_parent(band, of_part, 2);
        if (const int before = along_z[static_cast<std::size_t>(orientation)]; before != no_band)
          maker.add_sibling(band, before, part >= 2);
        maker.add_siblings(band, here);
        here.push_back(band);
        now[static_cast<std::size_t>(orientation)] = band;
        of_level[static_cast<std::size_t>(maker.band(band).orientation)] = band;
      }
      along_z = now;
      of_part = of_level;
    }
  }
}

}  // namespace

TransformShape transform_shape(Index3 size, Split split, std::uint32_t step, int fraction_bits) {
  TransformShape shape{size, split, {}, {}};
  for (int axis = 0; axis < 3; ++axis) {
    const int most = axis < 2 || split == Split::dyadic ? most_levels
                     : split == Split::z1               ? 1
                     : split == Split::z2               ? 2
                                                        : 4;
    auto& lengths = shape.lengths[static_cast<std::size_t>(axis)];
    lengths = {size[axis]};
    while (lengths.back() >= least_length && static_cast<int>(lengths.size()) <= most)
      lengths.push_back((lengths.back() + 1) / 2);
  }
  Maker maker(shape, step, fraction_bits);
  if (split == Split::dyadic)
    add_dyadic_bands(shape, maker);
  else
    add_bands_split_along_z(shape, maker);
  return shape;
}

}  // namespace tagrid
