// Every sample type, mode and bound, on volumes that are hard on a coder.
#include <iostream>

#include "io/errors/errors.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

template <class T>
class EverySampleType : public TemporaryFolder {
 protected:
  const std::string in_ = path("in.nrrd"), tag_ = path("a.tag"), out_ = path("out.nrrd");

  // Expects that a decoded volume is within a bound (negative: any error is allowed).
  void expect_within(const std::vector<T>& samples, Index3 dims, EncodeOptions options, double bound) {
    write_nrrd(in_, dims, samples);
    ASSERT_NO_THROW(encode_volume(in_, {}, tag_, true, options, Resources(1)));
    ASSERT_NO_THROW(verify_file(tag_, in_, {}, Resources(1)));
    decode_volume(tag_, out_, format_named("nrrd"), true, Resources(1));
    const std::vector<T> decoded = read_samples<T>(out_);
    ASSERT_EQ(decoded.size(), samples.size());
    if (bound < 0) return;
    for (std::size_t i = 0; i < samples.size(); ++i)
      ASSERT_TRUE(comes_back(samples[i], decoded[i], bound))
          << "sample " << i << ": " << +samples[i] << " came back as " << +decoded[i];
  }
};

TYPED_TEST_SUITE(EverySampleType, AllTypes);

// A brick of two root cubes of 4 owns 9 samples, then 8: sizes around both, primes, thin ones.
const Index3 sizes[] = {{1, 1, 1}, {1, 5, 7},  {13, 1, 1}, {1, 1, 9},   {9, 8, 10}, {7, 7, 7},
                        {8, 9, 2}, {11, 3, 6}, {17, 4, 5}, {10, 10, 1}, {5, 18, 3}, {2, 2, 17}};

template <class T>
std::vector<double> bounds() {
  if constexpr (std::is_integral_v<T>) return {0, 1, 2, 7, 1000, 2147483647.0, 1e10};
  return {0, 1e-320, 1e-45, 3e-39, 1e-9, 0.1, 0.5, 3, 1e10, 1e38, 1e300, std::numeric_limits<double>::max()};
}

template <class T>
EncodeOptions small_options() {
  EncodeOptions options{.cube_size = 4};
  return options;
}

TYPED_TEST(EverySampleType, EveryAwkwardVolumeComesBackBitByBit) {
  for (int kind = 0; kind < static_cast<int>(Awkward::count); ++kind)
    for (const Index3 dims : sizes) {
      SCOPED_TRACE(name_of(Awkward(kind)) + " " + std::to_string(dims.x) + " " + std::to_string(dims.y));
      const auto samples = awkward_volume<TypeParam>(Awkward(kind), dims, 1);
      this->expect_within(samples, dims, small_options<TypeParam>(), 0);
      EncodeOptions exact_grid = small_options<TypeParam>();
      exact_grid.grid_only = true;
      exact_grid.max_error = 0;
      this->expect_within(samples, dims, exact_grid, 0);
      if (this->HasFatalFailure()) return;
    }
}

TYPED_TEST(EverySampleType, EveryVoxelIsWithinTheBoundInEveryMode) {
  const auto all_bounds = bounds<TypeParam>();
  for (unsigned seed = 0; seed < (is_wide<TypeParam> ? 400U : 100U); ++seed) {
    std::mt19937 random(seed);
    const auto kind = static_cast<Awkward>(random() % static_cast<unsigned>(Awkward::count));
    const Index3 dims = sizes[random() % std::size(sizes)];
    const double bound = all_bounds[random() % all_bounds.size()];
    const unsigned mode = random() % 6;
    SCOPED_TRACE("seed " + std::to_string(seed) + ", " + name_of(kind) + ", bound " + std::to_string(bound) +
                 ", mode " + std::to_string(mode));
    EncodeOptions options = small_options<TypeParam>();
    if (random() % 4 == 0) options.cube_size = 16;
    options.grid_only = mode == 1 || mode == 2 || mode == 5;
    if (mode != 2 && mode != 5) options.max_error = bound;
    if (mode == 5) options.mesh_error = bound;  // with exact points, the voxels are as good as the mesh
    if (mode == 3 && bound >= 1) options.surface_error = random() % 2 ? 0 : bound / 8;
    if (mode == 3 && bound > 0 && std::is_floating_point_v<TypeParam>)
      options.surface_error = random() % 2 ? 0 : bound / 8;
    // Not below the bound of the voxels, which are values of the mesh.
    if (mode == 4) options.mesh_error = std::max(bound, all_bounds[random() % all_bounds.size()]);
    const auto samples = awkward_volume<TypeParam>(kind, dims, seed);
    this->expect_within(samples, dims, options, mode == 2 ? -1 : bound);
    if (this->HasFatalFailure()) return;
  }
}

// The grid alone, without a bound: its points keep every bit.
TYPED_TEST(EverySampleType, AGridOfEveryPointComesBackBitByBit) {
  const Index3 dims{9, 6, 7};
  for (const Awkward kind : {Awkward::noise, Awkward::smooth, Awkward::not_finite_blobs}) {
    EncodeOptions options = small_options<TypeParam>();
    options.grid_only = true;
    options.mesh_error = 0;
    this->expect_within(awkward_volume<TypeParam>(kind, dims, 3), dims, options, 0);
  }
}

TYPED_TEST(EverySampleType, SameBytesForAnyThreadCount) {
  const Index3 dims{30, 21, 40};
  for (const bool grid : {false, true}) {
    write_nrrd(this->in_, dims, awkward_volume<TypeParam>(Awkward::not_finite_blobs, dims, 4));
    EncodeOptions options = small_options<TypeParam>();
    options.grid_only = grid;
    options.max_error = 2;
    encode_volume(this->in_, {}, this->tag_, true, options, Resources(1));
    const std::string once = file_content(this->tag_);
    for (const int threads : {2, 5}) {
      encode_volume(this->in_, {}, this->tag_, true, options, Resources(threads));
      EXPECT_EQ(file_content(this->tag_), once);
    }
  }
}

// Very small files: every bit and every length of them.
TYPED_TEST(EverySampleType, EveryFlippedBitAndEveryTruncationIsFound) {
  const Index3 dims{6, 5, 3};
  for (const bool grid : {false, true}) {
    write_nrrd(this->in_, dims, awkward_volume<TypeParam>(Awkward::not_finite_blobs, dims, 5));
    EncodeOptions options = small_options<TypeParam>();
    options.grid_only = grid;
    options.max_error = 10;
    encode_volume(this->in_, {}, this->tag_, true, options, Resources(1));
    const std::string whole = file_content(this->tag_);
    const auto expect_broken = [&](const std::string& content, std::size_t at) {
      write_content(this->path("b.tag"), content);
      EXPECT_THROW(
          decode_volume(this->path("b.tag"), this->path("o.raw"), format_named("raw"), true, Resources(1)),
          BrokenInput)
          << at;
      EXPECT_FALSE(std::filesystem::exists(this->path("o.raw"))) << at;
    };
    for (std::size_t bit = 0; bit < 8 * whole.size(); bit += damage_stride) {
      std::string damaged = whole;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
      expect_broken(damaged, bit / 8);
    }
    for (std::size_t i = 0; i < whole.size(); ++i) expect_broken(whole.substr(0, i), i);
    std::cout << 8 * whole.size() / damage_stride << " flipped bits, " << whole.size() << " truncations\n";
  }
}

}  // namespace
}  // namespace tagrid
