#include "stages/criterion/mesh_criterion.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "stages/criterion/base_edges.h"
#include "stages/criterion/diamond_samples.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

template <class T>
std::int64_t largest_error(const Samples<T>& samples, const Domain& domain, Index3 p, const PointClass& c,
                           std::int64_t enough) {
  IntegerErrors<T> errors(samples.data + samples.box.offset(p), c.unit, enough);
  DiamondSamples<T, IntegerErrors<T>>(samples, domain, p, c, errors).show();
  return errors.worst();
}

// Works bottom-up over the levels. Every point gets a bound on the error in its diamond, in half sample
// units: its midpoint error plus the largest bound of its children. Samples are read one by one only if this
// bound is above what is allowed.
template <class T>
class MeshMarker {
 public:
  MeshMarker(const Samples<T>& samples, const Domain& domain, const MeshBounds& bounds, LatticeBits& marks)
      : samples_(samples),
        domain_(domain),
        volume_(domain.volume()),
        mesh_bounds_(bounds),
        marks_(marks),
        box_(marks.box()),
        bounds_(static_cast<std::size_t>(box_.count()), 0),
        strides_(box_.strides()),
        sample_strides_(samples.box.strides()) {}

  void run() {
    for (std::int64_t unit = 1; unit < domain_.cube_size; unit *= 2)
      for (int odd_count = 1; odd_count <= 3; ++odd_count)
        for (unsigned axes = 1; axes < 8; ++axes)
          if (std::popcount(axes) == odd_count) pass(unit, axes);
  }

 private:
  using Bound = std::int64_t;
  // Larger than any bound that samples can give.
  static constexpr Bound unknown = Bound{1} << 60, marked = Bound{1} << 61;

  void pass(std::int64_t unit, unsigned axes) {
    const std::int64_t period = 2 * unit;
    list_children(unit, axes);
    const Index3 first = {first_multiple(box_.low.x, unit, axes & 1),
                          first_multiple(box_.low.y, unit, axes & 2),
                          first_multiple(box_.low.z, unit, axes & 4)};
    for_each_point_of({first, box_.high}, period, [&](Index3 p) { decide(p, unit); });
  }

  // Offsets of the children in the array of bounds, the same for all points of a pass.
  void list_children(std::int64_t unit, unsigned axes) {
    const Index3 p{axes & 1 ? unit : 0, axes & 2 ? unit : 0, axes & 4 ? unit : 0};
    children_ = children(p, classify(p, domain_.cube_size));
    for (int i = 0; i < children_.size; ++i) {
      child_steps_[i] = children_[i] - p;
      child_offsets_[i] = dot(child_steps_[i], strides_);
    }
  }

  Bound largest_child(Index3 p, std::int64_t at, std::int64_t unit) const {
    Bound largest = 0;
    const bool inside = box_.contains(Box{p, p}.grown(unit));
    for (int i = 0; i < children_.size; ++i) {
      const Index3 child = p + child_steps_[i];
      if (inside || box_.contains(child))
        largest = std::max(largest, bounds_[static_cast<std::size_t>(at + child_offsets_[i])]);
      else if (domain_.padded().contains(child))
        largest = std::max(largest, unknown);
    }
    return largest;
  }

  // Twice the difference between the value at p and the mean of the ends of its base edge.
  Bound midpoint_error(Index3 p, const BaseEdge& edge) const {
    const T* here = samples_.data + samples_.box.offset(p);
    const std::int64_t to_right = dot(edge.right - p, sample_strides_);
    return std::abs(2 * Bound{*here} - Bound{here[to_right]} - Bound{here[-to_right]});
  }

