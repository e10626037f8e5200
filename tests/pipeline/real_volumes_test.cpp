// Real volumes, if they are present: every bound is checked against the raw samples, and the size of every
// file is compared with that of the best other compressor at the same largest error.
//
// The sizes of the others (bits per voxel; JPEG XL -e7 for E = 0, else the best of JPEG-LS near, SZ3, SPERR,
// zfp) were measured once on the same volumes; integers of float codecs were rounded after decoding.
//
// These tests take minutes. With TAGRID_LONG=1 they have every bound and every effort; without, the bounds that
// take different ways through the program, the usual effort, and one mode of the largest volume.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>

#include "io/tag/bricks.h"
#include "pipeline/grid/schedule.h"
#include "stages/brick/codec.h"
#include "stages/mesh/mesh_error.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct Volume {
  const char* name;
  Index3 dims;
  SampleType type;
};

const Volume volumes[] = {{"lobster", {301, 324, 56}, SampleType::uint8},
                          {"lobster_321x321x33", {321, 321, 33}, SampleType::uint8},
                          {"engine", {256, 256, 128}, SampleType::uint8},
                          {"ge_ct_head_varz", {512, 512, 28}, SampleType::int16},
                          {"foot_161x321x129", {161, 321, 129}, SampleType::int16},
                          {"itk_legacy_mf_mr", {256, 256, 128}, SampleType::uint16},
                          {"vhf_ankle", {512, 512, 150}, SampleType::int16}};

void PrintTo(const Volume& volume, std::ostream* out) { *out << volume.name; }

/// The fewest bits a voxel of any other codec, by the largest error.
struct Peer {
  const char* volume;
  std::vector<std::pair<double, double>> best_bits;
};

const Peer peers[] = {
    {"engine", {{0, 1.7676}, {1, 0.9503}, {2, 0.5952}, {4, 0.3346}, {8, 0.1843}}},
    {"ge_ct_head_varz", {{0, 2.6915}, {2, 1.8039}, {5, 1.2732}, {10, 0.9225}, {20, 0.6229}, {50, 0.3573}}},
    {"itk_legacy_mf_mr", {{0, 5.4932}, {2, 3.3863}, {5, 2.3730}, {10, 1.4694}, {20, 0.9487}, {50, 0.4926}}},
    {"lobster", {{0, 1.8966}, {1, 0.9227}, {2, 0.5905}, {4, 0.3431}, {8, 0.1895}}},
    {"vhf_ankle", {{0, 2.1313}, {2, 1.2573}, {5, 0.8581}, {10, 0.5216}, {20, 0.2705}, {50, 0.1140}}}};

std::string raw_path(const Volume& volume) {
  return std::string(TAGRID_SOURCE_DIR "/../shared/data/") + volume.name + ".raw";
}

bool is_present(const Volume& volume) { return std::filesystem::exists(raw_path(volume)); }

bool all_of_them() { return std::getenv("TAGRID_LONG"); }

class RealVolumes : public TemporaryFolder, public testing::WithParamInterface<Volume> {
 protected:
  void SetUp() override {
    if (!is_present(GetParam())) GTEST_SKIP() << raw_path(GetParam()) << " is not there";
  }
  bool is_small() const {
    return all_of_them() || Box::of_size(GetParam().dims).count() <= std::int64_t{1} << 22;
  }

