// Golden files: this version writes the same bytes as 1.0, and reads them. Those of tests/golden/1.0 are frozen; see
// CONTRIBUTING.md, "Changes of the format". To write new ones:
//   TAGRID_UPDATE_GOLDEN=1 build/release/tests/pipeline_tests --gtest_filter='*Golden*'
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "io/metadata/text.h"
#include "stages/phantom/phantom.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

/// What stands in place of a sample of the phantom.
using Instead = double (*)(Index3 place, double sample);

struct Golden {
  const char* name;
  SampleType type;
  EncodeOptions options = {};
  Instead instead = nullptr;
  int volumes = 1;
  Index3 dims = {};  ///< if not those of its kind; see dims_of()
};

// Values that are few, each in another way; see stages/values/few.
double multiple_of_three(Index3, double sample) { return 7 + 3 * std::floor(std::abs(sample) / 16); }
double part_of_255(Index3, double sample) { return std::floor(std::abs(sample) / 16) / 255; }
double label_of_block(Index3 p, double) {
  return static_cast<double>(1000 + 37 * (p.x / 9 * 11 + p.y / 5 * 3 + p.z / 4));
}

double nothing(Index3, double) { return 0; }
// Infinities, NaN and zeros of both signs, in regions and alone.
double special_at_places(Index3 p, double sample) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr std::array<double, 5> special = {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity,
                                             -0.0, 0.0};
  const auto place = static_cast<std::size_t>(p.x / 3 + p.y / 2 * 2 + p.z / 3 * 3);
  return place % 4 == 1 || (p.x * 5 + p.y * 3 + p.z) % 23 == 0 ? special[place % special.size()] : sample;
}

