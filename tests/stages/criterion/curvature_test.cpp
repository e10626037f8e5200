// The 3x3x3 stencils of the field, against polynomials that they must reproduce and against a literal sum.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "stages/criterion/curvature.h"
#include "stages/grid/lattice.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/encode_volume.h"
#include "tests/support/oracle.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

using F = CurvatureField;

float component(const CurvatureField& f, int c, Index3 p) {
  return f.components[static_cast<std::size_t>(c)]
                     [static_cast<std::size_t>(f.row_offset(p.y, p.z) + (p.x - f.box.low.x) / 2)];
}

template <class Visit>
void for_each_even_point(const Box& box, Visit visit) {
  for (const auto [x, y, z] : points_of(box, 2)) visit(Index3{x, y, z});
}

// The ten components of the spline with these coefficients, in double precision.
std::array<double, 10> expected(const oracle::Jet& j, double scale) {
  const auto& h = j.hessian;
  return {216 * j.value,   scale * j.gradient[0], scale * j.gradient[1], scale * j.gradient[2],
          scale * h[0][0], scale * h[1][1],       scale * h[2][2],       scale * h[0][1],
          scale * h[0][2], scale * h[1][2]};
}

template <class T>
class Curvature : public testing::Test {};
TYPED_TEST_SUITE(Curvature, NarrowTypes);

TYPED_TEST(Curvature, IsExactOnLinearFields) {
  const auto volume = oracle::volume_of<TypeParam>(
      {17, 17, 17}, [](double x, double y, double z) { return 40 + 3 * x - 2 * y + z; });
  const Box box{{2, 4, 2}, {14, 12, 14}};
  const CurvatureField f = curvature_of(volume, box, 0.5);
  for_each_even_point(box, [&](Index3 p) {
    EXPECT_EQ(component(f, F::value, p), 216.0F * static_cast<float>(volume.at(p)));
    EXPECT_FLOAT_EQ(component(f, F::gx, p), 1.5F);
    EXPECT_FLOAT_EQ(component(f, F::gy, p), -1.0F);
    EXPECT_FLOAT_EQ(component(f, F::gz, p), 0.5F);
    for (int c = F::hxx; c < F::component_count; ++c) EXPECT_EQ(component(f, c, p), 0.0F);
  });
}

// Coefficients x^2 make the spline x^2 + 1/3, with the derivatives of x^2.
TYPED_TEST(Curvature, HasTheDerivativesOfQuadrics) {
  const double shift = std::numeric_limits<TypeParam>::is_signed ? 0 : 64;
  const auto volume = oracle::volume_of<TypeParam>({7, 7, 7}, [&](double x, double y, double z) {
    return shift + x * x + 2 * y * y - z * z + x * y - 2 * x * z + y * z;  // read where it fits every type
  });
  const Box box{{2, 2, 2}, {4, 4, 4}};
  const CurvatureField f = curvature_of(volume, box, 1);
  for_each_even_point(box, [&](Index3 p) {
    const auto x = static_cast<float>(p.x), y = static_cast<float>(p.y), z = static_cast<float>(p.z);
    EXPECT_FLOAT_EQ(component(f, F::value, p), 216 * static_cast<float>(volume.at(p)) + 216 * 2.0F / 3);
    EXPECT_FLOAT_EQ(component(f, F::gx, p), 2 * x + y - 2 * z);
    EXPECT_FLOAT_EQ(component(f, F::gy, p), 4 * y + x + z);
    EXPECT_FLOAT_EQ(component(f, F::gz, p), -2 * z - 2 * x + y);
    const float second[6] = {2, 4, -2, 1, -2, 1};
    for (int c = 0; c < 6; ++c) EXPECT_FLOAT_EQ(component(f, F::hxx + c, p), second[c]);
  });
}

