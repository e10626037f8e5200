// The output of info, verify and --json FILE.

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

using Json = nlohmann::json;

class Reports : public CommandLine {
 protected:
  /// Points of levels 0 .. level of a x b x c root cubes of edge 2^K, counted by bisection: the corners of
  /// the cubes of a size, their centres, the centres of their faces, and again with half the size.
  static std::uint64_t points_up_to(int level, std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    const std::uint64_t n = std::uint64_t{1} << (level / 3);
    a *= n, b *= n, c *= n;
    std::uint64_t points = (a + 1) * (b + 1) * (c + 1);
    if (level % 3 >= 1) points += a * b * c;
    if (level % 3 == 2) points += (a + 1) * b * c + a * (b + 1) * c + a * b * (c + 1);
    return points;
  }
  static void expect_keys(const Json& json, const std::vector<std::string>& keys) {
    for (const std::string& key : keys) EXPECT_TRUE(json.contains(key)) << key;
  }
};

TEST_F(Reports, InfoHasEveryKeyAndTheOptions) {
  make_tag({"--max-error", "3"});
  Json json = info("volume.tag");
  expect_keys(json, {"dims", "type", "cube", "accuracy", "field_scale", "range", "max_error", "effort",
                     "mode", "levels", "bytes", "achieved", "source"});
  EXPECT_EQ(json["dims"], Json({52, 40, 36}));
  EXPECT_EQ(json["type"], "int16");
  EXPECT_EQ(json["cube"], 32);
  EXPECT_EQ(json["accuracy"], 20);
  EXPECT_EQ(json["range"], Json({-1024, 3072}));
  EXPECT_EQ(json["mode"], "voxels");
  expect_keys(json["achieved"], {"max_error", "rmse", "psnr"});
  EXPECT_EQ(json["achieved"]["max_error"], 3);
  EXPECT_GT(json["achieved"]["psnr"], 50);
  works("encode volume.nrrd -f --cube=16 --accuracy=30 --range=-500:1500 --effort fast");
  json = info("volume.tag");
  EXPECT_EQ(json["cube"], 16);
  EXPECT_EQ(json["accuracy"], 30);
  EXPECT_EQ(json["range"], Json({-500, 1500}));
  EXPECT_EQ(json["max_error"], 0);
  EXPECT_EQ(json["achieved"]["rmse"], 0);
  EXPECT_TRUE(json["achieved"]["psnr"].is_null());
  EXPECT_EQ(json["effort"], "fast");
  EXPECT_TRUE(has(out("info volume.tag"), "effort          fast"));
  works("encode volume.nrrd -f --field-scale 0.25");
  EXPECT_EQ(info("volume.tag")["field_scale"], 0.25);
  EXPECT_TRUE(info("volume.tag")["range"].is_null());
}

TEST_F(Reports, ARatioIsThatOfTheSizesBesideIt) {
  file("volume.nrrd",
       "NRRD0004\ntype: int16\ndimension: 3\nsizes: 52 40 36\nencoding: raw\nendian: little\n"
       "rescale_slope:=0.5\n\n" +
           std::string(std::size_t{2} * 52 * 40 * 36, '\3'));
  works("encode volume.nrrd");
  const auto said = [&](const Arguments& more) {
    const Ending ending = tagrid(with({"decode", "volume.tag", "-f", "-v"}, more));
    EXPECT_EQ(ending.code, 0);
    return ending.err + ending.out;
  };
  const auto in = static_cast<double>(content("volume.tag").size());
  const std::string all = said({"-o", "a.nrrd"});
  EXPECT_TRUE(has(all, fmt::format("-> 150 kB, ratio {:.2f}, largest error 0", 2 * 52 * 40 * 36 / in)))
      << all;
  // A part, values that are twice as large, and samples that are compressed.
  for (const Arguments& more : {words("--region :,:,20:21 -o a.nrrd"), words("--values -o a.nrrd"),
                                words("--step 2 -o a.nrrd"), words("--samples -o a.nii.gz")}) {
    const std::string line = said(more);
    EXPECT_TRUE(has(line, "B -> ")) << line;
    EXPECT_FALSE(has(line, "ratio")) << line;
  }
}