std::vector<Golden> all_golden() {
  constexpr std::pair wide_range = {-1024.0, 3072.0};
  return {
      {"voxels_lossless_int16", SampleType::int16, {.cube_size = 16, .brick_edge = 2, .lead = 0}},
      {"voxels_bounded_int16",
       SampleType::int16,
       {.max_error = 8, .cube_size = 16, .brick_edge = 2, .lead = 0}},
      {"voxels_two_bounds_uint8",
       SampleType::uint8,
       {.max_error = 6, .surface_error = 1, .cube_size = 8, .brick_edge = 2, .lead = 0}},
      {"grid_exact_uint8",
       SampleType::uint8,
       {.grid_only = true, .cube_size = 16, .brick_edge = 2, .lead = 0}},
      {"grid_bounded_uint16",
       SampleType::uint16,
       {.grid_only = true, .max_error = 40, .cube_size = 8, .brick_edge = 2, .lead = 0}},
      {"grid_limited_int8",
       SampleType::int8,
       {.grid_only = true, .cube_size = 32, .max_level = 9, .brick_edge = 2, .lead = 0}},
      {"voxels_lossless_uint32",
       SampleType::uint32,
       {.cube_size = 8, .brick_edge = 2, .lead = 0, .range = wide_range}},
      {"voxels_bounded_int32",
       SampleType::int32,
       {.max_error = 8, .cube_size = 16, .brick_edge = 2, .lead = 0, .range = wide_range}},
      {"voxels_lossless_float32",
       SampleType::float32,
       {.cube_size = 16, .brick_edge = 2, .lead = 0, .range = wide_range}},
      {"voxels_two_bounds_float64",
       SampleType::float64,
       {.max_error = 6.5,
        .surface_error = 0,
        .cube_size = 8,
        .brick_edge = 2,
        .lead = 0,
        .range = wide_range}},
      {"grid_exact_float32",
       SampleType::float32,
       {.grid_only = true, .cube_size = 16, .brick_edge = 2, .lead = 0, .range = wide_range}},
      {"grid_bounded_float64",
       SampleType::float64,
       {.grid_only = true, .max_error = 40, .cube_size = 8, .brick_edge = 2, .lead = 0, .range = wide_range}},
      {"grid_bounded_int32",
       SampleType::int32,
       {.grid_only = true, .max_error = 40, .cube_size = 8, .brick_edge = 2, .lead = 0, .range = wide_range}},
      {"voxels_lossless_fast_uint8",
       SampleType::uint8,
       {.cube_size = 16, .brick_edge = 2, .lead = 0, .effort = Effort::fast}},
      {"voxels_bounded_fast_int16",
       SampleType::int16,
       {.max_error = 8, .cube_size = 16, .brick_edge = 2, .lead = 0, .effort = Effort::fast}},
      {"voxels_lossless_best_int16",
       SampleType::int16,
       {.cube_size = 16, .brick_edge = 2, .lead = 0, .effort = Effort::best}},
      {"voxels_bounded_best_uint16",
       SampleType::uint16,
       {.max_error = 8, .cube_size = 16, .brick_edge = 2, .lead = 0, .effort = Effort::best}},
      {"voxels_two_bounds_best_int8",
       SampleType::int8,
       {.max_error = 6,
        .surface_error = 1,
        .cube_size = 8,
        .brick_edge = 2,
        .lead = 0,
        .effort = Effort::best}},
      {"voxels_derived_grid_int16",
       SampleType::int16,
       {.grid = GridOrigin::derived, .max_error = 8, .cube_size = 8, .brick_edge = 2, .lead = 0}},
      {"lead_voxels_bounded_int16", SampleType::int16, {.max_error = 8, .cube_size = 16, .brick_edge = 2}},
      {"lead_voxels_two_bounds_uint8",
       SampleType::uint8,
       {.max_error = 6, .surface_error = 1, .cube_size = 8, .brick_edge = 2}},
      {"lead_grid_bounded_mesh_uint16",
       SampleType::uint16,
       {.grid_only = true, .max_error = 40, .mesh_error = 60, .cube_size = 8, .brick_edge = 2}},
      {"lead_voxels_derived_grid_float32",
       SampleType::float32,
       {.grid = GridOrigin::derived, .max_error = 6.5, .cube_size = 8, .brick_edge = 2, .range = wide_range}},
      {"lead_voxels_overviews_int16",
       SampleType::int16,
       {.max_error = 8, .cube_size = 16, .brick_edge = 2, .overviews = std::vector{4, 16}}},
      {"few_affine_uint16", SampleType::uint16, {.cube_size = 64, .brick_edge = 2}, multiple_of_three},
      {"few_table_float32", SampleType::float32, {.cube_size = 64, .brick_edge = 2}, part_of_255},
      {"few_labels_uint16", SampleType::uint16, {.cube_size = 64, .brick_edge = 2}, label_of_block},
      {"volumes_bounded_int16",
       SampleType::int16,
       {.max_error = 8, .cube_size = 8, .brick_edge = 2, .overviews = std::vector{4}},
       nullptr,
       3},
      // Some samples are corrected.
      {"transformed_int16",
       SampleType::int16,
       {.max_error = 100,
        .error_rule = ErrorRule{ErrorRule::Kind::psnr, 40},
        .cube_size = 16,
        .brick_edge = 2}},
      {"transformed_float32",
       SampleType::float32,
       {.error_rule = ErrorRule{ErrorRule::Kind::bits, 1}, .cube_size = 16, .brick_edge = 1}},
      // A filter of values with 6 bits after the point.
      {"thresholds_int16",
       SampleType::int16,
       {.max_error = 60, .thresholds = {-20, 300.5}, .cube_size = 16, .brick_edge = 2}},
      {"thresholds_float32",
       SampleType::float32,
       {.error_rule = ErrorRule{ErrorRule::Kind::psnr, 35},
        .thresholds = {0.1},
        .cube_size = 8,
        .range = wide_range}},
      {"filtered_uint8",
       SampleType::uint8,
       {.error_rule = ErrorRule{ErrorRule::Kind::psnr, 36}, .cube_size = 16, .brick_edge = 2}},
      {"parity_bounded_int16", SampleType::int16, {.max_error = 8, .cube_size = 16, .parity = 5000}},
      {"special_bounded_float32",
       SampleType::float32,
       {.max_error = 2.5, .cube_size = 8, .range = wide_range},
       special_at_places},
      {"special_grid_float64",
       SampleType::float64,
       {.grid_only = true, .max_error = 20, .cube_size = 8, .range = wide_range},
       special_at_places},
      // Rows of several segments; the last one is short.
      {"long_rows_bounded_uint8",
       SampleType::uint8,
       {.max_error = 2, .brick_edge = 5},
       nullptr,
       1,
       {150, 9, 12}},
      // More than 4096 bricks.
      {"pages_lossless_uint8",
       SampleType::uint8,
       {.cube_size = 4, .brick_edge = 1},
       nothing,
       1,
       {67, 63, 63}},
  };
}