TYPED_TEST(Curvature, EqualsTheLiteralStencilOnRandomSamples) {
  std::mt19937_64 random(7);
  oracle::Volume<TypeParam> volume{{9, 13, 70}, {}};  // rows shorter and longer than a vector
  volume.samples.resize(static_cast<std::size_t>(9 * 13 * 70));
  for (auto& s : volume.samples) s = static_cast<TypeParam>(random());
  // The extremes side by side: nothing may overflow, and the value must be exact.
  using Limits = std::numeric_limits<TypeParam>;
  for (std::size_t i = 0; i < 27 * 9; ++i) volume.samples[i] = i % 2 ? Limits::max() : Limits::min();
  const double scale = 8.0 / 3;
  for (const Box& box :
       {Box{{0, 0, 0}, {8, 12, 68}}, Box{{4, 2, 6}, {4, 2, 6}}, Box{{-2, -4, -2}, {12, 14, 4}}}) {
    const CurvatureField f = curvature_of(volume, box, scale);
    ASSERT_EQ(f.box, box);
    for_each_even_point(box, [&](Index3 p) {
      const auto want = expected(oracle::jet(volume, p), scale);
      EXPECT_EQ(component(f, F::value, p), static_cast<float>(std::llround(want[0])));
      for (int c = F::gx; c < F::component_count; ++c) {
        const double w = want[static_cast<std::size_t>(c)];
        ASSERT_NEAR(component(f, c, p), w, 4e-7 * std::abs(w) + 1e-9 * Limits::max()) << "component " << c;
      }
    });
  }
}

// Turning the volume so that x becomes y and y becomes z turns the components with it, to the last bit.
RC_GTEST_PROP(CurvatureField, AxesAreTreatedAlike, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  std::mt19937_64 random(seed);
  const Index3 dims{9, 9, 9};
  oracle::Volume<std::int16_t> v{dims, std::vector<std::int16_t>(729)}, turned = v;
  const Box all = Box::of_size(dims);
  for (auto& s : v.samples) s = static_cast<std::int16_t>(random());
  for (const auto [x, y, z] : points_of(Index3{9, 9, 9}))
    turned.samples[static_cast<std::size_t>(all.offset({z, x, y}))] = v.at({x, y, z});
  const Box box{{0, 0, 0}, {8, 8, 8}};
  const CurvatureField a = curvature_of(v, box, 0.7), b = curvature_of(turned, box, 0.7);
  constexpr int image[10] = {F::value, F::gy, F::gz, F::gx, F::hyy, F::hzz, F::hxx, F::hyz, F::hxy, F::hxz};
  for_each_even_point(box, [&](Index3 p) {
    for (int c = 0; c < 10; ++c) RC_ASSERT(component(a, c, p) == component(b, image[c], {p.z, p.x, p.y}));
  });
}

// The criterion on fields with known curvature: planes, quadrics, spheres, tori, waves.
//
// Marks are checked in the middle one of 3x3x3 root cubes: the edges of its points depend only on samples of
// the field, and on none that the border of a volume repeats.

constexpr int s = 32;
constexpr double centre = 1.5 * s;
constexpr Box middle{{s, s, s}, {2 * s, 2 * s, 2 * s}};

// Marks of the middle cube, for a field in voxels given relative to its centre. With 200 units per voxel,
// rounding adds little to the curvature.
template <class F>
LatticeBits marks_of_field(F f, int m = 20) {
  constexpr double units = 200;
  const auto volume =
      oracle::volume_of<std::int16_t>({3 * s + 1, 3 * s + 1, 3 * s + 1}, [&](double x, double y, double z) {
        return std::clamp(units * f(x - centre, y - centre, z - centre), -32768.0, 32767.0);
      });
  return marks_of(volume, s, {m, 1 / units, 24}, middle, middle);
}

struct Distance {
  std::array<double, 3> d;
  double length() const { return std::hypot(d[0], d[1], d[2]); }
};
Distance from_centre(Index3 p) {
  return {{static_cast<double>(p.x) - centre, static_cast<double>(p.y) - centre,
           static_cast<double>(p.z) - centre}};
}

