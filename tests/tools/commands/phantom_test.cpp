// tagrid phantom.

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

class PhantomCommand : public CommandLine {};

TEST_F(PhantomCommand, HasTheSizeThatWasAskedForInEveryType) {
  const std::pair<const char*, std::size_t> types[] = {{"uint8", 1},   {"int8", 1},   {"uint16", 2},
                                                       {"int16", 2},   {"uint32", 4}, {"int32", 4},
                                                       {"float32", 4}, {"float64", 8}};
  for (const auto& [type, size] : types)
    EXPECT_EQ(out(std::string("phantom --dims 21,10,5 --type ") + type).size(), 21 * 10 * 5 * size) << type;
}

TEST_F(PhantomCommand, SameBytesForAnyThreadCountAndOthersForAnotherSeed) {
  const std::string usual = out("phantom --dims 30,20,17 -T1");
  EXPECT_EQ(out("phantom --dims 30,20,17 -T3"), usual);
  EXPECT_EQ(out("phantom --dims=30,20,17 -T 7 --seed 1"), usual);
  EXPECT_NE(out("phantom --dims 30,20,17 --seed 2"), usual);
}

TEST_F(PhantomCommand, SamplesAloneOnAPipeUnlessAHeaderIsAskedFor) {
  phantom("volume.nrrd");
  phantom("volume.raw");
  phantom("apart.nhdr");
  EXPECT_EQ(content("apart.raw"), content("volume.raw"));
  EXPECT_EQ(samples_of(content("volume.nrrd")), content("volume.raw"));
  EXPECT_EQ(tagrid({"phantom", "--dims", "52,40,36", "-o", "-"}).out, content("volume.raw"));
  EXPECT_EQ(tagrid({"phantom", "--dims", "52,40,36", "--format", "nrrd"}).out, content("volume.nrrd"));
}

TEST_F(PhantomCommand, WrongRequestsAreRefused) {
  for (const char* dims : {"4,4", "0,4,4", "4,-4,4", "4,x,4", "4000000000,4,4"})
    expect_error(tagrid({"phantom", "--dims", dims, "-o", "x.raw"}), usage, "--dims");
  fails("phantom -o x.raw", usage, "--dims is required");
  fails("phantom --dims 4,4,4 --type int64", usage, "int64");
  fails("phantom --dims 4,4,4 --seed -1", usage, "--seed");
  fails("phantom --dims 4,4,4 -o x.png", usage, "x.png");
  fails("phantom --dims 4,4,4 -o no/x.raw", world, "no/x.raw");
  EXPECT_EQ(names(), std::vector<std::string>{});
}

}  // namespace
}  // namespace tagrid
