// The surface of a field on random conforming grids, assembled from bricks by the names of its vertices.
#include <limits>
#include <set>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice.h"
#include "stages/surface/cases.h"
#include "stages/surface/surface.h"
#include "stages/values/points/field.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/counted_heap.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"
#include "tests/support/surface_laws.h"

namespace tagrid {
namespace {

using Name = std::array<std::int64_t, 6>;  // the ends of an edge

struct WholeSurface {
  std::map<Name, std::pair<std::int64_t, double>> vertices;  // number and place
  Triangles triangles;
  std::int64_t border_edges = 0;
  bool has_gaps = false;
  int disagree = 0;  // vertices that bricks put at different places

  std::vector<Name> names() const {
    std::vector<Name> all(vertices.size());
    for (const auto& [name, vertex] : vertices) all[static_cast<std::size_t>(vertex.first)] = name;
    return all;
  }
  SurfaceFindings check() const { return check_surface(vertices.size(), triangles); }
  // Triangles by the names of their corners, the least of them first.
  std::vector<std::array<Name, 3>> named_triangles() const {
    const std::vector<Name> all = names();
    std::vector<std::array<Name, 3>> named;
    for (const auto& t : triangles) {
      std::array<Name, 3> n;
      for (std::size_t i = 0; i < 3; ++i) n[i] = all[static_cast<std::size_t>(t[i])];
      std::rotate(n.begin(), std::min_element(n.begin(), n.end()), n.end());
      named.push_back(n);
    }
    std::sort(named.begin(), named.end());
    return named;
  }
};

Index3 point_of(const Box& box, std::uint32_t number) {
  const Index3 n = box.size();
  return box.low + Index3{number % n.x, number / n.x % n.y, number / (n.x * n.y)};
}

template <class T>
struct Field {
  Domain domain;
  LatticeBits active;
  std::vector<T> values;  // at all points of the padded domain

  WholeSurface surface(SurfaceLevel level, int brick_edge, bool close = false,
                       std::optional<Box> box = {}) const {
    const BrickGrid bricks{domain, brick_edge};
    const SurfaceGrid grid{domain.cube_size, domain.volume(), box, close};
    WholeSurface whole;
    for (std::int64_t id = 0; id < bricks.count(); ++id) {
      const Box closed = bricks.closed_box(bricks.position(id));
      LatticeBits bits(closed);
      copy_bits(active, bits);
      std::vector<T> points;
      for_each_point(closed, [&](Index3 p) {
        points.push_back(values[static_cast<std::size_t>(active.box().offset(p))]);
      });
      const BrickSurface part = surface_of_brick<T>(points, bits, grid, level);
      std::vector<std::int64_t> ids;
      for (const SurfaceVertex& v : part.vertices) {
        const Index3 a = point_of(closed, v.low), b = point_of(closed, v.high);
        const auto number = static_cast<std::int64_t>(whole.vertices.size());
        const auto [found, is_new] = whole.vertices.try_emplace({a.x, a.y, a.z, b.x, b.y, b.z}, number, v.at);
        whole.disagree += found->second.second != v.at;
        ids.push_back(found->second.first);
      }
      for (const auto& t : part.triangles) whole.triangles.push_back({ids[t[0]], ids[t[1]], ids[t[2]]});
      whole.border_edges += part.border_edges;
      whole.has_gaps = whole.has_gaps || part.has_gaps;
    }
    return whole;
  }
};

// Random values in a small range, so that many are equal to any level in it.
template <class T>
Field<T> random_field(Index3 dims, int cube_size, int marks, int range, std::uint64_t seed) {
  Field<T> field{{dims, cube_size, static_cast<int>(seed / 3 % 2)}, {}, {}};
  const Box padded = field.domain.padded();
  field.active = random_conforming_activity(padded, cube_size, marks, seed);
  std::mt19937_64 random(seed);
  for (std::int64_t i = 0; i < padded.count(); ++i)
    field.values.push_back(static_cast<T>(static_cast<int>(random() % static_cast<unsigned>(range))));
  return field;
}

constexpr Index3 awkward[] = {{2, 2, 2}, {9, 9, 9}, {10, 11, 12}, {13, 17, 18}, {6, 25, 3}, {33, 12, 7}};

template <class Use>
void for_each_case(Use use) {
  std::uint64_t seed = 1;
  for (const Index3 dims : awkward)
    for (const int cube : {4, 8})
      for (const int marks : {0, 5, 60, 3000}) {
        SCOPED_TRACE(::testing::Message() << dims.x << " x " << dims.y << " x " << dims.z << ", cubes of "
                                          << cube << ", " << marks << " marks");
        use(random_field<std::uint8_t>(dims, cube, marks, 4, seed++));
      }
}

bool is_in_border(const Name& a, const Name& b, const Box& volume) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const std::int64_t plane : {volume.low[static_cast<int>(axis)], volume.high[static_cast<int>(axis)]})
      if (a[axis] == plane && a[axis + 3] == plane && b[axis] == plane && b[axis + 3] == plane) return true;
  return false;
}