double edge_length(Index3 p) {
  const PointClass c = classify(p, s);
  return 2 * static_cast<double>(c.unit) * std::sqrt(c.odd);
}

Index3 direction(Index3 p) {
  const BaseEdge e = base_edge(p, classify(p, s), s);
  return e.right - e.left;
}

template <class Visit>
void for_each_edge(Visit visit) {
  for_each_point(middle, [&](Index3 p) {
    if (classify(p, s).odd > 0) visit(p);
  });
}

// The share of marked points among the points of one unit that `choose` selects.
template <class Choose>
double share_of_marked(const LatticeBits& marks, std::int64_t unit, Choose choose) {
  double all = 0, marked = 0;
  for_each_edge([&](Index3 p) {
    if (classify(p, s).unit != unit || !choose(p)) return;
    ++all;
    marked += marks.test(p);
  });
  EXPECT_GT(all, 50);
  return marked / all;
}

RC_GTEST_PROP(MarkedFields, APlaneOfAnySlopeIsNeverMarked, ()) {
  const auto slope = [] { return *rc::gen::inRange(-110, 111); };
  const int a = slope(), b = slope(), c = slope(), offset = *rc::gen::inRange(-500, 501);
  const auto volume =
      oracle::volume_of<std::int16_t>({3 * s + 1, 3 * s + 1, 3 * s + 1}, [&](double x, double y, double z) {
        return offset + a * (x - centre) + b * (y - centre) + c * (z - centre);
      });
  const double scale = *rc::gen::element(8.0 / 65536, 8.0 / 4096, 0.1, 1.0, 1000.0);
  for (const int m : {3, 20, 500, 1000000})
    RC_ASSERT(count_of(marks_of(volume, s, {m, scale, 24}, middle, middle)) == 0);
}

// r^2 / 2R is the sphere of radius R at its pole: an edge near the centre is marked if it is longer than a
// side of the m-gon in a circle of radius R.
TEST(MarkedFields, NearThePoleOfASphereEdgesAreAsLongAsTheSideOfThePolygon) {
  for (const double radius : {12.0, 25.0, 50.0})
    for (const int m : {10, 20, 40}) {
      const auto marks = marks_of_field(
          [&](double x, double y, double z) { return (x * x + y * y + z * z) / (2 * radius); }, m);
      const double side = 2 * std::numbers::pi / m * radius;
      for_each_edge([&](Index3 p) {
        const double length = edge_length(p);
        if (from_centre(p).length() + length / 2 > radius / 8) return;
        if (length > 0.8 * side && length < 1.25 * side) return;
        ASSERT_EQ(marks.test(p), length > side) << radius << " m " << m << " length " << length;
      });
    }
}

TEST(MarkedFields, ACylinderIsNeverMarkedAlongItsAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto marks = marks_of_field([&](double x, double y, double z) {
      const double squares[3] = {y * y + z * z, x * x + z * z, x * x + y * y};
      return squares[axis] / 30;
    });
    std::int64_t across = 0;
    for_each_edge([&](Index3 p) {
      const Index3 d = direction(p);
      const bool along = squared_length(d) == d[axis] * d[axis];
      ASSERT_FALSE(along && marks.test(p));
      across += marks.test(p);
    });
    EXPECT_GT(across, 500);
  }
}

// In the saddle xy only diagonals bend: axis-parallel edges are straight lines of the surface.
TEST(MarkedFields, ASaddleIsMarkedOnlyAcrossItsRulings) {
  const auto marks = marks_of_field([](double x, double y, double) { return x * y / 12; });
  std::int64_t diagonal = 0;
  for_each_edge([&](Index3 p) {
    const Index3 d = direction(p);
    const bool in_ruling = d.x == 0 || d.y == 0;
    ASSERT_FALSE(in_ruling && marks.test(p));
    diagonal += marks.test(p);
  });
  EXPECT_GT(diagonal, 500);
}