  EncodeResult encode(const Volume& volume, double max_error, bool grid_only) {
    EncodeOptions options{.grid_only = grid_only, .max_error = max_error};
    return encode_volume(raw_path(volume),
                         SourceDescription(RawDescription{volume.dims, volume.type, false, 0}), path("a.tag"),
                         true, options, Resources(available_threads()));
  }
  // Compares the two files byte by byte, without the reader or verify.
  template <class T>
  double largest_error(const Volume& volume) const {
    const std::string original = file_content(raw_path(volume)), decoded = file_content(path("a.raw"));
    EXPECT_EQ(original.size(), decoded.size());
    const auto* a = reinterpret_cast<const T*>(original.data());
    const auto* b = reinterpret_cast<const T*>(decoded.data());
    double worst = 0;
    for (std::size_t i = 0; i < original.size() / sizeof(T); ++i)
      worst = std::max(worst, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
    return worst;
  }
};

TEST_P(RealVolumes, EveryVoxelWithinTheBoundAndLosslessIdentical) {
  const Volume& volume = GetParam();
  const bool large = Box::of_size(volume.dims).count() > std::int64_t{1} << 24;
  const std::vector<double> bounds = all_of_them() ? std::vector<double>{0, 1, 2, 5, 20, 50}
                                     : large       ? std::vector<double>{5}
                                                   : std::vector<double>{0, 5};
  for (const double bound : bounds)
    for (const bool grid_only : {false, true}) {
      if (grid_only && large && !all_of_them()) continue;
      const EncodeResult result = encode(volume, bound, grid_only);
      decode_volume(path("a.tag"), path("a.raw"), format_named("raw"), true, Resources(available_threads()));
      const double error =
          with_sample_type(volume.type, [&](auto type) { return largest_error<decltype(type)>(volume); });
      EXPECT_LE(error, bound) << (grid_only ? "grid" : "voxels");
      EXPECT_EQ(error, result.index.total.max_error);
    }
}

// A volume in memory, as the slices of a file.
SliceRange slices_in(const std::string& bytes, const Index3& dims, std::size_t size) {
  std::vector<SliceSamples> slices;
  const std::size_t slice = static_cast<std::size_t>(dims.x * dims.y) * size;
  for (std::size_t z = 0; z < static_cast<std::size_t>(dims.z); ++z) {
    const std::shared_ptr<std::byte[]> samples(new std::byte[slice]);
    std::memcpy(samples.get(), bytes.data() + z * slice, slice);
    slices.push_back(samples);
  }
  return {0, 0, std::make_shared<const std::vector<SliceSamples>>(std::move(slices))};
}

// A grid that is stored is that of the original, whatever the bound; a lossless file has the numbers of its points alone.
TEST_P(RealVolumes, ALosslessFileHasTheGridThatALossyOneStores) {
  const Volume& volume = GetParam();
  if (!is_small()) GTEST_SKIP() << "TAGRID_LONG is not set, so only small volumes are measured";
  encode(volume, 2, false);
  const TagSummary lossy = summary_of(path("a.tag"));
  encode(volume, 0, false);
  const VerifyResult lossless = verify_file(path("a.tag"), std::nullopt, {}, Resources(available_threads()));
  EXPECT_EQ(lossless.header.parameters.grid, GridOrigin::implied);
  EXPECT_EQ(lossless.index.total.active, lossy.index.total.active);
  EXPECT_EQ(lossless.active_points, std::accumulate(lossy.index.total.active.begin(),
                                                    lossy.index.total.active.end(), std::uint64_t{0}));
}

// The vertices of the grid of decoded samples, and the largest error of its mesh, against those of the stored grid.
TEST_P(RealVolumes, ADerivedGridIsCloseToTheStoredOne) {
  const Volume& volume = GetParam();
  if (!is_small()) GTEST_SKIP() << "TAGRID_LONG is not set, so only small volumes are measured";
  SliceRange original = slices_in(file_content(raw_path(volume)), volume.dims, size_of(volume.type));
  for (const double bound : {2.0, 8.0}) {
    encode(volume, bound, false);
    const TagBricks stored(std::make_shared<FileSource>(path("a.tag")));
    const CodingParameters& p = stored.parameters();
    decode_volume(path("a.tag"), path("a.raw"), format_named("raw"), true, Resources(available_threads()));
    SliceRange decoded = slices_in(file_content(path("a.raw")), volume.dims, size_of(volume.type));
    const Box all = p.domain().volume();
    for (SliceRange* slices : {&original, &decoded}) {
      slices->first = all.low.z;
      slices->first_row = all.low.y;
    }
    struct Grid {
      Statistics counted;
      double mesh_error = 0;
    } of_original, of_decoded;
    const auto add = [&](Grid& grid, Index3 brick, const LatticeBits& active) {
      const Box box = p.bricks().closed_box(brick);
      count_active(active, p, brick, grid.counted);
      const double error = measure_mesh(gather(original, all, p.type, box),
                                        gather(decoded, all, p.type, box).bytes, active, p, brick);
      grid.mesh_error = std::max(grid.mesh_error, error);
    };
    for (std::int64_t id = 0; id < stored.count(); ++id) {
      const BrickBytes brick = stored.read(id);
      DecodedBrick whole;
      ASSERT_TRUE(decode_brick({brick.activity, brick.values}, p, {id}, whole).ok());
      add(of_original, p.bricks().position(id), whole.active);
    }
    DerivedGrid derived(p, BrickRows::all(p.bricks()),
                        [&](const SubdividedBrick& brick) { add(of_decoded, brick.brick, brick.active); });
    for (const SliceSamples& slice : *decoded.slices) derived.add_slice(slice);
    const auto points = [](const Grid& grid) {
      return static_cast<double>(
          std::accumulate(grid.counted.active.begin(), grid.counted.active.end(), std::uint64_t{0}));
    };
    std::printf(
        "%-18s E %2.0f: %9.0f points of the original, %+.2f %% of the decoded; errors %.1f and %.1f\n",
        volume.name, bound, points(of_original), 100 * (points(of_decoded) / points(of_original) - 1),
        of_original.mesh_error, of_decoded.mesh_error);
    EXPECT_LE(points(of_decoded), 1.5 * points(of_original));
    EXPECT_GE(points(of_decoded), 0.8 * points(of_original));
    EXPECT_LE(of_decoded.mesh_error, 1.1 * of_original.mesh_error + bound);
  }
}

INSTANTIATE_TEST_SUITE_P(All, RealVolumes, testing::ValuesIn(volumes),
                         [](const auto& test) { return std::string(test.param.name); });

// The claims about an effort: ratios to the best other coder, for every row and as the geometric mean.
struct Claim {
  Effort effort;
  double lossless_row, lossless_mean, bounded_row, bounded_mean;
};

void PrintTo(const Claim& claim, std::ostream* out) { *out << name_of(claim.effort); }

class RealRates : public TemporaryFolder, public testing::WithParamInterface<Claim> {
 protected:
  double bits_a_voxel(const Volume& volume, double max_error) const {
    EncodeOptions options{.max_error = max_error, .effort = GetParam().effort};
    const EncodeResult result =
        encode_volume(raw_path(volume), SourceDescription(RawDescription{volume.dims, volume.type, false, 0}),
                      path("a.tag"), true, options, Resources(available_threads()));
    return 8.0 * static_cast<double>(result.file_bytes) /
           static_cast<double>(Box::of_size(volume.dims).count());
  }
};

TEST_P(RealRates, FilesAreSmallerThanThoseOfOthersAtTheSameLargestError) {
  const Claim& claim = GetParam();
  if (claim.effort != Effort::normal && !all_of_them())
    GTEST_SKIP() << "TAGRID_LONG is not set, so only the usual effort is measured";
  struct Mean {
    double logs = 0;
    int rows = 0;
    double value() const { return std::exp(logs / rows); }
  } lossless, bounded;
  for (const Volume& volume : volumes) {
    if (!is_present(volume)) GTEST_SKIP() << raw_path(volume) << " is not there";
    for (const Peer& peer : peers) {
      if (std::string(peer.volume) != volume.name) continue;
      for (const auto& [max_error, best_bits] : peer.best_bits) {
        const double bits = bits_a_voxel(volume, max_error), ratio = bits / best_bits;
        std::printf("%-18s E %2.0f: %.4f bits per voxel, best other %.4f, ratio %.3f\n", peer.volume,
                    max_error, bits, best_bits, ratio);
        const bool exact = max_error == 0;
        EXPECT_LE(ratio, exact ? claim.lossless_row : claim.bounded_row)
            << peer.volume << " at " << max_error;
        Mean& mean = exact ? lossless : bounded;
        mean.logs += std::log(ratio);
        ++mean.rows;
      }
    }
  }
  std::printf("geometric means: %.3f of %d rows for E = 0, %.3f of %d for E > 0\n", lossless.value(),
              lossless.rows, bounded.value(), bounded.rows);
  EXPECT_LE(lossless.value(), claim.lossless_mean);
  EXPECT_LE(bounded.value(), claim.bounded_mean);
}

INSTANTIATE_TEST_SUITE_P(All, RealRates,
                         testing::Values(Claim{Effort::fast, 1.12, 0.92, 0.96, 0.81},
                                         Claim{Effort::normal, 1.10, 0.90, 0.93, 0.76},
                                         Claim{Effort::best, 0.99, 0.83, 0.91, 0.67}),
                         [](const auto& test) { return std::string(name_of(test.param.effort)); });

}  // namespace
}  // namespace tagrid
