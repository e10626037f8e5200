// Whole runs: volume to file and back.

#include <gtest/gtest.h>

#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "pipeline/encode/graph.h"
#include "tests/support/graph_ends.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class Run : public TemporaryFolder {
 protected:
  template <class T>
  void make(Index3 dims, unsigned seed) {
    samples_ = blobs<T>(dims, seed);
    write_nrrd(in_, dims, std::get<std::vector<T>>(samples_));
  }
  EncodeResult encode(const EncodeOptions& options, int threads = 2) {
    return encode_volume(in_, {}, tag_, true, options, Resources(threads));
  }
  template <class T>
  std::vector<T> decode(int threads = 2) {
    decode_volume(tag_, out_, format_named("nrrd"), true, Resources(threads));
    return read_samples<T>(out_);
  }
  template <class T>
  double largest_error(const std::vector<T>& decoded) const {
    const auto& original = std::get<std::vector<T>>(samples_);
    EXPECT_EQ(original.size(), decoded.size());
    double worst = 0;
    for (std::size_t i = 0; i < decoded.size(); ++i)
      worst = std::max(worst, std::abs(double(original[i]) - double(decoded[i])));
    return worst;
  }

  const std::string in_ = path("in.nrrd"), tag_ = path("a.tag"), out_ = path("out.nrrd");
  std::variant<std::vector<std::uint8_t>, std::vector<std::int8_t>, std::vector<std::uint16_t>,
               std::vector<std::int16_t>, std::vector<std::uint32_t>, std::vector<std::int32_t>,
               std::vector<float>, std::vector<double>>
      samples_;
};

const Index3 awkward[] = {{1, 1, 1},    {1, 1, 40},  {37, 1, 1},  {1, 29, 31},
                          {17, 17, 17}, {33, 20, 9}, {64, 5, 66}, {65, 34, 33}};

template <class T>
class EveryType : public Run {};
TYPED_TEST_SUITE(EveryType, AllTypes);

TYPED_TEST(EveryType, EveryVoxelWithinTheBoundInEveryMode) {
  for (const Index3 dims : awkward)
    for (const double bound : sanitized ? std::vector{0.0, 7.0} : std::vector{0.0, 1.0, 2.0, 7.0, 40.0})
      for (const bool grid : {false, true})
        for (const int cube : {4, 16}) {
          this->template make<TypeParam>(dims, 2);
          EncodeOptions options{.grid_only = grid, .max_error = bound, .cube_size = cube};
          const EncodeResult result = this->encode(options);
          const double error = this->template largest_error<TypeParam>(this->template decode<TypeParam>());
          EXPECT_LE(error, bound);
          EXPECT_EQ(error, result.index.total.max_error) << "the recorded error is not the one reached";
          EXPECT_EQ(verify_file(this->tag_, this->in_, {}, Resources(2)).max_error, error);
        }
}

TEST_F(Run, ActiveVoxelsKeepTheTighterBound) {
  make<std::int16_t>({50, 41, 37}, 3);
  EncodeOptions options{.max_error = 20, .surface_error = 1, .cube_size = 16, .range = {{0, 120}}};
  encode(options);
  const VerifyResult result = verify_file(tag_, in_, {}, Resources(2));
  EXPECT_GT(*result.max_error, 1) << "no voxel uses the looser bound: nothing is tested";
  EXPECT_LE(*result.max_error, 20);
}

TEST_F(Run, SameBytesForAnyThreadCount) {
  make<std::int16_t>({70, 67, 75}, 4);
  for (const bool grid : {false, true}) {
    EncodeOptions options{.grid_only = grid, .max_error = 3, .cube_size = 8, .brick_edge = 2};
    encode(options, 1);
    const std::string once = file_content(tag_);
    for (const int threads : sanitized ? std::vector{7} : std::vector{1, 2, 3, 7}) {
      encode(options, threads);
      EXPECT_EQ(file_content(tag_), once);
      decode<std::int16_t>(threads);
    }
  }
}

TEST_F(Run, AGridAloneHasMorePointsThanTheCornersOfItsRootCubes) {
  make<std::uint8_t>({40, 33, 20}, 5);
  EncodeOptions options{.grid_only = true, .cube_size = 8};
  encode(options);
  const VerifyResult result = verify_file(tag_, in_, {}, Resources(1));
  EXPECT_GT(result.active_points, static_cast<std::uint64_t>(points_up_to_level({{40, 33, 20}, 8})[0]));
}

// Encodes 20 x 20 x 100 samples of these slices into this sink.
void encode_small(SliceSource&& slices, const std::function<void(const BrickBytes&)>& take) {
  const CodingParameters parameters{.dims = {20, 20, 100}, .cube_size = 8, .max_level = 9, .field_scale = 1};
  BricksInto sink([&](const BrickBytes& brick, const Statistics&) { take(brick); });
  Watch unwatched;
  encode(job_of(parameters, 2), BrickRows::all(parameters.bricks()), slices, sink, unwatched);
}

TEST(FailingRun, AReaderOrAWriterThatFailsEndsItWithItsError) {
  int read = 0;
  const auto reader_fails = [&](const Box&) -> SliceSamples {
    if (++read == 60) throw WorldError("the disk is gone");
    return std::make_shared<std::byte[]>(400);
  };
  EXPECT_THROW(encode_small(SlicesFrom(reader_fails), [](const BrickBytes&) {}), WorldError);
  const auto writer_fails = [](const BrickBytes& brick) {
    if (brick.id == 3) throw WorldError("the disk is full");
  };
  EXPECT_THROW(
      encode_small(SlicesFrom([](const Box&) -> SliceSamples { return std::make_shared<std::byte[]>(400); }),
                   writer_fails),
      WorldError);
}

// A source that waits for samples is stopped, and what it throws is not what the caller sees.
TEST(FailingRun, AWriterThatFailsStopsASourceThatWaits) {
  struct Waiting : SliceSource {
    SliceSamples read(const Box&) override {
      if (++slices == 60) {
        stopped.wait(false);
        throw WorldError("its samples are no longer needed");
      }
      return std::make_shared<std::byte[]>(400);
    }
    void stop() override {
      stopped = true;
      stopped.notify_all();
    }
    int slices = 0;
    std::atomic<bool> stopped = false;
  };
  const auto writer_fails = [](const BrickBytes& brick) {
    if (brick.id == 0) throw WorldError("the disk is full");
  };
  EXPECT_EQ(message_of<WorldError>([&] { encode_small(Waiting(), writer_fails); }), "the disk is full");
}

TEST_F(Run, MetadataComesBackAsItWentIn) {
  const std::vector<std::uint8_t> samples(2 * 3 * 4, 7);
  const std::string of_space =
      "content: a thing\nspace: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,2)\n"
      "space origin: (1,2,3)\nspace units: \"mm\" \"mm\" \"mm\"\nkey one:=value, with = signs\n# a comment\n";
  const std::string of_axes = "spacings: 0.1 NaN 2.5\nunits: \"mm\" \"mm\" \"um\"\n";
  for (const std::string& fields : {of_space, of_axes}) {
    write_nrrd(in_, {2, 3, 4}, samples, fields);
    encode({});
    decode<std::uint8_t>();
    EXPECT_EQ(text_of(open_volume(out_)->info().metadata), fields);
    EXPECT_NE(content("out.nrrd").find(fields), std::string::npos) << fields;
  }
}

}  // namespace
}  // namespace tagrid