// A symmetry of the field is a symmetry of the marks, as the lattice has these symmetries, too. Rounding may
// decide differently on the two sides of a tie.
TEST(MarkedFields, MarksHaveTheSymmetryOfTheField) {
  const auto check = [](const LatticeBits& marks, auto image, const char* what) {
    std::int64_t different = 0;
    for_each_edge([&](Index3 p) { different += marks.test(p) != marks.test(image(p)); });
    EXPECT_GT(count_of(marks), 500) << what;
    EXPECT_LE(different, count_of(marks) / 500) << what;
  };
  const auto inverted = [](Index3 p) { return Index3{3 * s, 3 * s, 3 * s} - p; };
  const auto turned = [](Index3 p) { return Index3{p.z, p.x, p.y}; };
  const auto swapped = [](Index3 p) { return Index3{p.y, p.x, p.z}; };
  const auto sphere = marks_of_field([](double x, double y, double z) { return std::hypot(x, y, z); });
  check(sphere, inverted, "sphere, inverted");
  check(sphere, turned, "sphere, turned");
  check(sphere, swapped, "sphere, swapped");
  const auto saddle =
      marks_of_field([](double x, double y, double z) { return (x * y + y * z + z * x) / 20; });
  check(saddle, inverted, "saddle, inverted");
  check(saddle, turned, "saddle, turned");
}

// The level sets of the distance have radius r: the nearer to the centre, the more is marked.
TEST(MarkedFields, SmallRadiiOfADistanceFieldAreMarkedFiner) {
  const auto marks = marks_of_field([](double x, double y, double z) { return 2 * std::hypot(x, y, z); });
  for (const std::int64_t unit : {1, 2}) {
    const auto shell = [&](double from, double to) {
      return share_of_marked(marks, unit, [&](Index3 p) {
        const double r = from_centre(p).length();
        return r >= from && r < to;
      });
    };
    const double u = static_cast<double>(unit);
    const double near = shell(0, 4 * u), between = shell(4 * u, 9 * u), far = shell(9 * u, 28);
    EXPECT_GT(near, between) << "unit " << unit;
    EXPECT_GE(between, far) << "unit " << unit;
    EXPECT_GT(near, 2 * far) << "unit " << unit;
  }
}

TEST(MarkedFields, ATorusIsMarkedAtItsRing) {
  const auto to_ring = [](double x, double y, double z) { return std::hypot(std::hypot(x, y) - 10, z); };
  const auto marks = marks_of_field([&](double x, double y, double z) { return 2 * to_ring(x, y, z); });
  const auto tube = [&](double from, double to) {
    return share_of_marked(marks, 1, [&](Index3 p) {
      const auto d = from_centre(p).d;
      const double r = to_ring(d[0], d[1], d[2]);
      return r >= from && r < to;
    });
  };
  EXPECT_GT(tube(0, 1.5), 0.5);
  EXPECT_LT(tube(6, 20), 0.2);
}

// Along x a wave bends at its crests and is straight at its zeros.
TEST(MarkedFields, AWaveIsMarkedAtItsCrests) {
  constexpr double k = std::numbers::pi / 16, height = 8;
  const auto marks = marks_of_field([&](double x, double, double) { return height * std::sin(k * x); });
  std::int64_t crests = 0, zeros = 0;
  for_each_edge([&](Index3 p) {
    const Index3 d = direction(p);
    ASSERT_FALSE(d.x == 0 && marks.test(p));
    if (classify(p, s).unit != 1 || squared_length(d) != d.x * d.x) return;
    const double phase = std::abs(std::sin(k * (static_cast<double>(p.x) - centre)));
    crests += phase > 0.9;
    zeros += phase < 0.2;
    ASSERT_FALSE(phase > 0.9 && !marks.test(p)) << p.x;
    ASSERT_FALSE(phase < 0.2 && marks.test(p)) << p.x;
  });
  EXPECT_GT(crests, 100);
  EXPECT_GT(zeros, 100);
}

}  // namespace
}  // namespace tagrid
