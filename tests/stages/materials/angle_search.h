// The worst dihedral angles that a tetrahedron of a mesh with materials can have, found by a search.
//
// The parameters of a tetrahedron are the materials of its corners (or that a corner is snapped), the way of each
// snapped corner along an edge, the cuts of its edges, and the order of its corners. All corners of this box are
// tried, and a local search with a fixed seed begins at the worst of them. A search is no proof: it finds an upper
// bound of the smallest angle.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <tuple>
#include <vector>

#include "stages/materials/bcc_lattice.h"
#include "stages/materials/dihedral_angles.h"
#include "stages/materials/interface.h"
#include "stages/materials/pieces.h"

namespace tagrid {

using Vector3 = std::array<double, 3>;

/// A tetrahedron or a pyramid before it is cut, in halves of H, and how far its corners may be snapped.
struct SearchedShape {
  std::vector<Index3> corners;  ///< 4; or 5, see begin_pyramid()
  /// How much of the way to a cut each corner goes, and if all of them are snapped.
  std::vector<double> parts;
  double if_all_are_snapped = 1;
  bool ends_at_0 = false;  ///< the lattice ends at the plane z = 0, from which no corner moves away
  bool is_cut = true;      ///< its edges may have cuts
  SnapRule rule = closest_vertices;

  /// From which part of an edge on its end is not snapped.
  double limit(Index3 p, Index3 direction) const {
    return rule.limit(dot(direction, direction) == 3 ? 0 : 1, ends_at_0 && p.z == 0 && direction.z == 0) /
           double{cut_parts};
  }
  /// The ends of the ways of a corner.
  std::vector<Vector3> ways(std::size_t corner) const {
    const Index3 p = corners[corner];
    const bool stays = ends_at_0 && p.z == 0;
    std::vector<Vector3> ways;
    for (const Index3& along : edge_directions)
      for (const int sign : {-1, 1}) {
        const Index3 d = sign * along;
        if ((ends_at_0 && p.z + d.z < 0) || (stays && d.x == 0 && d.y == 0)) continue;
        const double way = parts[corner] * limit(p, d);
        ways.push_back({way * static_cast<double>(d.x), way * static_cast<double>(d.y),
                        stays ? 0 : way * static_cast<double>(d.z)});
      }
    return ways;
  }
};

class AngleSearch {
 public:
  explicit AngleSearch(SearchedShape shape)
      : shape_(std::move(shape)),
        corners_(shape_.corners.size()),
        edges_(corners_ == 4 ? std::span<const CellEdge>(edges_of_tetrahedron)
                             : std::span<const CellEdge>(edges_of_pyramid)) {
    const auto& v = shape_.corners;
    if (corners_ == 4 && dot(v[1] - v[0], cross(v[2] - v[0], v[3] - v[0])) < 0) {
      std::swap(shape_.corners[0], shape_.corners[1]);
      std::swap(shape_.parts[0], shape_.parts[1]);
    }
    for (std::size_t i = 0; i < corners_; ++i) ways_.push_back(shape_.ways(i));
  }

  /// The worst angles with up to `materials` materials. `all_snapped`: of cells whose corners are all snapped.
  AngleRange run(int materials, bool all_snapped, int starts = 8, int steps = 150) {
    AngleRange worst;
    State s;
    for (int code = 0; code < (corners_ == 4 ? 625 : 3125); ++code) {
      int rest = code, top = -1;
      bool is_first = true;  // of those that differ in the numbers of materials only
      for (std::size_t i = 0; i < corners_; ++i) {
        s.labels[i] = rest % 5 - 1;
        rest /= 5;
        is_first = is_first && s.labels[i] <= top + 1;
        top = std::max(top, s.labels[i]);
      }
      if (!is_first || top >= materials || (top < 0) != all_snapped || (!shape_.is_cut && top > 0)) continue;
      worst.add(run(s, starts, steps));
    }
    return worst;
  }

 private:
  struct State {
    std::array<int, 5> labels{};  ///< -1: snapped
    std::array<std::size_t, 5> way{};
    std::array<double, 5> part{};  ///< of the way, 0 .. 1
    std::array<double, 8> cut{};   ///< between the limits, 0 .. 1
    std::array<int, 5> order{0, 1, 2, 3, 4};
  };

  static std::size_t length_of(Index3 d) { return dot(d, d) <= 3 ? 0 : 1; }
  bool is_cut(const State& s, std::size_t e) const {
    const int a = s.labels[edges_[e][0]], b = s.labels[edges_[e][1]];
    return a >= 0 && b >= 0 && a != b;
  }

