#include "io/nrrd/rescale.h"

#include <gtest/gtest.h>

#include "io/nrrd/geometry.h"

namespace tagrid {
namespace {

TEST(Rescaling, IsThatWhichWasAdded) {
  for (const Rescale& rescale : {Rescale{2, -1000, "HU"}, {-0.1, 3, ""}, {1, 0.5, "g/cm3"}}) {
    KeyValues pairs;
    add_rescale(rescale, pairs);
    EXPECT_EQ(rescale_of(nrrd_fields_of({}, pairs)), rescale);
  }
}

TEST(Rescaling, IsNoneIfThereIsNoneOrItIsNotNumbers) {
  EXPECT_EQ(rescale_of(""), Rescale{});
  EXPECT_EQ(rescale_of("rescale_units:=HU\n"), (Rescale{1, 0, "HU"}));
  for (const char* fields :
       {"rescale_slope:=0\nrescale_intercept:=5\n", "rescale_slope:=nan\n", "rescale_slope:=x\n",
        "rescale_slope:=2\nrescale_intercept:=inf\n", "rescale_slope:=2\nslice_slopes:=2 3\n"})
    EXPECT_EQ(rescale_of(fields), Rescale{}) << fields;
}

TEST(Rescaling, IsInDoubtIfItIsThereAndNoNumber) {
  for (const char* fields : {"", "rescale_slope:=0\n", "rescale_slope:=2\nrescale_intercept:=-1e3\n",
                             "slice_slopes:=1 2 3\nslice_intercepts:=0 0 0\n", "who:=x\n"})
    EXPECT_EQ(doubt_of_rescale(fields, 3), "") << fields;
  for (const char* fields :
       {"rescale_slope:=\n", "rescale_slope:=x\n", "rescale_intercept:=inf\n", "rescale_slope:=2,5\n",
        "slice_slopes:=1 2\n", "slice_slopes:=1 2 x\n", "slice_intercepts:=1 2 nan\n"})
    EXPECT_NE(doubt_of_rescale(fields, 3), "") << fields;
}

}  // namespace
}  // namespace tagrid
