// Rows of bricks make the same volume whether they are written to their position or through a temporary file.
#include "pipeline/decode/decode_run.h"

#include <gtest/gtest.h>

#include "tests/support/rows_of_volume.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class RowOutputTest : public TemporaryFolder {
 protected:
  RowOutputTest() : samples_(blobs<std::int16_t>(dims_, 1)) {
    parameters_.dims = dims_;
    parameters_.type = SampleType::int16;
    parameters_.cube_size = 4;
    parameters_.brick_edge = 2;
  }

  /// The samples of a file, written `together` rows at a time.
  std::string written(std::int64_t together, const std::string& spool) const {
    const auto writer = create_volume(format_named("raw"), path("out.raw"), {dims_, SampleType::int16},
                                      {.files = {.overwrite = true}});
    RowOutput output(*writer, spool, "out.raw");
    for_each_rows<std::int16_t>(parameters_, BrickRows::all(parameters_.bricks()), together, samples_,
                                [&](const DecodedRows& rows) { output.write(rows); });
    writer->commit();
    return content("out.raw");
  }

  static constexpr Index3 dims_{21, 30, 19};
  std::vector<std::int16_t> samples_;
  CodingParameters parameters_;
};

TEST_F(RowOutputTest, AnyNumberOfRowsAtATimeMakesTheVolumeAtItsPlaceAndThroughATemporary) {
  const std::string expected(reinterpret_cast<const char*>(samples_.data()),
                             samples_.size() * sizeof(std::int16_t));
  for (const std::int64_t together : {1, 2, 3, 100}) {
    EXPECT_TRUE(written(together, "") == expected) << together;
    EXPECT_TRUE(written(together, folder_.string()) == expected) << together;
  }
  EXPECT_EQ(names(), std::vector<std::string>{"out.raw"}) << "the temporary has no name";
}

}  // namespace
}  // namespace tagrid
