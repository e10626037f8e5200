// The 3x3x3 stencils of the field, against polynomials that they must reproduce and against a literal sum.
#include "stages/criterion/curvature.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <random>

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

}  // namespace
}  // namespace tagrid
