// Where surfaces lie in the world, which way they face, and what a value means.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "io/errors/errors.h"
#include "pipeline/meshes/surface.h"
#include "tests/support/ply_reader.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

using Place = std::array<double, 3>;

// Six times the volume that a closed surface encloses.
double six_volumes_in(const PlySurface& s) {
  double sum = 0;
  for (const auto& t : s.triangles) {
    const Place &a = s.vertices[static_cast<std::size_t>(t[0])],
                &b = s.vertices[static_cast<std::size_t>(t[1])],
                &c = s.vertices[static_cast<std::size_t>(t[2])];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum;
}

class SurfaceInWorld : public TemporaryFolder {
 protected:
  // A ramp along x from 0 to 16, encoded with these header lines. Its root cubes meet at 7 and 15, and the one
  // in the middle has no vertex in padding: there the field is the ramp.
  PlySurface ramp(const std::string& fields, SurfaceOptions options) {
    const Index3 dims{17, 5, 5};
    std::vector<std::int16_t> samples;
    for (std::int64_t i = 0; i < Box::of_size(dims).count(); ++i)
      samples.push_back(static_cast<std::int16_t>(i % 17));
    write_nrrd(path("in.nrrd"), dims, samples, fields);
    EncodeOptions encoding{.cube_size = 8};
    encode_volume(path("in.nrrd"), {}, path("in.tag"), true, encoding, Resources(1));
    options.overwrite = true;
    last_ = write_surface(path("in.tag"), path("out.ply"), options, Resources(1));
    return read_ply(content("out.ply"));
  }
  SurfaceResult last_;
};

TEST_F(SurfaceInWorld, VerticesLieWhereTheHeaderSaysAndNormalsPointTowardsLowerValues) {
  for (const double x : {-0.5, 0.5}) {
    const std::string fields = "space dimension: 3\nspace directions: (" + std::to_string(x) +
                               ",0,0) (0,2,0) (0,1,4)\nspace origin: (-3,1,8)\n";
    const PlySurface s = ramp(fields, {.iso = 9.25, .area = true});
    ASSERT_FALSE(s.vertices.empty());
    for (const Place& p : s.vertices) EXPECT_EQ(p[0], -3 + 9.25 * x);
    EXPECT_NEAR(last_.counts.area, 4 * 2 * 4 * 4, 1e-9) << "4 x 4 parallelograms of 2 along y and 4 across";
    double area_along_x = 0;
    for (const auto& t : s.triangles) {
      const Place &a = s.vertices[static_cast<std::size_t>(t[0])],
                  &b = s.vertices[static_cast<std::size_t>(t[1])],
                  &c = s.vertices[static_cast<std::size_t>(t[2])];
      area_along_x += ((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])) / 2;
    }
    EXPECT_NEAR(area_along_x, x > 0 ? -128 : 128, 1e-9) << "values rise with x in the volume";
    const PlySurface closed = ramp(fields, {.iso = 9.25, .close = true});
    EXPECT_NEAR(six_volumes_in(closed) / 6, (16 - 9.25) * 4 * 4 * 0.5 * 2 * 4, 1e-9);
  }
}

TEST_F(SurfaceInWorld, AxesOfDifferentUnitsBecomeOnesOfTheFirstUnit) {
  double most = 0;
  for (const Place& p : ramp("spacings: 0.5 2 3000\nunits: \"mm\" \"mm\" \"um\"\n", {.iso = 9.25}).vertices) {
    EXPECT_EQ(p[0], 9.25 * 0.5);
    most = std::max(most, p[2]);
  }
  EXPECT_EQ(most, 4 * 3);
}

TEST_F(SurfaceInWorld, TheValueIsInTheUnitsThatTheFileGives) {
  for (const Place& p : ramp("rescale_slope:=0.5\nrescale_intercept:=-10\n", {.iso = -5.5}).vertices)
    EXPECT_EQ(p[0], 9);
  // With a negative slope values fall along x; what is at least the value is at low x.
  const PlySurface s = ramp("rescale_slope:=-2\nrescale_intercept:=1\n", {.iso = -17, .close = true});
  double least = 1e9;
  for (const Place& p : s.vertices) {
    least = std::min(least, p[0]);
    EXPECT_LE(p[0], 9);
  }
  EXPECT_EQ(least, 0);
  EXPECT_NEAR(six_volumes_in(s) / 6, 9 * 4 * 4, 1e-9);
  EXPECT_THROW(ramp("slice_slopes:=1 2 3 4 5\n", {.iso = 3}), UsageError);
  EXPECT_THROW(ramp("rescale_slope:=0\n", {.iso = 3}), BrokenInput);
}

}  // namespace
}  // namespace tagrid