TEST_F(Reports, InfoSaysWhatTheFileCameFrom) {
  const std::string samples(std::size_t{2} * 3 * 4, '\5');
  std::ofstream(path("a.nrrd"), std::ios::binary)
      << "NRRD0005\n# made by hand\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n"
         "space: left-posterior-superior\nspace directions: (1,0,0) (0,2,0) (0,0,3)\ncontent: a bone: left\n"
         "patient:=nobody:=known\nkVp:=120\n\n"
      << samples;
  works("encode a.nrrd");
  const Json source = info("a.tag")["source"];
  EXPECT_EQ(source["fields"], Json({{"space", "left-posterior-superior"},
                                    {"space directions", "(1,0,0) (0,2,0) (0,0,3)"},
                                    {"content", "a bone: left"}}));
  EXPECT_EQ(source["pairs"], Json({{"patient", "nobody:=known"}, {"kVp", "120"}}));
  EXPECT_EQ(source["comments"], Json({"# made by hand"}));

  std::ofstream(path("b.raw"), std::ios::binary) << samples;
  works("encode b.raw --dims 2,3,4 --type uint8 -o b.tag");
  EXPECT_EQ(info("b.tag")["source"],
            Json({{"fields", Json::object()}, {"pairs", Json::object()}, {"comments", Json::array()}}));
}

TEST_F(Reports, AGridHasNoBoundUnlessToldSo) {
  make_tag({"--grid-only", "--effort", "best"});
  const Json values = info("volume.tag")["bytes"]["values"];
  works("encode volume.nrrd -f --grid-only");
  EXPECT_EQ(info("volume.tag")["bytes"]["values"], values) << "effort is accepted, and changes nothing";
  EXPECT_EQ(info("volume.tag")["mode"], "grid");
  EXPECT_TRUE(info("volume.tag")["max_error"].is_null());
  works("encode volume.nrrd -f --grid-only --max-error 0");
  EXPECT_EQ(info("volume.tag")["max_error"], 0);
  EXPECT_EQ(info("volume.tag")["achieved"]["max_error"], 0);
}

TEST_F(Reports, BytesSumToTheFile) {
  phantom("volume.nhdr");
  for (const std::string options : {"--cube=8 --max-error=3", "--grid-only"}) {
    works("encode volume.nhdr -f --json a.json " + options);
    EXPECT_EQ(json_of("a.json")["bytes_in"], content("volume.nhdr").size() + content("volume.raw").size());
    const Json bytes = info("volume.tag")["bytes"];
    EXPECT_EQ(bytes["file"], content("volume.tag").size());
    std::uint64_t sum = 0;
    for (const char* part : {"header", "activity", "values", "envelope", "index"}) {
      EXPECT_GT(bytes[part], 0) << part;
      sum += bytes[part].get<std::uint64_t>();
    }
    EXPECT_EQ(bytes["file"], sum);
  }
}

TEST_F(Reports, LevelsAreCumulativeWithExactPointCounts) {
  make_tag({"--cube", "16", "--max-error", "5"});
  const Json levels = info("volume.tag")["levels"];
  ASSERT_EQ(levels.size(), 3U * 4 + 1);
  std::uint64_t before = 0;
  for (int level = 0; level < 13; ++level) {
    const Json& row = levels[static_cast<std::size_t>(level)];
    EXPECT_EQ(row["level"], level);
    EXPECT_EQ(row["points"], points_up_to(level, 4, 3, 3)) << level;
    EXPECT_GE(row["active"], before);
    EXPECT_LE(row["active"], row["points"]);
    before = row["active"];
  }
  EXPECT_EQ(levels[0]["active"], 5 * 4 * 4) << "root corners are active";
}

TEST_F(Reports, ALimitedRunHasNoActivePointsAboveItsLevel) {
  make_tag({"--grid-only", "--max-level", "7"});
  const Json levels = info("volume.tag")["levels"];
  EXPECT_EQ(levels[7]["active"], levels[15]["active"]);
  EXPECT_LT(levels[6]["active"], levels[7]["active"]);
}

TEST_F(Reports, VerifyAcceptsWhatWasEncodedAndFindsASingleChangedVoxel) {
  make_tag({"--max-error", "3"});
  phantom("volume.raw");
  for (const char* original : {"volume.nrrd", "volume.raw --dims 52,40,36 --type int16"}) {
    const std::string text = out(std::string("verify volume.tag --against ") + original);
    EXPECT_TRUE(has(text, "largest error against " + words(original)[0] + ": 3\n"));
  }
  std::string changed = content("volume.nrrd");
  const std::size_t voxel = (11 * 40 + 31) * 52 + 17;
  changed[changed.size() - 2 * (52 * 40 * 36 - voxel) + 1] ^= 1;
  file("changed.nrrd", changed);
  fails("verify volume.tag --against changed.nrrd", broken_input, "(17, 31, 11)");
}