  // True if the border of the volume may cut a tetrahedron of the diamond.
  bool is_cut(Index3 p, std::int64_t unit) const {
    const Box padded = domain_.padded();
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t first = volume_.low[axis], last = volume_.high[axis],
                         low = std::max(p[axis] - unit, padded.low[axis]),
                         high = std::min(p[axis] + unit, padded.high[axis]);
      if ((low < first && first < high) || (low < last && last < high)) return true;
    }
    return false;
  }

  void decide(Index3 p, std::int64_t unit) {
    const std::int64_t at = box_.offset(p);
    Bound& bound = bounds_[static_cast<std::size_t>(at)];
    if (marks_.test(p)) {
      bound = marked;
      return;
    }
    if (intersection(Box{p, p}.grown(unit), volume_).empty()) return;  // no sample can violate the bound
    const bool at_border = is_cut(p, unit);
    const double allowed = at_border ? mesh_bounds_.border : mesh_bounds_.inner;
    const Bound below = largest_child(p, at, unit);
    if (below < marked && allowed >= 0) {
      const PointClass c = classify(p, domain_.cube_size);
      if constexpr (std::is_floating_point_v<T>) {
        if (!violates(p, c, unit, allowed)) return;
      } else {
        bound = below + midpoint_error(p, base_edge(p, c, domain_.cube_size));
        // No integer sample is further than this from any other sample.
        const auto twice = static_cast<std::int64_t>(2 * std::min(allowed, 0x1p32));
        if (bound <= twice) return;
        const std::int64_t enough = unit * twice;
        const std::int64_t error = largest_error(samples_, domain_, p, c, enough);
        if (error <= enough) {
          bound = std::min(bound, (error + unit - 1) / unit);
          return;
        }
      }
    }
    marks_.set(p);
    bound = marked;
  }

  // Bounds that are themselves rounded would save little here, so the samples are always read.
  bool violates(Index3 p, const PointClass& c, std::int64_t unit, double allowed) {
    const Diamond d = diamond(p, c, domain_.cube_size);
    const auto offset_of = [&](Index3 q) { return dot(q - p, sample_strides_); };
    vertices_.assign({offset_of(d.edge.left), offset_of(d.edge.right)});
    for (const Index3 q : d.ring) vertices_.push_back(offset_of(q));
    FloatErrors<T> errors(samples_.data + samples_.box.offset(p), unit, allowed, mesh_bounds_.value_error,
                          vertices_);
    DiamondSamples<T, FloatErrors<T>>(samples_, domain_, p, c, errors).show();
    return errors.violated();
  }

  const Samples<T>& samples_;
  Domain domain_;
  Box volume_;
  MeshBounds mesh_bounds_;
  std::vector<std::int64_t> vertices_;
  LatticeBits& marks_;
  Box box_;
  std::vector<Bound> bounds_;
  Index3 strides_, sample_strides_;
  PointList children_;
  Index3 child_steps_[8];
  std::int64_t child_offsets_[8];
};

}  // namespace

// The bounds that remain for the interpolation if values have errors, and if a cut rounds values once more.
MeshBounds mesh_bounds(const CodingParameters& p) {
  // If originals are linear in the leaf and decoded values are within P of them, so are rounded values: P is
  // an integer.
  const auto at_border = [&](double left) {
    return left <= 0 || is_float_type(p.type) ? left : std::max(left - 0.5, 0.0);
  };
  if (p.mode == FileMode::grid) {
    const double of_voxels = p.max_error < 0 ? INFINITY : p.max_error - p.point_error;
    if (p.mesh_error < 0) return {of_voxels, of_voxels, p.point_error};
    const double of_mesh = p.mesh_error - p.point_error;
    return {std::min(of_mesh, of_voxels), std::min(at_border(of_mesh), of_voxels), p.point_error};
  }
  // A vertex outside the volume has the value of a voxel that need not be active.
  const double of_active = p.surface_error < 0 ? p.max_error : p.surface_error;
  return {p.mesh_error - of_active, at_border(p.mesh_error - p.max_error), p.max_error};
}

template <class T>
void mark_mesh_error(const Samples<T>& samples, const Domain& domain, const MeshBounds& bounds,
                     LatticeBits& marks) {
  assert(samples.box.contains(marks.box().grown(mesh_criterion_halo(domain.cube_size))));
  MeshMarker<T>(samples, domain, bounds, marks).run();
}

template <class T>
std::int64_t diamond_error(const Samples<T>& samples, const Domain& domain, Index3 p, std::int64_t enough) {
  return largest_error(samples, domain, p, classify(p, domain.cube_size), enough);
}

#define TAGRID_INSTANTIATE(T) \
  template void mark_mesh_error(const Samples<T>&, const Domain&, const MeshBounds&, LatticeBits&);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

#define TAGRID_INSTANTIATE(T) \
  template std::int64_t diamond_error(const Samples<T>&, const Domain&, Index3, std::int64_t);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
TAGRID_INSTANTIATE(std::uint32_t)
TAGRID_INSTANTIATE(std::int32_t)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
