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
};

TEST_F(RegionOptions, GiveTheSamplesOfTheWholeFromFilesAndPipes) {
  make_tag({"--max-error", "2", "--cube", "8"});
  works("decode volume.tag -qo whole.raw");
  const std::string samples = content("whole.raw"), file = content("volume.tag");
  struct Case {
    std::string options;
    Index3 low, high;
    std::int64_t step = 1;
  };
  const Case cases[] = {{"--region=:,:,10:11", {0, 0, 10}, {52, 40, 11}},
                        {"--step 4", {0, 0, 0}, {52, 40, 36}, 4},
                        {"--region 5:50,:17,9: --step=2", {5, 0, 9}, {50, 17, 36}, 2}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.options);
    const std::string expected = part_of(samples, c.low, c.high, c.step);
    works("decode volume.tag -qfo part.raw " + c.options);
    EXPECT_EQ(content("part.raw"), expected);
    works("decode volume.tag -qfo part.nrrd --json run.json " + c.options);
    EXPECT_EQ(samples_of(content("part.nrrd")), expected);
    const auto dims = json_of("run.json")["dims"];
    EXPECT_EQ(dims[0].get<std::size_t>() * dims[1].get<std::size_t>() * dims[2].get<std::size_t>() * 2,
              expected.size());
    EXPECT_EQ(tagrid(words("decode - -q " + c.options), file).out, expected);
  }
}

TEST_F(RegionOptions, ARegionCanBeEncodedAgain) {
  make_tag();
  for (const char* name : {"part.nrrd", "part.vdb"}) {
    works(std::string("decode volume.tag -qf --region 10:30,:,5:25 -o ") + name);
    works(std::string("encode -qfo part.tag ") + name);
    works("decode part.tag -qfo again.nrrd");
    EXPECT_EQ(samples_of(content("part.nrrd")), samples_of(content("again.nrrd")));
  }
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
  const std::pair<const char*, const char*> refused[] = {
      {"--region 0:53,:,:", "0:53 along x"},
      {"--region :,40:,:", "along y"},
      {"--region :,:,7:7", "along z"},
      {"--region -1:5,:,:", "along x"},
      {"--region 1:2,3:4", "x0:x1,y0:y1,z0:z1"},
      {"--region a:b,:,:", "x0:x1,y0:y1,z0:z1"},
      {"--region 1,2,3", "x0:x1,y0:y1,z0:z1"},
      {"--step 3", "a step of 3 is not possible: it must be a power of two from 1 to 32, the edge of "},
      {"--step 0", "a power of two from 1 to 32"},
      {"--region 1:2,:,: --step 2", "multiple of 2"},
      {"--region 1:2,:,: --rm", "leave out --rm"},
      {"--rm", "do not record their size and type"}};
  for (const auto& [options, message] : refused)
    fails(std::string("decode volume.tag -o part.raw ") + options, usage, message);
  fails("decode volume.tag -o part.vdb --vdb-tolerance 3 --rm", usage, "--vdb-tolerance changes samples");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.tag"}));
  // The advice for a limit that is too small works.
  const std::string part = "decode volume.tag -o part.raw -q --region 1:30,:,: -M ";
  const Ending refusal = tagrid(words(part + "1M"));
  expect_error(refusal, usage, "give -M ");
  const std::string advice = refusal.err.substr(refusal.err.find("give -M ") + 8);
  works(part + advice.substr(0, advice.find_first_not_of("0123456789M")));
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
  works("encode noise.raw --dims 512,256,64 --type int16 --effort fast --range 0:65535 -q");
  for (const std::string part : {"--region=:,:,0:1", "--step=32"}) {
    const std::string file = "$TAGRID decode noise.tag -qfo part.raw -M 20M -T 1 ",
                      pipe = "cat noise.tag | $TAGRID decode - -qfo piped.raw -M 20M -T 1 ";
    for (const std::string& command : {file, pipe}) {
      const Ending ending = script(command + part);
      expect_ok(ending);
      EXPECT_LT(ending.peak_bytes, std::size_t{20} << 20) << command << part;
    }
    EXPECT_EQ(content("part.raw"), content("piped.raw"));
  }
}

}  // namespace
}  // namespace tagrid