TEST(Surface, IsAnOrientedManifoldWhoseOnlyBorderIsThatOfTheVolume) {
  for_each_case([](const Field<std::uint8_t>& field) {
    for (const double iso : {0.5, 1.0, 2.0, 2.5, 3.0}) {
      const WholeSurface surface = field.surface({iso}, 1);
      const std::vector<Name> names = surface.names();
      std::int64_t inner = 0;
      const SurfaceFindings found =
          check_surface(names.size(), surface.triangles, [&](std::int64_t a, std::int64_t b) {
            inner += !is_in_border(names[static_cast<std::size_t>(a)], names[static_cast<std::size_t>(b)],
                                   field.domain.volume());
          });
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_EQ(inner, 0);
      EXPECT_EQ(found.border_edges, surface.border_edges);
      EXPECT_FALSE(surface.has_gaps);
      for (const Name& n : names) {
        EXPECT_TRUE(field.domain.volume().contains(Index3{n[0], n[1], n[2]}));
        EXPECT_TRUE(field.domain.volume().contains(Index3{n[3], n[4], n[5]}));
      }
    }
  });
}

TEST(Surface, IsClosedOnRequest) {
  for_each_case([](const Field<std::uint8_t>& field) {
    for (const double iso : {-0.5, 0.0, 1.0, 2.5}) {
      const WholeSurface surface = field.surface({iso}, 1, true);
      const SurfaceFindings found = surface.check();
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_EQ(found.border_edges, 0);
      EXPECT_EQ(surface.border_edges, 0);
      if (iso < 0) {
        EXPECT_EQ(found.components, 1) << "everything is inside: the border of the box";
        EXPECT_EQ(found.euler(), 2);
      }
    }
  });
}

TEST(Surface, IsTheSameForAnyBricks) {
  for_each_case([](const Field<std::uint8_t>& field) {
    for (const bool close : {false, true}) {
      const WholeSurface one = field.surface({2}, 1, close);
      const auto triangles = one.named_triangles();
      for (const int edge : {2, 4}) {
        const WholeSurface other = field.surface({2}, edge, close);
        EXPECT_TRUE(other.named_triangles() == triangles);
        EXPECT_EQ(other.border_edges, one.border_edges);
        EXPECT_EQ(other.check().components, one.check().components);
        EXPECT_EQ(other.disagree + one.disagree, 0);
      }
    }
  });
}

// The inside of falling samples is that of the negative samples. (Of doubles: cut integers are rounded upwards.)
TEST(Surface, FallingSamplesHaveTheSurfaceOfTheirNegatives) {
  for_each_case([](const Field<std::uint8_t>& field) {
    Field<double> positive{field.domain, field.active, {}}, negative = positive;
    for (const std::uint8_t value : field.values) {
      positive.values.push_back(value);
      negative.values.push_back(-static_cast<double>(value));
    }
    for (const double iso : {1.0, 1.5})
      EXPECT_TRUE(negative.surface({-iso, true}, 1).named_triangles() ==
                  positive.surface({iso}, 1).named_triangles());
  });
}

TEST(Surface, ARegionHasTheTrianglesInTetrahedraThatMeetIt) {
  const auto field = random_field<std::uint8_t>({13, 17, 18}, 8, 60, 4, 3);
  const auto all = field.surface({2}, 2).named_triangles();
  const auto some = field.surface({2}, 2, false, Box{{3, 3, 3}, {6, 9, 5}}).named_triangles();
  EXPECT_TRUE(std::includes(all.begin(), all.end(), some.begin(), some.end()));
  EXPECT_LT(some.size(), all.size());
  EXPECT_GT(some.size(), 0U);
  EXPECT_TRUE(field.surface({2}, 2, false, field.domain.volume()).named_triangles() == all);
}

// Where the field is a plane, vertices lie in it.
TEST(Surface, VerticesLieWhereTheFieldHasTheLevel) {
  Field<float> field{{{20, 9, 9}, 8}, {}, {}};
  field.active = random_conforming_activity(field.domain.padded(), 8, 40, 11);
  for_each_point(field.domain.padded(),
                 [&](Index3 p) { field.values.push_back(static_cast<float>(2 * p.x + 4 * p.y - p.z)); });
  const WholeSurface surface = field.surface({17.25}, 1);
  ASSERT_GT(surface.vertices.size(), 10U);
  for (const auto& [n, vertex] : surface.vertices) {
    double place[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] = static_cast<double>(n[axis]) + vertex.second * static_cast<double>(n[axis + 3] - n[axis]);
    EXPECT_NEAR(2 * place[0] + 4 * place[1] - place[2], 17.25, 1e-12);
  }
}

