// tagrid estimate, and bounds that follow from the samples, as a user meets them.
#include <cmath>

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

using Json = nlohmann::json;

class EstimateCommand : public CommandLine {
 protected:
  Json estimates(const Arguments& more) const {
    const Ending ending = tagrid(with({"estimate", "volume.nrrd", "-q", "--json", "-"}, more));
    EXPECT_EQ(ending.code, 0) << ending.err;
    return Json::parse(ending.out)["settings"];
  }
  /// What a warning is said in.
  std::string words_of(const std::string& line, std::string_view input = {}) const {
    const Ending ending = tagrid(words(line), input);
    EXPECT_EQ(ending.code, 0) << line << ending.err;
    return ending.err;
  }
};

TEST_F(EstimateCommand, SaysWhatEncodingGives) {
  phantom("volume.nrrd");
  const Json json = estimates({"--errors", "2,10", "--effort", "best"});
  EXPECT_EQ(json["bricks_encoded"], json["bricks"]);
  ASSERT_EQ(json["estimates"].size(), 2U);
  for (const Json& e : json["estimates"]) {
    works("encode volume.nrrd -fo a.tag --effort=best --max-error " + e["max_error"].dump());
    const Json file = info("a.tag");
    EXPECT_NEAR(e["bytes"].get<double>() / file["bytes"]["file"].get<double>(), 1, 0.02);
    EXPECT_NEAR(e["psnr"].get<double>(), file["achieved"]["psnr"].get<double>(), 0.01);
    EXPECT_GT(e["encoding_seconds"].get<double>(), 0);
    EXPECT_GT(e["decoding_seconds"].get<double>(), 0);
  }
}