  AngleRange angles(const State& s) const {
    std::array<Vector3, first_cut + 8> x{};
    const bool all = std::all_of(s.labels.begin(), s.labels.begin() + corners_, [](int l) { return l < 0; });
    for (std::size_t i = 0; i < corners_; ++i)
      for (std::size_t a = 0; a < 3; ++a) {
        x[i][a] = static_cast<double>(shape_.corners[i][static_cast<int>(a)]);
        if (s.labels[i] < 0)
          x[i][a] += s.part[i] * (all ? shape_.if_all_are_snapped : 1) * ways_[i][s.way[i]][a];
      }
    std::array<std::size_t, 8> edges{};
    std::array<bool, 8> has_cut{};
    std::size_t cuts = 0;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (!is_cut(s, e)) continue;
      const std::size_t i = edges_[e][0], j = edges_[e][1];
      const Index3 direction = shape_.corners[j] - shape_.corners[i];
      const double low = shape_.limit(shape_.corners[i], direction),
                   high = shape_.limit(shape_.corners[j], -1 * direction),
                   t = low + (1 - low - high) * s.cut[e];
      for (std::size_t a = 0; a < 3; ++a) x[first_cut + e][a] = x[i][a] + t * (x[j][a] - x[i][a]);
      has_cut[e] = true;
      edges[cuts++] = e;
    }
    const auto rank = [&](std::size_t e) {
      const auto [i, j] = edges_[e];
      return std::tuple(-static_cast<int>(length_of(shape_.corners[j] - shape_.corners[i])),
                        std::min(s.order[i], s.order[j]), std::max(s.order[i], s.order[j]));
    };
    std::sort(edges.begin(), edges.begin() + cuts, [&](auto a, auto b) { return rank(a) < rank(b); });
    const auto worst_of = [&](Pieces pieces, std::span<const std::size_t> in_order) {
      for (const std::size_t e : in_order) pieces.bisect(edges_[e], static_cast<PieceVertex>(first_cut + e));
      AngleRange worst;
      for (const Piece& p : pieces.all()) worst.add(dihedral_angles({x[p[0]], x[p[1]], x[p[2]], x[p[3]]}));
      return worst;
    };
    if (corners_ == 4) return worst_of({}, {edges.data(), cuts});
    const auto differ = [&](std::size_t i) {
      return s.labels[i] >= 0 && s.labels[i + 2] >= 0 && s.labels[i] != s.labels[i + 2];
    };
    AngleRange best{0, 180};
    for_each_beginning<std::size_t>(
        {differ(0), differ(1)}, has_cut, {edges.data(), cuts}, [&](const Pieces& pieces) {
          const AngleRange r = worst_of(pieces, {edges.data(), cuts});
          if (std::min(r.smallest, 180 - r.largest) > std::min(best.smallest, 180 - best.largest)) best = r;
        });
    return best;
  }

  static double badness(const AngleRange& r, bool largest) { return largest ? 180 - r.largest : r.smallest; }

  AngleRange run(State s, int starts, int steps) {
    std::vector<std::size_t> snapped, cuts;
    for (std::size_t i = 0; i < corners_; ++i)
      if (s.labels[i] < 0) snapped.push_back(i);
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (is_cut(s, e)) cuts.push_back(e);
    std::array<std::vector<std::pair<double, State>>, 2> best;
    AngleRange worst;
    const auto offer = [&](const State& state) {
      const AngleRange r = angles(state);
      worst.add(r);
      for (std::size_t largest = 0; largest < 2; ++largest) {
        auto& list = best[largest];
        const double bad = badness(r, largest);
        if (list.size() == static_cast<std::size_t>(starts)) {
          if (bad >= list.back().first) continue;
          list.pop_back();
        }
        list.insert(std::upper_bound(list.begin(), list.end(), bad,
                                     [](double b, const auto& entry) { return b < entry.first; }),
                    {bad, state});
      }
    };
    std::size_t choices = 1;
    for (const std::size_t i : snapped) choices *= 1 + ways_[i].size();
    for (std::size_t choice = 0; choice < choices; ++choice) {
      std::size_t rest = choice;
      for (const std::size_t i : snapped) {
        const std::size_t n = 1 + ways_[i].size(), k = rest % n;
        rest /= n;
        s.part[i] = k > 0;
        s.way[i] = k > 0 ? k - 1 : 0;
      }
      for (std::size_t bits = 0; bits < std::size_t{1} << cuts.size(); ++bits) {
        for (std::size_t i = 0; i < cuts.size(); ++i) s.cut[cuts[i]] = bits >> i & 1;
        s.order = {0, 1, 2, 3, 4};
        if (corners_ == 4) {
          do offer(s);
          while (cuts.size() > 1 && std::next_permutation(s.order.begin(), s.order.begin() + 4));
        } else {  // too many: some of them
          offer(s);
          if (cuts.size() < 2) continue;
          std::shuffle(s.order.begin(), s.order.end(), random_);
          offer(s);
        }
      }
    }
    for (std::size_t largest = 0; largest < 2; ++largest)
      for (auto [bad, state] : best[largest]) descend(state, bad, largest, steps, worst);
    return worst;
  }

  void descend(State state, double bad, bool largest, int steps, AngleRange& worst) {
    std::uniform_real_distribution<double> unit(-1, 1);
    double step = 0.5;
    for (int i = 0; i < steps; ++i) {
      State next = state;
      const auto move = [&](double& x) { x = std::clamp(x + step * unit(random_), 0.0, 1.0); };
      if (const std::size_t which = random_() % (corners_ + edges_.size()); which < corners_) {
        if (random_() % 3 == 0) next.way[which] = random_() % ways_[which].size();
        if (random_() % 4 == 0) std::swap(next.order[which], next.order[random_() % corners_]);
        move(next.part[which]);
      } else {
        move(next.cut[which - corners_]);
      }
      const AngleRange r = angles(next);
      worst.add(r);
      if (badness(r, largest) <= bad) {
        bad = badness(r, largest);
        state = next;
      } else {
        step *= 0.98;
      }
    }
  }

  SearchedShape shape_;
  std::size_t corners_;
  std::vector<std::vector<Vector3>> ways_;
  std::span<const CellEdge> edges_;
  std::mt19937 random_{1};
};

}  // namespace tagrid
