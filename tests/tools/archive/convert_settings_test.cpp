// Settings that differ in one option: a volume that was encoded with the one is not done, and is not removed,
// for a list that asks for the other.
#include <set>

#include "io/errors/errors.h"
#include "tests/support/conversions.h"
#include "tools/options/encoding_options.h"

namespace tagrid {
namespace {

struct Pair {
  std::string option, one, other;  ///< values of the option; "" if it is not given
  std::string with = "";           ///< what both have besides
  const char* input = "a.nrrd";
  bool both_ways = true;  ///< The volume can be encoded with either value.
};

// A sample of a.nrrd stands for 0.1.
const std::vector<Pair> pairs = {
    {"max-error", "0.9", "0.1"},
    {"max-error", "0.9", ""},
    {"max-error", "0.9", "0"},
    {"max-error", "0.2", "0.4"},
    {"max-error", "noise:1", "noise:2"},
    {"max-error", "noise:1", "0.4"},
    {"relative-error", "0.01", "0.02"},
    {"psnr", "40", "45"},
    {"ratio", "6", "9"},
    {"bits", "2", "3"},
    {"threshold", "8", "9", "max-error=0.9"},
    {"threshold", "8", "", "max-error=0.9"},
    {"surface-error", "0.1", "0.2", "max-error=0.9"},
    {"surface-error", "0.1", "", "max-error=0.9"},
    {"mesh-error", "1", "2"},
    {"mesh-error", "1", ""},
    {"grid-only", "true", "", "max-error=0.9"},
    {"grid", "derived", "stored", "max-error=0.9"},
    {"effort", "best", "fast"},
    {"effort", "best", ""},
    {"accuracy", "10", ""},
    {"cube", "16", ""},
    {"lead", "0", ""},
    {"brick", "1", "2"},
    {"max-level", "6", "7"},
    {"max-level", "6", ""},
    {"range", "0:100", "0:200"},
    {"range", "auto", ""},
    {"field-scale", "0.5", "0.25"},
    {"field-scale", "0.5", ""},
    {"strip", "true", ""},
    {"parity", "5%", "10%"},
    {"overviews", "4", "none"},
    {"dims", "9,8,7", "8,9,7", "type=uint8", "c.raw"},
    {"type", "uint8", "int8", "dims=9,8,7", "c.raw"},
    {"endian", "big", "little", "type=int16\tdims=9,8,7", "d.raw"},
    {"offset", "1", "0", "type=uint8\tdims=9,8,6", "e.raw", false},
    {"spacing", "1,1,2", "1,1,3", "type=uint8\tdims=9,8,7", "c.raw"},
    {"override-spacing", "1,1,2", "1,1,3"},
};

// These choose a reader, or one of several volumes; their texts are compared.
const std::set<std::string> choices = {"series", "dataset", "vdb-grid", "gaps-ok", "data-outside", "from"};

class ConvertSettings : public Conversions<CommandLine> {
 protected:
  void SetUp() override {
    Conversions::SetUp();
    works("phantom --dims 21,18,13 --seed 1 -qfo p.raw");
    const std::string head =
        "NRRD0004\ntype: int16\ndimension: 3\nsizes: 21 18 13\nencoding: raw\nendian: little\nspacings: 1 1 "
        "1\n";
    file("a.nrrd", head + "rescale_slope:=0.1\nrescale_intercept:=0\n\n" + content("p.raw"));
    std::string bytes;
    for (int i = 0; i < 2 * 9 * 8 * 7; ++i) bytes += static_cast<char>(i % 9 + i / 72);
    file("d.raw", bytes);
    file("c.raw", bytes.substr(0, 9 * 8 * 7));
    file("e.raw", bytes.substr(0, 1 + 9 * 8 * 6));
  }

  /// Without the sentence that a bound of values is one of samples.
  Ending convert_quietly(const Arguments& more = {}) const { return convert(with({"-q"}, more)); }

  void list(const Pair& pair, const std::string& value) const {
    std::string line = pair.input;
    if (!pair.with.empty()) line += "\t" + pair.with;
    if (!value.empty()) line += "\t" + pair.option + "=" + value;
    file("list.tsv", line + "\n");
  }

  void expect_other_work(const Pair& pair, const std::string& was, const std::string& now) const {
    SCOPED_TRACE(pair.option + " was \"" + was + "\", now \"" + now + "\"");
    list(pair, was);
    std::filesystem::remove_all(path("out"));
    expect_ok(convert_quietly());
    const std::string output = outputs().front(), bytes = content("out/" + output);
    list(pair, now);
    EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
    EXPECT_EQ(last()["status"], "failed");
    EXPECT_TRUE(content("out/" + output) == bytes);
    // Without the record of that failure, too.
    const Json first = records().front();
    file("out/results.jsonl", first.dump() + "\n");
    EXPECT_NE(convert({"--remove-verified", "--trust-description"}).code, 0);
    EXPECT_TRUE(exists(pair.input));
    file("out/results.jsonl", first.dump() + "\n");
    const Ending again = convert({"--skip-done", "-f"});
    if (again.code != 0) return;  // the other settings do not suit the volume
    EXPECT_EQ(last()["status"], "ok");
    EXPECT_FALSE(content("out/" + output) == bytes);
  }
};

TEST_F(ConvertSettings, ThatDifferInOneOptionAreOtherWorkAndRemoveNothing) {
  for (const Pair& pair : pairs) {
    expect_other_work(pair, pair.one, pair.other);
    if (pair.both_ways) expect_other_work(pair, pair.other, pair.one);
  }
}

TEST_F(ConvertSettings, OfEveryOptionAreCompared) {
  std::set<std::string> compared = choices;
  for (const Pair& pair : pairs) compared.insert(pair.option);
  for (const auto& row : encoding_rows()) EXPECT_TRUE(compared.contains(row.name)) << row.name;
}

TEST_F(ConvertSettings, ThatAreUsedAlikeAreTheSameWork) {
  for (const auto& [was, now] : {std::pair("max-error=0.9", "max-error=0.90"),
                                 {"max-error=0.95", "max-error=0.9"},
                                 {"", "max-error=0"},
                                 {"", "max-error=0.05"},
                                 {"", "effort=default\taccuracy=20\tcube=32\tgrid=stored"}}) {
    SCOPED_TRACE(std::string(was) + " and " + now);
    file("list.tsv", std::string("a.nrrd\t") + was + "\n");
    std::filesystem::remove_all(path("out"));
    expect_ok(convert_quietly());
    file("list.tsv", std::string("a.nrrd\t") + now + "\n");
    expect_ok(convert_quietly({"--skip-done"}));
    EXPECT_EQ(statuses(1), "a skipped");
  }
  expect_ok(convert_quietly({"--remove-verified"}));
  EXPECT_FALSE(exists("a.nrrd"));
}

// A later version may have other defaults.
TEST_F(ConvertSettings, OfAnotherVersionAreThoseThatItUsed) {
  file("list.tsv", "a.nrrd\n");
  expect_ok(convert_quietly());
  Json record = last();
  record["settings"]["accuracy"] = 25;
  file("out/results.jsonl", record.dump() + "\n");
  expect_failed(convert({"--skip-done"}), "was encoded with other options: accuracy was 25, now 20");
  expect_failed(convert({"--remove-verified"}), "accuracy was 25, now 20");
  EXPECT_TRUE(exists("a.nrrd"));
}

}  // namespace
}  // namespace tagrid
