// The laws of an oriented surface of triangles, checked from nothing but the numbers of its vertices.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace tagrid {

using Triangles = std::vector<std::array<std::int64_t, 3>>;

struct SurfaceFindings {
  std::int64_t vertices = 0, triangles = 0, edges = 0;
  std::int64_t border_edges = 0;  ///< edges of one triangle
  std::int64_t components = 0;
  std::int64_t crowded =
      0;  ///< directed edges of two triangles or more: crossing sheets, or two orientations
  std::int64_t collapsed = 0;  ///< triangles with a vertex twice
  std::int64_t unused = 0;     ///< vertices of no triangle
  std::int64_t pinched = 0;    ///< vertices whose triangles are not one fan

  std::int64_t euler() const { return vertices - edges + triangles; }
  bool good() const { return crowded + collapsed + unused + pinched == 0; }
  std::string text() const {
    return std::to_string(crowded) + " crowded edges, " + std::to_string(collapsed) +
           " collapsed triangles, " + std::to_string(unused) + " unused vertices, " +
           std::to_string(pinched) + " pinched vertices";
  }
};

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n), count_(n) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    a = root(a), b = root(b);
    count_ -= a != b;
    parent_[a] = b;
  }
  std::size_t count() const { return count_; }

 private:
  std::vector<std::size_t> parent_;
  std::size_t count_;
};

/// REQUIRES: all numbers are below `vertices`. `open_edge(a, b)` is called for each edge of one triangle.
template <class OpenEdge>
SurfaceFindings check_surface(std::size_t vertices, const Triangles& triangles, OpenEdge open_edge) {
  SurfaceFindings found;
  found.vertices = static_cast<std::int64_t>(vertices);
  found.triangles = static_cast<std::int64_t>(triangles.size());
  std::map<std::pair<std::int64_t, std::int64_t>, std::size_t> corner_of;  // by directed edge
  DisjointSets components(vertices), fans(3 * triangles.size());
  std::vector<bool> used(vertices);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t a = triangles[t][i], b = triangles[t][(i + 1) % 3];
      found.collapsed += a == b;
      found.crowded += !corner_of.emplace(std::pair(a, b), 3 * t + i).second;
      components.join(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
      used[static_cast<std::size_t>(a)] = true;
    }
  for (const auto& [edge, corner] : corner_of) {
    const auto other = corner_of.find({edge.second, edge.first});
    const bool open = other == corner_of.end();
    found.border_edges += open;
    found.edges += open || edge.first < edge.second;
    if (open) {
      open_edge(edge.first, edge.second);
      continue;
    }
    // The corners of both triangles at each end of their edge belong to one fan.
    const auto next = [](std::size_t c) { return c % 3 == 2 ? c - 2 : c + 1; };
    fans.join(corner, next(other->second));
    fans.join(next(corner), other->second);
  }
  found.unused = std::count(used.begin(), used.end(), false);
  found.components = static_cast<std::int64_t>(components.count());
  found.pinched = static_cast<std::int64_t>(fans.count()) - (found.vertices - found.unused);
  return found;
}

inline SurfaceFindings check_surface(std::size_t vertices, const Triangles& triangles) {
  return check_surface(vertices, triangles, [](std::int64_t, std::int64_t) {});
}

}  // namespace tagrid