template <class T>
void put(Field<T>& field, Index3 p, double value) {
  field.values[static_cast<std::size_t>(field.active.box().offset(p))] = static_cast<T>(value);
}

// All points are vertices of the grid; root cubes have 8 samples.
Field<std::uint8_t> field_of_zeros(Index3 dims) {
  Field<std::uint8_t> field{{dims, 8}, {}, {}};
  field.active = LatticeBits(field.domain.padded());
  for_each_point(field.domain.padded(), [&](Index3 p) { field.active.set(p); });
  field.values.resize(static_cast<std::size_t>(field.domain.padded().count()));
  return field;
}

TEST(Surface, OfSpecksOfExactlyTheLevelThereIsNone) {
  // Inside of a root cube, on a face and on an edge of it, in the border of the volume, and beside what is cut off there.
  const std::vector<std::vector<Index3>> specks = {
      {{4, 4, 4}},
      {{8, 4, 4}},
      {{8, 8, 4}},
      {{0, 4, 4}},
      {{17, 4, 4}},
      {{4, 16, 12}},
      {{3, 4, 4}, {4, 4, 4}, {5, 4, 4}},
      {{4, 4, 8}, {5, 4, 8}, {5, 5, 9}},  // across a face: the first two are a row on it
      {{8, 8, 3}, {8, 9, 3}, {9, 9, 3}}};
  for (const auto& speck : specks)
    for (const bool close : {false, true}) {
      auto field = field_of_zeros({18, 18, 18});
      for (const Index3 p : speck) put(field, p, 2);
      EXPECT_TRUE(field.surface({2}, 1, close).triangles.empty()) << speck[0].x << " " << speck[0].y;
      EXPECT_FALSE(field.surface({1.5}, 1, close).triangles.empty());
      // If anything at them has more, they are part of its surface.
      put(field, speck[0] + unit_vector(2), 3);
      EXPECT_FALSE(field.surface({2}, 1, close).triangles.empty());
    }
}

TEST(Surface, OfThickPartsOfExactlyTheLevelItIsThatOfALowerOne) {
  auto field = field_of_zeros({18, 18, 18});
  for_each_point(Box{{3, 5, 6}, {9, 11, 13}}, [&](Index3 p) { put(field, p, 2); });
  const WholeSurface surface = field.surface({2}, 1);
  EXPECT_GT(surface.triangles.size(), 500U);
  EXPECT_TRUE(surface.named_triangles() == field.surface({1.5}, 1).named_triangles());
}

constexpr double infinity = std::numeric_limits<double>::infinity(),
                 nan = std::numeric_limits<double>::quiet_NaN();

TEST(Surface, InfiniteValuesAreOnTheirSide) {
  auto field = random_field<double>({17, 17, 17}, 8, 3000, 4, 7);
  std::mt19937_64 random(5);
  for (double& value : field.values)
    if (const auto r = random() % 6; r < 2) value = r == 0 ? infinity : -infinity;
  const WholeSurface surface = field.surface({2}, 1, true);
  const SurfaceFindings found = surface.check();
  EXPECT_TRUE(found.good()) << found.text();
  EXPECT_EQ(found.border_edges, 0);
  for (const auto& [name, vertex] : surface.vertices) {
    EXPECT_GE(vertex.second, 0);
    EXPECT_LE(vertex.second, 1);
  }
}

TEST(Surface, DifferencesThatOverflowHaveAPlaceBetween) {
  Field<double> field{{{5, 5, 5}, 4}, LatticeBits(Box{{0, 0, 0}, {4, 4, 4}}), {}};
  close_naively(field.active, 4);
  field.values.assign(125, -1.5e308);
  put(field, {0, 0, 0}, 1.5e308);
  for (const auto& [name, vertex] : field.surface({0}, 1).vertices) EXPECT_EQ(vertex.second, 0.5);
}

TEST(Surface, ANaNLeavesAGapUnlessTheSurfaceIsClosed) {
  auto field = random_field<float>({17, 17, 17}, 8, 3000, 4, 7);
  for (const Index3 p : {Index3{8, 8, 8}, {0, 8, 16}, {3, 4, 9}}) put(field, p, nan);
  const WholeSurface open = field.surface({2}, 1);
  EXPECT_TRUE(open.has_gaps);
  EXPECT_TRUE(open.check().good());
  EXPECT_GT(open.check().border_edges, open.border_edges);
  for (const auto& [n, vertex] : open.vertices)
    for (const Index3 p : {Index3{n[0], n[1], n[2]}, Index3{n[3], n[4], n[5]}})
      EXPECT_NE(p, (Index3{8, 8, 8}));
  const SurfaceFindings closed = field.surface({2}, 1, true).check();
  EXPECT_TRUE(closed.good()) << closed.text();
  EXPECT_EQ(closed.border_edges, 0);
  EXPECT_TRUE(field.surface({2}, 2, true).named_triangles() == field.surface({2}, 1, true).named_triangles());
}

