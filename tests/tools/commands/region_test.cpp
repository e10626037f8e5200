// decode --region and --step on the command line.
#include <cstring>
#include <random>

#include "stages/grid/box.h"
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

class RegionOptions : public CommandLine {
 protected:
  // The int16 samples of a region of a volume of 52 x 40 x 36.
  static std::string part_of(const std::string& samples, Index3 low, Index3 high, std::int64_t step = 1) {
    std::string part;
    for (std::int64_t z = low.z; z < high.z; ++z)
      for (std::int64_t y = low.y; y < high.y; ++y)
        for (std::int64_t x = low.x; x < high.x; ++x)
          if (x % step == 0 && y % step == 0 && z % step == 0)
            part += samples.substr(static_cast<std::size_t>(2 * ((z * 40 + y) * 52 + x)), 2);
    return part;
  }
  std::string whole() const {
    expect_ok(tagrid({"decode", "volume.tag", "-o", "whole.raw", "-qf"}));
    return content("whole.raw");
  }
};

TEST_F(RegionOptions, GiveTheSamplesOfTheWholeFromFilesAndPipes) {
  make_tag({"--max-error", "2", "--cube", "8"});
  const std::string samples = whole(), file = content("volume.tag");
  struct Case {
    Arguments options;
    Index3 low, high;
    std::int64_t step = 1;
  };
  const Case cases[] = {{{"--region", "3:20,5:40,7:8"}, {3, 5, 7}, {20, 40, 8}},
                        {{"--region=:,:,10:11"}, {0, 0, 10}, {52, 40, 11}},
                        {{"--region", "51:,39:,35:"}, {51, 39, 35}, {52, 40, 36}},
                        {{"--step", "4"}, {0, 0, 0}, {52, 40, 36}, 4},
                        {{"--region", "5:50,:17,9:", "--step=2"}, {5, 0, 9}, {50, 17, 36}, 2}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.options[0] + " " + c.options.back());
    const std::string expected = part_of(samples, c.low, c.high, c.step);
    expect_ok(tagrid(with({"decode", "volume.tag", "-qfo", "part.raw"}, c.options)));
    EXPECT_EQ(content("part.raw"), expected);
    expect_ok(tagrid(with({"decode", "volume.tag", "-qfo", "part.nrrd"}, c.options)));
    EXPECT_EQ(samples_of(content("part.nrrd")), expected);
    const Ending piped = tagrid(with({"decode", "-", "-q"}, c.options), file);
    EXPECT_EQ(piped.code, 0) << piped.err;
    EXPECT_EQ(piped.out, expected);
  }
}

TEST_F(RegionOptions, TheWholeVolumeIsTheSameFile) {
  make_tag();
  expect_ok(tagrid({"decode", "volume.tag", "-qo", "whole.nrrd"}));
  expect_ok(tagrid({"decode", "volume.tag", "-qo", "region.nrrd", "--region", "0:52,0:40,0:36"}));
  EXPECT_EQ(content("whole.nrrd"), content("region.nrrd"));
}

TEST_F(RegionOptions, ARegionCanBeEncodedAgain) {
  make_tag();
  expect_ok(tagrid({"decode", "volume.tag", "-qo", "part.nrrd", "--region", "10:30,:,5:25"}));
  expect_ok(tagrid({"encode", "part.nrrd", "-q"}));
  expect_ok(tagrid({"decode", "part.tag", "-qo", "again.nrrd"}));
  EXPECT_EQ(content("part.nrrd"), content("again.nrrd"));
  expect_ok(tagrid({"decode", "volume.tag", "-qo", "part.vdb", "--region", "10:30,:,5:25"}));
  expect_ok(tagrid({"encode", "part.vdb", "-qo", "vdb.tag"}));
  expect_ok(tagrid({"decode", "vdb.tag", "-qo", "vdb.nrrd"}));
  EXPECT_EQ(samples_of(content("part.nrrd")), samples_of(content("vdb.nrrd")));
}

// It would have the name of the whole volume, which may be there.
TEST_F(RegionOptions, APartNeedsANameOfItsOwn) {
  make_tag();
  const std::string volume = content("volume.nrrd");
  for (const Arguments& part : {Arguments{"--region", ":,:,3:4"}, Arguments{"--step", "2"}})
    expect_error(tagrid(with({"decode", "volume.tag", "-f"}, part)), usage, "needs -o FILE");
  EXPECT_EQ(content("volume.nrrd"), volume);
  const Ending piped = tagrid({"decode", "-", "--region", ":,:,3:4"}, content("volume.tag"));
  expect_ok(piped);
  EXPECT_EQ(piped.out.size(), std::size_t{52} * 40 * 2);
}