TEST_F(Reports, VerifyRefusesAnOriginalOfAnotherSize) {
  make_tag();
  phantom("other.nrrd", {"--dims", "52,40,35"});
  fails("verify volume.tag --against other.nrrd", broken_input, "the original is 52 x 40 x 35 int16");
  fails("verify volume.tag --against missing", world, "missing");
  expect_error(tagrid(with({"verify", "volume.tag"}, raw_)), usage, "--against");
  fails("verify - --against -", usage, "--against");
}

TEST_F(Reports, EveryCommandWritesStatistics) {
  phantom("volume.nrrd", {"--json", "phantom.json"});
  works("encode volume.nrrd --max-error=3 -T2 --json encode.json");
  works("verify volume.tag --json=verify.json --against volume.nrrd -q");
  works("decode volume.tag -o again.nrrd --json decode.json");
  for (const std::string command : {"phantom", "encode", "verify", "decode"}) {
    SCOPED_TRACE(command);
    const Json json = json_of(command + ".json");
    EXPECT_EQ(json["command"], command);
    expect_keys(json, {"input", "output", "settings", "achieved", "threads"});
    EXPECT_EQ(json["dims"], Json({52, 40, 36}));
    EXPECT_EQ(json["type"], "int16");
    EXPECT_GT(json["seconds"], 0);
    EXPECT_NEAR(json["voxels_per_second"].get<double>() * json["seconds"].get<double>(), 52 * 40 * 36, 1);
  }
  const Json encode = json_of("encode.json"), decode = json_of("decode.json");
  EXPECT_EQ(encode["bytes_in"], content("volume.nrrd").size());
  EXPECT_EQ(encode["bytes_out"], content("volume.tag").size());
  EXPECT_EQ(encode["threads"], 2);
  EXPECT_EQ(encode["settings"]["max_error"], 3);
  EXPECT_EQ(encode["achieved"]["max_error"], 3);
  EXPECT_EQ(decode["bytes_in"], content("volume.tag").size());
  EXPECT_EQ(decode["bytes_out"], content("again.nrrd").size());
  EXPECT_EQ(decode["achieved"], encode["achieved"]);
  EXPECT_TRUE(json_of("phantom.json")["input"].is_null());
}

TEST_F(Reports, HowOftenSamplesAreReadCountsAllReadings) {
  phantom("volume.nrrd");
  const auto times = [&](const std::string& options, std::string_view input = {}) {
    const std::string text = tagrid(words("encode -vfo x.tag " + options), input).err;
    const std::size_t at = text.find("every sample read ");
    return at == text.npos ? 0 : std::stod(text.substr(at + 18));
  };
  EXPECT_EQ(times("volume.nrrd"), 2);
  EXPECT_EQ(times("volume.nrrd --strip"), 1);
  EXPECT_EQ(times("volume.nrrd --max-error 3"), 1);
  EXPECT_EQ(times("volume.nrrd --resume"), 2);
  EXPECT_EQ(times("-", content("volume.nrrd")), 1);
  // A search reads the volume for its range and for each try, here all of it.
  EXPECT_GE(times("volume.nrrd --psnr 40"), 4);
  EXPECT_GE(times("volume.nrrd --ratio 30"), 4);
  EXPECT_EQ(times("volume.nrrd --relative-error 0.1"), 2);
  EXPECT_EQ(times("volume.nrrd --max-error noise:1"), 2);
}

TEST_F(Reports, StatisticsGoToTheStandardOutputIfNothingElseDoes) {
  // Names need not be text.
  phantom("volume\xff.nrrd");
  EXPECT_EQ(Json::parse(out("encode volume\xff.nrrd --json - -o volume.tag"))["output"], "volume.tag");
  fails("encode volume\xff.nrrd -fo - --json -", usage, "--json");
  EXPECT_TRUE(Json::accept(out("verify volume.tag --json -")));
  const Ending piped = tagrid({"encode", "-", "-o", "b.tag", "--json", "-"}, content("volume.tag"));
  expect_error(piped, broken_input, "standard input");
  EXPECT_EQ(piped.out, "");
}

TEST_F(Reports, StatisticsAppearWhenTheRunWasGood) {
  make_tag();
  file("kept.json", "{}");
  fails("decode volume.tag -o x.nrrd --json kept.json", usage, "kept.json");
  fails("decode volume.tag -o x.nrrd --json x.nrrd", usage, "is the output");
  file("bad.tag", content("volume.tag").substr(0, 200));
  fails("decode bad.tag -o x.nrrd --json x.json", broken_input, "bad.tag");
  EXPECT_EQ(names(), (std::vector<std::string>{"bad.tag", "kept.json", "volume.nrrd", "volume.tag"}));
}