TEST_F(EstimateCommand, ChoosesBoundsAroundTheNoise) {
  phantom("volume.nrrd");
  const Json json = estimates({});
  const double noise = json["noise"];
  EXPECT_GT(noise, 0);
  EXPECT_TRUE(json["estimates"][0]["psnr"].is_null());
  std::vector<double> tried, expected = {0};
  for (const Json& e : json["estimates"]) tried.push_back(e["max_error"]);
  for (const double part : {0.125, 0.25, 0.5, 1.0, 2.0, 4.0})
    if (const double bound = std::floor(part * noise); bound > expected.back()) expected.push_back(bound);
  EXPECT_EQ(tried, expected);
  const std::string text = out("estimate volume.nrrd");
  EXPECT_TRUE(has(text, "\nnoise: ") && has(text, "lossless"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5 + static_cast<std::ptrdiff_t>(tried.size()));
}

TEST_F(EstimateCommand, NoiseOfASmallScanIsDoubtedAndThatOfALargerOneIsNot) {
  const char* doubt = "volume.nrrd: the noise is probably far too large";
  for (const char* dims : {"80,80,20", "128,128,16"}) {
    phantom("volume.nrrd", {"--dims", dims, "-f"});
    const bool is_small = dims[0] == '8';
    const Arguments encode = {"encode", "volume.nrrd", "-f", "-o", "a.tag", "--max-error", "noise:1"};
    EXPECT_EQ(has(tagrid({"estimate", "volume.nrrd", "--errors", "2"}).err, doubt), is_small);
    EXPECT_EQ(has(tagrid(encode).err, doubt), is_small);
    expect_ok(tagrid(with(encode, {"-q"})));
  }
}

TEST_F(EstimateCommand, ReadsWhatEncodeReads) {
  phantom("volume.nrrd");
  phantom("volume.raw");
  const auto bytes = [&](const std::string& line, std::string_view input = {}) {
    const Json report = Json::parse(out("estimate --errors 0,3 -q --json - " + line, input));
    Json sizes;
    for (const Json& e : report["settings"]["estimates"]) sizes.push_back(e["bytes"]);
    return sizes;
  };
  EXPECT_EQ(bytes("volume.raw --dims 52,40,36 --type int16").size(), 2U);
  EXPECT_EQ(bytes("- --spool .", content("volume.nrrd")), bytes("volume.nrrd"));
  const Ending piped = script("cat volume.nrrd | $TAGRID estimate -");
  EXPECT_EQ(piped.code, 0);
  EXPECT_TRUE(has(piped.err, "standard input: is read more than once, so its samples (")) << piped.err;
}

TEST_F(EstimateCommand, BoundsAreRoundedAsEncodeRoundsThemAndThatIsSaid) {
  phantom("volume.nrrd");
  const std::string said = words_of("estimate volume.nrrd --errors 2,2.7 --json a.json");
  EXPECT_TRUE(has(said,
                  "tagrid: warning: volume.nrrd: --errors 2.7: encode keeps whole steps of the stored "
                  "samples, so this is 2\n"));
  EXPECT_FALSE(has(said, "--errors 2:"));
  const Json tried = json_of("a.json")["settings"]["estimates"];
  EXPECT_EQ(tried[0]["bytes"], tried[1]["bytes"]);
  EXPECT_EQ(tried[1]["max_error"], 2);
  works("encode volume.nrrd -q -o a.tag --max-error 2.7");
  EXPECT_EQ(info("a.tag")["max_error"], 2);
}

// The bricks that are encoded show less of the range than the volume has, and those of the search are others.
TEST_F(EstimateCommand, ALargeVolumeReachesAPsnrInTheEstimateAsInTheFile) {
  if (program_is_sanitized()) GTEST_SKIP() << "takes minutes";
  phantom("volume.nrrd", {"--dims", "400,300,200"});
  const Json e = estimates({"--psnr", "42"})["estimates"][0];
  works("encode volume.nrrd -q -o a.tag --psnr 42");
  EXPECT_GE(e["psnr"].get<double>(), 42);
  EXPECT_NEAR(e["psnr"].get<double>(), info("a.tag")["achieved"]["psnr"].get<double>(), 0.2);
}

// What is coded by a wavelet is marked: its bound says little of most errors.
TEST_F(EstimateCommand, TriesPsnrsAndSizes) {
  phantom("volume.nrrd");
  const Json json = estimates({"--psnr", "40,45", "--ratio", "40", "--errors", "3"});
  ASSERT_EQ(json["estimates"].size(), 4);
  EXPECT_TRUE(json["estimates"][0]["transform_step"].is_null());
  EXPECT_GE(json["estimates"][2]["psnr"].get<double>(), 45);
  EXPECT_NEAR(json["estimates"][3]["ratio"].get<double>(), 40, 1.5);
  // Every row says what was asked for.
  EXPECT_EQ(json["estimates"][0]["asked"], (Json{{"max_error", 3}}));
  EXPECT_EQ(json["estimates"][2]["asked"], (Json{{"psnr", 45}}));
  EXPECT_EQ(json["estimates"][0]["search_seconds"], 0);
  EXPECT_GT(json["estimates"][2]["search_seconds"].get<double>(), 0);
  const std::string text = tagrid({"estimate", "volume.nrrd", "--psnr", "40", "--ratio", "40:1"}).out;
  for (const char* words : {" w ", "\npsnr 40 ", "\nratio 40 ", "at least D dB"})
    EXPECT_TRUE(has(text, words));
  EXPECT_TRUE(estimates({})["estimates"][0]["asked"].is_null());
}

TEST_F(EstimateCommand, SizesThatAreOutOfReachHideNoOthers) {
  phantom("volume.nrrd");
  EXPECT_TRUE(has(words_of("estimate volume.nrrd --ratio 1e9,20 --json some.json"),
                  "warning: volume.nrrd: --ratio 1000000000 cannot be reached"));
  const Json settings = json_of("some.json")["settings"];
  EXPECT_EQ(settings["estimates"].size(), 1);
  EXPECT_EQ(settings["out_of_reach"].size(), 1);
  fails("estimate volume.nrrd --ratio 1e9", usage, "cannot be reached");
}

TEST_F(EstimateCommand, RefusesWhatIsNoList) {
  phantom("volume.nrrd");
  for (const char* list : {"1,x", ",", "1,,2", "-1", "1 2", "nan"})
    expect_error(tagrid({"estimate", "volume.nrrd", "--errors", list}), usage, "--errors");
  for (const std::string option : {"--psnr", "--ratio", "--bits"})
    fails("estimate volume.nrrd " + option + " 40,x", usage, option);
  for (const std::string option : {"--max-error", "--relative-error"})
    fails("estimate volume.nrrd " + option + " 3", usage, option);
  fails("estimate missing.nrrd", world, "missing.nrrd");
  fails("estimate volume.nrrd -M 1M", usage, "give -M ");
}

TEST_F(EstimateCommand, BoundsThatFollowFromSamplesAreSaidAndPlainInTheFile) {
  phantom("volume.nrrd");
  const double noise = estimates({})["noise"];
  const std::string said = words_of("encode volume.nrrd -o a.tag --max-error noise:0.5"),
                    bound_of_noise = info("a.tag")["max_error"].dump();
  EXPECT_EQ(info("a.tag")["max_error"], std::floor(0.5 * noise));
  EXPECT_TRUE(has(said, "so the maximum error is set to " + bound_of_noise));
  // The same file as with the number.
  works("encode volume.nrrd -o b.tag --max-error " + bound_of_noise);
  EXPECT_TRUE(content("a.tag") == content("b.tag"));

  works("encode volume.nrrd -qfo a.tag --psnr 55 --json run.json");
  const Json file = info("a.tag");
  EXPECT_GE(file["achieved"]["psnr"].get<double>(), 55);
  EXPECT_TRUE(has(json_of("run.json")["settings"]["reason_of_max_error"].get<std::string>(), "55 dB"));
  EXPECT_LT(file["achieved"]["psnr"].get<double>(), 55.5);
  EXPECT_EQ(file["max_error"], file["achieved"]["max_error"]);
  // With a bound besides it, both hold.
  const int bound = file["max_error"].get<int>() / 2;
  works("encode volume.nrrd -qfo a.tag --psnr 55 --max-error " + std::to_string(bound));
  EXPECT_GE(info("a.tag")["achieved"]["psnr"].get<double>(), 55);
  EXPECT_LE(info("a.tag")["achieved"]["max_error"].get<int>(), bound);

  for (const std::string rule : {" --max-error noise:2", " --psnr 50", " --relative-error 0.1"}) {
    EXPECT_TRUE(has(words_of("encode - -fo c.tag" + rule, content("volume.nrrd")),
                    "standard input: is read more than once, so its samples ("));
    words_of("encode volume.nrrd -fo d.tag" + rule);
    EXPECT_EQ(info("c.tag")["max_error"], info("d.tag")["max_error"]);
  }
}

}  // namespace
}  // namespace tagrid
