// tagrid phantom.

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

class PhantomCommand : public CommandLine {};

TEST_F(PhantomCommand, HasTheSizeThatWasAskedForInEveryType) {
  const std::vector<std::pair<std::string, std::size_t>> types = {
      {"uint8", 1},  {"int8", 1},  {"uint16", 2},  {"int16", 2},
      {"uint32", 4}, {"int32", 4}, {"float32", 4}, {"float64", 8}};
  for (const auto& [type, size] : types) {
    const Ending ending = tagrid({"phantom", "--dims", "21,10,5", "--type", type});
    expect_ok(ending);
    EXPECT_EQ(ending.out.size(), 21 * 10 * 5 * size) << type;
  }
}

TEST_F(PhantomCommand, SameBytesForAnyThreadCount) {
  const Ending one = tagrid({"phantom", "--dims", "30,20,17", "-T1"});
  EXPECT_EQ(tagrid({"phantom", "--dims", "30,20,17", "-T3"}).out, one.out);
  EXPECT_EQ(tagrid({"phantom", "--dims=30,20,17", "-T", "7"}).out, one.out);
}

TEST_F(PhantomCommand, AnotherSeedIsAnotherVolume) {
  const Ending usual = tagrid({"phantom", "--dims", "30,20,4"});
  EXPECT_EQ(tagrid({"phantom", "--dims", "30,20,4", "--seed", "1"}).out, usual.out);
  EXPECT_NE(tagrid({"phantom", "--dims", "30,20,4", "--seed", "2"}).out, usual.out);
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
  expect_error(tagrid({"phantom", "-o", "x.raw"}), usage, "--dims is required");
  expect_error(tagrid({"phantom", "--dims", "4,4,4", "--type", "int64"}), usage, "int64");
  expect_error(tagrid({"phantom", "--dims", "4,4,4", "--seed", "-1"}), usage, "--seed");
  expect_error(tagrid({"phantom", "--dims", "4,4,4", "-o", "x.png"}), usage, "x.png");
  expect_error(tagrid({"phantom", "--dims", "4,4,4", "-o", "no/x.raw"}), world, "no/x.raw");
  EXPECT_EQ(names(), std::vector<std::string>{});
}

}  // namespace
}  // namespace tagrid
