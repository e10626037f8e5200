// Text from files, names and lists is shown without the terminal acting on it.
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

class PrintableOutput : public CommandLine {
 protected:
  static void expect_harmless(const Ending& ending) {
    for (const std::string& text : {ending.out, ending.err})
      for (const char c : text) EXPECT_TRUE(c == '\n' || (c >= 32 && c < 127)) << static_cast<int>(c) << text;
  }
  const std::string name_ = "a\x1b[31m\xff\x9b\n.nrrd", tag_ = "a\x1b[31m\xff\x9b\n.tag";
};

TEST_F(PrintableOutput, NamesOfFilesAreNotObeyed) {
  phantom(name_);
  const std::vector<Arguments> commands = {{"encode", name_, "-v"},
                                           {"encode", name_},
                                           {"encode", name_ + "x"},
                                           {"decode", tag_, "-o", "x.nrrd", "-v"},
                                           {"decode", tag_},
                                           {"verify", tag_, "--against", name_},
                                           {"info", tag_},
                                           {"info", name_},
                                           {"mesh", tag_, "-v", "-o", "x.vtu"},
                                           {"encode", "x", name_},
                                           {"encode", "--" + name_},
                                           {name_}};
  for (const Arguments& command : commands) expect_harmless(tagrid(command));
  EXPECT_NE(tagrid({"info", name_}).err.find("a\\x1b[31m\\xff\\x9b\\n.nrrd"), std::string::npos);
  const Ending bar = tagrid({"encode", name_, "-f", "--progress=bar"});
  EXPECT_EQ(bar.err.find("\x1b[31m"), std::string::npos);
}

TEST_F(PrintableOutput, AListAndItsVolumesAreNotObeyed) {
  const std::string name = "a\x1b[31m\xff.nrrd";
  phantom(name);
  file("list", name + "\n");
  expect_harmless(tagrid({"convert", "--manifest", "list", "--output-dir", "out", "-v"}));
  expect_harmless(tagrid({"convert", "--manifest", "list", "--output-dir", "out"}));
  const Ending bar = tagrid({"convert", "--manifest", "list", "--output-dir", "out", "-f", "--progress=bar"});
  EXPECT_EQ(bar.err.find("\x1b[31m"), std::string::npos);
  std::istringstream lines(content("out/results.jsonl"));
  for (std::string line; std::getline(lines, line);) EXPECT_TRUE(nlohmann::json::accept(line)) << line;
}

TEST_F(PrintableOutput, HeadersAreNotObeyed) {
  const std::string space = "\x1b[31m\xff\x9b", head =
                                                    "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\n"
                                                    "encoding: raw\nspacings: 1 1 1\n";
  file("a.nrrd", head + "space: " + space + "\nunits: \"" + space + "\" \"b\" \"c\"\n\n12345678");
  expect_harmless(tagrid({"encode", "a.nrrd", "-v"}));
  const Ending info = tagrid({"info", "a.tag"});
  expect_harmless(info);
  EXPECT_NE(info.out.find("\\x1b[31m\\xff\\x9b"), std::string::npos) << info.out;
  EXPECT_EQ(nlohmann::json::parse(tagrid({"info", "a.tag", "--json"}).out)["geometry"]["space"],
            "\x1b[31m\xEF\xBF\xBD\xEF\xBF\xBD");
  file("b.nrrd", head + "kinds: " + space + " domain domain\n\n12345678");
  expect_harmless(tagrid({"encode", "b.nrrd"}));
  file("c.nrrd", head + "data file: " + space + "\n\n");
  expect_harmless(tagrid({"encode", "c.nrrd"}));
}

}  // namespace
}  // namespace tagrid
