// The words of a preview.
#include "tools/preview/captions.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

TEST(Captions, ASliceAtItsOwnDistanceIsSaidToLieThere) {
  TagHeader header;
  header.parameters.dims = {8, 8, 4};
  header.nrrd_fields =
      "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1.25)\nspace units: \"mm\" \"mm\" \"um\"\n"
      "slice_positions:=0 0 5; 0 0 6.25; 0 0 7.5; 0 0 11.75\n";
  const Lengths lengths = lengths_of(header);
  // In one unit, that of the first axis.
  EXPECT_DOUBLE_EQ(lengths.distance(2, 2), 2.5e-3);
  EXPECT_DOUBLE_EQ(lengths.distance(2, 3), 6.75e-3);
  EXPECT_DOUBLE_EQ(lengths.distance(0, 3), 3);
  // Without a position of each slice, all distances are equal.
  header.parameters.dims.z = 5;
  EXPECT_DOUBLE_EQ(lengths_of(header).distance(2, 4), 5e-3);
}

}  // namespace
}  // namespace tagrid