TEST_F(Reports, InfoSaysWhereTheSamplesLie) {
  const std::string head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 4 5\nencoding: raw\n";
  const auto encoded = [&](const std::string& fields) {
    file("a.nrrd", head + fields + "\n" + std::string(40, 'x'));
    works("encode a.nrrd -f");
    return tagrid({"info", "a.tag"}).out;
  };
  const auto expect_line = [](const std::string& text, const std::string& name, const std::string& value) {
    const std::string line = "\n" + name + std::string(16 - name.size(), ' ') + value + "\n";
    EXPECT_TRUE(has(text, line));
  };
  std::string text = encoded(
      "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,-2)\n"
      "space origin: (10,20,-30.5)\nspace units: \"mm\" \"mm\" \"mm\"\nkinds: domain domain domain\n");
  expect_line(text, "spacing", "0.5 x 0.5 x 2 mm");
  expect_line(text, "physical size", "1 x 2 x 10 mm");
  expect_line(text, "directions", "(0.5, 0, 0) (0, 0.5, 0) (0, 0, -2)");
  expect_line(text, "origin", "(10, 20, -30.5)");
  expect_line(text, "space", "left-posterior-superior");
  Json json = info("a.tag")["geometry"];
  EXPECT_EQ(json["spacing"], Json({0.5, 0.5, 2}));
  EXPECT_EQ(json["directions"], Json::parse("[[0.5,0,0],[0,0.5,0],[0,0,-2]]"));
  EXPECT_EQ(json["origin"], Json({10, 20, -30.5}));
  EXPECT_EQ(json["space"], "left-posterior-superior");
  EXPECT_EQ(json["units"], Json({"mm", "mm", "mm"}));
  text = encoded("spacings: 0.7 nan -1.25\nunits: \"mm\" \"\" \"cm\"\n");
  expect_line(text, "spacing", "0.7 mm x unknown x -1.25 cm");
  expect_line(text, "physical size", "1.4 mm x unknown x 6.25 cm");
  json = info("a.tag")["geometry"];
  EXPECT_EQ(json["spacing"], Json::parse("[0.7,null,-1.25]"));
  EXPECT_EQ(json["units"], Json::parse("[\"mm\",null,\"cm\"]"));
  EXPECT_TRUE(json["directions"].is_null() && json["origin"].is_null() && json["space"].is_null());
  expect_line(encoded(""), "geometry", "not given by the source");
  json = info("a.tag")["geometry"];
  for (const auto& [key, value] : json.items()) EXPECT_TRUE(value.is_null()) << key;
}

// Every second sample is a NaN.
TEST_F(Reports, SamplesThatAreNotFiniteDoNotCountInErrors) {
  std::string bytes;
  for (int i = 0; i < 10 * 10 * 10; ++i) {
    const float v = i % 2 ? NAN : static_cast<float>(i % 20 * 5) + static_cast<float>(i) * 0.013f;
    char raw[4];
    std::memcpy(raw, &v, 4);
    bytes.append(raw, 4);
  }
  file("v.raw", bytes);
  const Arguments raw = {"--dims", "10,10,10", "--type", "float32"};
  expect_ok(tagrid(with({"encode", "v.raw", "-q", "--max-error", "3", "--json", "run.json"}, raw)));
  works("decode v.tag -o back.raw");
  const std::string back = content("back.raw");
  double squares = 0, count = 0, low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    float was = 0, is = 0;
    std::memcpy(&was, bytes.data() + i, 4);
    std::memcpy(&is, back.data() + i, 4);
    if (!std::isfinite(was)) continue;
    squares += (double{is} - was) * (double{is} - was);
    low = std::min(low, double{was});
    high = std::max(high, double{was});
    ++count;
  }
  ASSERT_EQ(count, 500);
  ASSERT_GT(squares, 0);
  const double rmse = std::sqrt(squares / count);
  for (const Json& achieved : {info("v.tag")["achieved"], json_of("run.json")["achieved"]}) {
    EXPECT_NEAR(achieved["rmse"].get<double>(), rmse, 1e-9 * rmse);
    EXPECT_NEAR(achieved["psnr"].get<double>(), 20 * std::log10((high - low) / rmse), 1e-6);
  }
  expect_ok(tagrid(with({"verify", "v.tag", "-q", "--against", "v.raw"}, raw)));
  works("verify v.tag -q");
  // Nor if they are not restored.
  expect_ok(tagrid(with({"encode", "v.raw", "-qf", "--grid-only"}, raw)));
  EXPECT_LT(info("v.tag")["achieved"]["rmse"].get<double>(), 100);
  expect_ok(tagrid(with({"verify", "v.tag", "-q", "--against", "v.raw"}, raw)));
  works("verify v.tag -q");
}

}  // namespace
}  // namespace tagrid