TEST_F(RegionOptions, WrongOnesAreRefused) {
  make_tag();
  const auto refused = [&](const Arguments& options, std::string_view what) {
    expect_error(tagrid(with({"decode", "volume.tag", "-o", "part.raw"}, options)), usage, what);
    EXPECT_FALSE(std::filesystem::exists(path("part.raw")));
  };
  refused({"--region", "0:53,:,:"}, "0:53 along x");
  refused({"--region", ":,40:,:"}, "along y");
  refused({"--region", ":,:,7:7"}, "along z");
  refused({"--region", "-1:5,:,:"}, "along x");
  refused({"--region", "1:2,3:4"}, "x0:x1,y0:y1,z0:z1");
  refused({"--region", "a:b,:,:"}, "x0:x1,y0:y1,z0:z1");
  refused({"--region", "1,2,3"}, "x0:x1,y0:y1,z0:z1");
  refused({"--step", "3"},
          "a step of 3 is not possible: it must be a power of two from 1 to 32, the edge of ");
  refused({"--step", "0"}, "a power of two from 1 to 32");
  refused({"--region", "1:2,:,:", "--step", "2"}, "multiple of 2");
  refused({"--region", "1:2,:,:", "--rm"}, "leave out --rm");
  refused({"--rm"}, "do not record their size and type");
  expect_error(tagrid({"decode", "volume.tag", "-o", "part.vdb", "--vdb-tolerance", "3", "--rm"}), usage,
               "--vdb-tolerance changes samples");
  EXPECT_TRUE(std::filesystem::exists(path("volume.tag")));
  // The advice for a limit that is too small works.
  const Ending refusal =
      tagrid({"decode", "volume.tag", "-o", "part.raw", "--region", "1:30,:,:", "-M", "1M"});
  expect_error(refusal, usage, "give -M ");
  const std::string advice = refusal.err.substr(refusal.err.find("give -M ") + 8);
  expect_ok(tagrid({"decode", "volume.tag", "-qo", "part.raw", "--region", "1:30,:,:", "-M",
                    advice.substr(0, advice.find_first_not_of("0123456789M"))}));
}

TEST_F(RegionOptions, TheReportSaysTheSizeOfTheRegion) {
  make_tag();
  expect_ok(
      tagrid({"decode", "volume.tag", "-qo", "part.raw", "--region", "1:30,2:4,:", "--json", "run.json"}));
  EXPECT_EQ(json_of("run.json")["dims"], (nlohmann::json{29, 2, 36}));
}

// Samples of a brick that are not needed must not be in memory for all bricks at once.
TEST_F(RegionOptions, KeepTheLimitOfMemoryWhereBricksAreLarge) {
  if (program_is_sanitized()) GTEST_SKIP() << "sanitizers have memory of their own";
  // All bricks together take 16 MiB, as samples or as bytes, beside what the program takes.
  std::mt19937_64 random(1);
  std::string noise(std::size_t{512} * 256 * 64 * 2, '\0');
  for (std::size_t i = 0; i < noise.size(); i += 8) {
    const std::uint64_t bits = random();
    std::memcpy(noise.data() + i, &bits, 8);
  }
  file("noise.raw", noise);
  noise = {};  // what this process has counts for those that it starts
  expect_ok(tagrid({"encode", "noise.raw", "--dims", "512,256,64", "--type", "int16", "--effort", "fast",
                    "--range", "0:65535", "-q"}));
  for (const Arguments& part : {Arguments{"--region", ":,:,0:1"}, Arguments{"--step", "32"}}) {
    SCOPED_TRACE(part[0]);
    const Ending ending =
        tagrid(with({"decode", "noise.tag", "-qfo", "part.raw", "-M", "20M", "-T", "1"}, part));
    expect_ok(ending);
    EXPECT_LT(ending.peak_bytes, std::size_t{20} << 20);
    const Ending piped =
        script("cat noise.tag | $TAGRID decode - -qfo piped.raw -M 20M -T 1 " + part[0] + "=" + part[1]);
    expect_ok(piped);
    EXPECT_LT(piped.peak_bytes, std::size_t{20} << 20);
    EXPECT_EQ(content("part.raw"), content("piped.raw"));
  }
}

}  // namespace
}  // namespace tagrid
