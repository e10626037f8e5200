// The words of a preview.
#include "tools/preview/captions.h"
#include "io/metadata/text.h"

#include <fmt/format.h>

#include "io/files/open_source.h"
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

TEST(Captions, ASliceAtItsOwnDistanceIsSaidToLieThere) {
  TagHeader header;
  header.parameters.dims = {8, 8, 4};
  header.metadata = parse_metadata(
      "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1.25)\nspace units: \"mm\" \"mm\" \"um\"\n"
      "slice_positions:=0 0 5; 0 0 6.25; 0 0 7.5; 0 0 11.75\n");
  const Lengths lengths = lengths_of(header);
  // In one unit, that of the first axis.
  EXPECT_DOUBLE_EQ(lengths.distance(2, 2), 2.5e-3);
  EXPECT_DOUBLE_EQ(lengths.distance(2, 3), 6.75e-3);
  EXPECT_DOUBLE_EQ(lengths.distance(0, 3), 3);
  // Without a position of each slice, all distances are equal.
  header.parameters.dims.z = 5;
  EXPECT_DOUBLE_EQ(lengths_of(header).distance(2, 4), 5e-3);
}

class CaptionsOfFiles : public CommandLine {
 protected:
  static constexpr int nx = 24, ny = 20, nz = 3;

  /// Samples of int16 from 0 to 1999, in no order.
  static std::string noise(int samples) {
    std::string bytes;
    unsigned state = 1;
    for (int i = 0; i < samples; ++i) {
      state = state * 1664525U + 1013904223U;
      const unsigned sample = (state >> 16) % 2000;
      bytes += {static_cast<char>(sample & 0xFF), static_cast<char>(sample >> 8)};
    }
    return bytes;
  }
  std::vector<std::string> lines(const std::string& name, std::int64_t number = 0) const {
    const auto file = std::make_shared<const TagBricks>(open_source(path(name)));
    return lines_about(*file, number, *volume_in(file, number));
  }
};

TEST_F(CaptionsOfFiles, WithSlopesOfSlicesErrorsAreInStoredSamplesAndTheLargestAlsoInValues) {
  file("pet.nrrd",
       fmt::format("NRRD0004\ntype: int16\ndimension: 3\nsizes: {} {} {}\nencoding: raw\nendian: little\n"
                   "slice_slopes:=1 4.857 2\nslice_intercepts:=0 0 0\n\n",
                   nx, ny, nz) +
           noise(nx * ny * nz));
  ASSERT_EQ(tagrid({"encode", "pet.nrrd", "--max-error", "50", "-q"}).code, 0);
  const std::vector<std::string> found = lines("pet.tag");
  ASSERT_EQ(found.size(), 2U);
  // 10 samples are 48.57 in the second slice.
  EXPECT_TRUE(
      found[1].starts_with("every voxel within 10 in stored samples, "
                           "largest error 10 in stored samples (at most 48.57 in values), PSNR "))
      << found[1];
  EXPECT_TRUE(has(found[0], "; 2.88 kB in ")) << found[0];
  EXPECT_TRUE(has(tagrid({"info", "pet.tag"}).out,
                  "bound 10, reached 10 in stored samples (at most 48.57 in values)\n"));
}

TEST_F(CaptionsOfFiles, OneOfSeveralVolumesHasItsNumberAndTheRatioOfAll) {
  file("scan.mha",
       fmt::format("ObjectType = Image\nNDims = 4\nDimSize = {} {} {} 3\nElementSpacing = 1 1 2 1\n"
                   "ElementType = MET_SHORT\nElementByteOrderMSB = False\nElementDataFile = LOCAL\n",
                   nx, ny, nz) +
           std::string(std::size_t{2} * nx * ny * nz, '\0') + noise(2 * nx * ny * nz));
  ASSERT_EQ(tagrid({"encode", "scan.mha", "--max-error", "20", "-q"}).code, 0);
  const std::string info = tagrid({"info", "scan.tag"}).out;
  const std::size_t at = info.find("\nratio");
  ASSERT_NE(at, info.npos) << info;
  const std::string ratio = fmt::format(", ratio {:.2f}, ", std::stod(info.substr(at + 7)));
  for (int number = 0; number < 3; ++number) {
    const std::vector<std::string> found = lines("scan.tag", number);
    EXPECT_TRUE(found[0].starts_with(fmt::format("volume {} of 0..2", number))) << found[0];
    EXPECT_TRUE(has(found[0], ": 24 x 20 x 3 int16, spacing 1 x 1 x 2 (no unit given)")) << found[0];
    EXPECT_TRUE(has(found[1], "; all volumes 8.64 kB in ")) << found[1];
    EXPECT_TRUE(has(found[1], ratio)) << found[1] << ratio;
    // The errors are those of the volume that is shown.
    EXPECT_TRUE(has(found[1], fmt::format("largest error {}", number == 0 ? 0 : 20))) << found[1];
  }
}

}  // namespace
}  // namespace tagrid