// Wide samples take more bytes: their volumes are smaller. Values that are few take hardly any: rows are long.
Index3 dims_of(const Golden& golden) {
  if (golden.dims != Index3{}) return golden.dims;
  if (golden.instead && golden.options.cube_size == 64) return {75, 22, 19};
  if (golden.volumes > 1) return {19, 18, 11};
  return is_wide_type(golden.type) ? Index3{19, 18, 21} : Index3{41, 35, 38};
}

class GoldenFiles : public TemporaryFolder, public testing::WithParamInterface<std::size_t> {
 protected:
  Golden golden_ = all_golden()[GetParam()];
  std::string golden_path() const {
    return std::string(TAGRID_SOURCE_DIR "/tests/golden/1.0/") + golden_.name + ".tag";
  }

  std::string source() const { return path(golden_.volumes == 1 ? "in.nrrd" : "in.nii"); }
  SourceDescription description() const {
    SourceDescription all;
    all.all_volumes = true;
    return all;
  }

  void make_volume() const {
    const Index3 dims = dims_of(golden_);
    with_sample_type(golden_.type, [&](auto type) {
      using T = decltype(type);
      const std::int64_t slices = dims.z * golden_.volumes;
      const std::size_t slice = static_cast<std::size_t>(dims.x * dims.y);
      std::vector<T> samples(static_cast<std::size_t>(slices) * slice);
      for (std::int64_t z = 0; z < slices; ++z)
        phantom_slice<T>(dims, static_cast<std::uint64_t>(1 + z / dims.z), z % dims.z,
                         std::span<T>(samples).subspan(static_cast<std::size_t>(z) * slice, slice));
      if (golden_.instead)
        for (const auto [x, y, z] : points_of(dims)) {
          T& sample = samples[static_cast<std::size_t>(Box::of_size(dims).offset({x, y, z}))];
          sample = static_cast<T>(golden_.instead({x, y, z}, static_cast<double>(sample)));
        }
      if (golden_.volumes == 1) return write_nrrd(source(), dims, samples, "content: golden\n");
      VolumeInfo info{{dims.x, dims.y, slices}, golden_.type};
      info.volumes = golden_.volumes;
      const auto writer =
          create_volume(format_named("nifti"), source(), info, {.files = {.overwrite = true}});
      writer->write_slices(std::as_bytes(std::span(samples)));
      writer->commit();
    });
  }
};

TEST_P(GoldenFiles, AreWrittenByteForByte) {
  make_volume();
  encode_volume(source(), description(), path("a.tag"), true, golden_.options, Resources(2));
  if (std::getenv("TAGRID_UPDATE_GOLDEN")) write_content(golden_path(), file_content(path("a.tag")));
  EXPECT_TRUE(file_content(path("a.tag")) == file_content(golden_path()))
      << golden_path() << " is no longer what is written";
}

TEST_P(GoldenFiles, AreReadWithinTheirBound) {
  make_volume();
  const VerifyResult result = verify_file(golden_path(), source(), {}, Resources(2));
  if (result.header.parameters.max_error >= 0) {
    EXPECT_LE(*result.max_error, result.header.parameters.max_error);
  }
  EXPECT_EQ(result.header.volumes, golden_.volumes);
  if (golden_.volumes > 1) return;
  decode_volume(golden_path(), path("out.nrrd"), format_named("nrrd"), true, Resources(2));
  const CodingParameters& parameters = result.header.parameters;
  const bool is_lossless = parameters.mode == FileMode::voxels && parameters.max_error == 0;
  EXPECT_THAT(text_of(open_volume(path("out.nrrd"))->info().metadata),
              testing::MatchesRegex(is_lossless ? "content: golden\n"
                                                : "content: golden\nlossy source:=tagrid, [^\n]*\n"));
}

INSTANTIATE_TEST_SUITE_P(All, GoldenFiles, testing::Range(std::size_t{0}, all_golden().size()),
                         [](const auto& test) { return std::string(all_golden()[test.param].name); });

}  // namespace
}  // namespace tagrid