// Tables of the cases of a surface, and its bytes.

using Corner = std::pair<unsigned, unsigned>;

Corner corner(CutEdge edge) { return std::minmax<unsigned>(edge.a, edge.b); }

// Six times the volume under a triangle, whose corners are in the middle of edges, times eight.
std::int64_t volume_under(const std::array<CutEdge, 3>& triangle) {
  constexpr std::array<Index3, 4> v = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::array<Index3, 4> corners;
  for (std::size_t i = 0; i < 3; ++i) corners[i] = v[triangle[i].a] + v[triangle[i].b];
  return -six_volumes({corners[0], corners[1], corners[2], Index3{0, 0, 0}});
}

TEST(SurfaceCases, CutsAndFacesTogetherBoundThePartThatIsInside) {
  for (unsigned inside = 1; inside < 16; ++inside) {
    std::set<std::pair<Corner, Corner>> directed;
    std::int64_t volume = 0;
    const auto add = [&](const std::array<CutEdge, 3>& triangle) {
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_TRUE(directed.emplace(corner(triangle[i]), corner(triangle[(i + 1) % 3])).second) << inside;
      volume += volume_under(triangle);
    };
    for (const auto& triangle : triangles_in_tetrahedron[inside]) {
      for (const CutEdge edge : triangle) EXPECT_NE((inside >> edge.a) & 1, (inside >> edge.b) & 1) << inside;
      add(triangle);
    }
    for (const auto& face : faces_of_tetrahedron) {
      unsigned of_face = 0;
      for (unsigned i = 0; i < 3; ++i) of_face |= ((inside >> face[i]) & 1) << i;
      for (std::array<CutEdge, 3> triangle : triangles_in_face[of_face]) {
        for (CutEdge& edge : triangle) edge = {face[edge.a], face[edge.b]};
        add(triangle);
      }
    }
    for (const auto& [a, b] : directed) EXPECT_TRUE(directed.contains({b, a})) << inside;
    // A corner cut at the middle of its edges has an eighth of the tetrahedron, a half is left between two edges.
    const int expected[] = {0, 1, 4, 7, 8};
    EXPECT_EQ(volume, expected[std::popcount(inside)]) << inside;
  }
}

TEST(SurfaceCases, ATetrahedronThatIsNotCrossedHasNoTriangle) {
  EXPECT_EQ(triangles_in_tetrahedron[0].count, 0U);
  EXPECT_EQ(triangles_in_tetrahedron[15].count, 0U);
}

// A surface takes no more memory than it states, and what it states is not much more than noise takes.

template <class T>
void check(int cube, Index3 cubes, Index3 cut) {
  const Box box{{0, 0, 0}, {cubes.x * cube, cubes.y * cube, cubes.z * cube}};
  LatticeBits active(box);
  std::vector<T> points(static_cast<std::size_t>(box.count()));
  std::mt19937_64 random(1);
  for (const auto [x, y, z] : points_of(Box{{}, box.high})) {
    active.set(Index3{x, y, z});
    // Edges along the axes, of which there are three at a point, always change sides; others, often.
    const bool odd = (x + y + z) % 2 != 0 || random() % 8 == 0;
    points[static_cast<std::size_t>(box.offset({x, y, z}))] = static_cast<T>(odd ? 100 : 0);
  }
  for (const bool close : {false, true}) {
    const SurfaceGrid grid{cube, {box.low, box.high - cut}, std::nullopt, close};
    const HeapPeak peak;
    const BrickSurface surface = surface_of_brick<T>(points, active, grid, {50});
    const std::uint64_t stated = working_bytes_of_surface(sample_type_of<T>(), box.size(), cube);
    EXPECT_LE(peak.bytes(), stated) << name_of(sample_type_of<T>()) << ", " << cube << ", " << close;
    // Small bricks have many points on their faces, where edges are fewer.
    if (cube >= 16) {
      EXPECT_LE(static_cast<double>(stated), 2.5 * static_cast<double>(peak.bytes()))
          << cube << ", " << close;
    }
    EXPECT_LE(surface.vertices.size(), most_surface_vertices(box.size()));
    EXPECT_LE(surface.triangles.size(), most_surface_triangles(box.size()));
  }
}

TEST(SurfaceBytes, AreWhatIsStatedForNoise) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  check<std::uint8_t>(32, {2, 2, 2}, {0, 0, 0});
  check<std::int16_t>(8, {2, 3, 2}, {3, 1, 7});
  check<float>(16, {2, 1, 2}, {0, 0, 1});
  check<double>(4, {2, 2, 2}, {3, 3, 3});
}

}  // namespace
}  // namespace tagrid
