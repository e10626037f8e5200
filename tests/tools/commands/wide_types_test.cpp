// 32-bit integers and floats on the command line.

#include <cmath>
#include <cstring>

#include "tests/support/command_line.h"
#include "tests/support/header_and_bricks.h"

namespace tagrid {
namespace {

class WideTypes : public CommandLine {
 protected:
  /// Samples of float32, 52 x 40 x 36.
  template <class F>
  std::string floats(F f) const {
    std::string bytes;
    for (int i = 0; i < 52 * 40 * 36; ++i) {
      const auto v = static_cast<float>(f(i));
      char raw[4];
      std::memcpy(raw, &v, 4);
      bytes.append(raw, 4);
    }
    return bytes;
  }
  const Arguments float_raw_ = {"--dims", "52,40,36", "--type", "float32"};
};

TEST_F(WideTypes, APipeNeedsARangeOrAFieldScale) {
  for (const char* type : {"uint32", "int32", "float32", "float64"}) {
    phantom("v.raw", {"--type", type, "-f"});
    const Arguments raw = {"--dims", "52,40,36", "--type", type};
    const std::string samples = content("v.raw");
    expect_error(tagrid(with({"encode", "-"}, raw), samples), usage, "--range");
    expect_error(tagrid(with({"encode", "-", "--range", "auto"}, raw), samples), usage, "--range");
    for (const Arguments& scale : {Arguments{"--range", "-1024:3072"}, Arguments{"--field-scale", "0.002"}}) {
      const Ending piped = tagrid(with(with({"encode", "-", "--max-error", "3"}, raw), scale), samples);
      expect_ok(piped);
      expect_ok(tagrid(with(with({"encode", "v.raw", "--max-error", "3", "-fo", "v.tag"}, raw), scale)));
      EXPECT_EQ(header_and_bricks(content("v.tag")), header_and_bricks(piped.out))
          << "a file and a pipe give the same bricks";
      expect_ok(tagrid(with({"verify", "v.tag", "-q", "--against", "v.raw"}, raw)));
    }
  }
}

TEST_F(WideTypes, LosslessFilesGiveBackTheSameBytes) {
  for (const char* type : {"uint32", "int32", "float32", "float64"}) {
    phantom("v.nrrd", {"--type", type, "-f"});
    expect_ok(tagrid({"encode", "v.nrrd", "-f"}));
    expect_ok(tagrid({"decode", "v.tag", "-fo", "back.nrrd"}));
    EXPECT_EQ(samples_of(content("back.nrrd")), samples_of(content("v.nrrd"))) << type;
    EXPECT_EQ(nlohmann::json::parse(tagrid({"info", "v.tag", "--json"}).out)["type"], type);
  }
}

TEST_F(WideTypes, JsonHasNumbersOrNullWhateverTheSamplesAre) {
  const auto nan = [](int) { return std::nan(""); };
  const auto huge = [](int i) { return i % 2 ? 3e38 : -3e38; };
  const auto mixed = [](int i) { return i % 5 == 0 ? INFINITY : std::sin(i * 0.01); };
  for (const std::string& samples : {floats(nan), floats(huge), floats(mixed)})
    for (const Arguments& options :
         {Arguments{}, {"--max-error", "0.5"}, {"--grid-only"}, {"--max-error", "1e300"}}) {
      file("v.raw", samples);
      expect_ok(tagrid(with(with({"encode", "v.raw", "-qf", "--json", "run.json"}, float_raw_), options)));
      const Ending info = tagrid({"info", "v.tag", "--json"});
      expect_ok(info);
      for (const nlohmann::json& achieved :
           {nlohmann::json::parse(info.out)["achieved"], json_of("run.json")["achieved"]}) {
        for (const char* key : {"max_error", "rmse", "psnr"})
          EXPECT_TRUE(achieved[key].is_number() || achieved[key].is_null()) << key;
        if (options.empty()) {
          EXPECT_EQ(achieved["max_error"], 0);
          EXPECT_TRUE(achieved["psnr"].is_null());
        }
      }
      expect_ok(tagrid(with({"verify", "v.tag", "-q", "--against", "v.raw"}, float_raw_)));
    }
}

TEST_F(WideTypes, AnErrorAboveTheBoundIsFoundByVerify) {
  const std::string samples = floats([](int i) { return std::sin(i * 0.01); });
  file("v.raw", samples);
  expect_ok(tagrid(with({"encode", "v.raw", "-q", "--max-error", "0.001"}, float_raw_)));
  for (const float wrong : {0.1F, std::nanf(""), INFINITY}) {
    std::string other = samples;
    std::memcpy(other.data() + 4 * 5000, &wrong, 4);
    file("other.raw", other);
    expect_error(tagrid(with({"verify", "v.tag", "--against", "other.raw"}, float_raw_)), broken_input,
                 "voxel");
  }
}

}  // namespace
}  // namespace tagrid
