// Text from files, names and lists is shown without the terminal acting on it.
#include "tools/report/printable.h"

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

TEST(Printable, TextStaysAsItIs) {
  for (const std::string text : {"", "scan 1.nrrd",
                                 "Sch\xC3\xA4"
                                 "del.tag",
                                 "\xE2\x82\xAC", "\xF0\x9F\xA9\xBB", "a\\b"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ControlCharactersAreEscaped) {
  EXPECT_EQ(printable("a\x1b[31mb"), "a\\x1b[31mb");
  EXPECT_EQ(printable("a\nb\tc\rd\x7f"), "a\\nb\\tc\\rd\\x7f");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\xc2\\x9b31m")
      << "a control character of two bytes";
  EXPECT_EQ(printable("\xE2\x80\xAE"), "\\xe2\\x80\\xae") << "turns the direction of what follows";
}

TEST(Printable, BytesThatAreNoUtf8AreEscaped) {
  EXPECT_EQ(printable("\xff"), "\\xff");
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "\\x9b31m");
  EXPECT_EQ(printable("\xC3"), "\\xc3") << "cut off";
  EXPECT_EQ(printable("\xC0\xAF"), "\\xc0\\xaf") << "longer than necessary";
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80") << "half a character of UTF-16";
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond all characters";
  EXPECT_EQ(printable("\xE2\x82"
                      "a"),
            "\\xe2\\x82a");
}

TEST(NamesInJson, ComeBackByteForByteAndAreUtf8) {
  EXPECT_EQ(text_of_name("x\xff.nrrd"),
            "x\xEF\xBF\xBD"
            "FF.nrrd");
  std::string every;
  for (int byte = 1; byte < 256; ++byte) every += static_cast<char>(byte);
  for (const std::string& name : {std::string(),
                                  std::string("Sch\xC3\xA4"
                                              "del \\t\n.tag"),
                                  every, std::string("\xEF\xBF\xBD"),
                                  std::string("\xEF\xBF\xBD"
                                              "FF"),
                                  std::string("\xED\xA0\x80\xff")}) {
    EXPECT_EQ(name_of_text(text_of_name(name)), name);
    EXPECT_EQ(nlohmann::json::parse(nlohmann::json(text_of_name(name)).dump()), text_of_name(name));
  }
  EXPECT_NE(text_of_name("\xff"), text_of_name("\xfe"));
  for (const char* text : {"a", "\xEF\xBF\xBD", "\xEF\xBF\xBD\x46", "\xEF\xBF\xBDgg"})
    EXPECT_EQ(name_of_text(text), text) << "as of older records";
}

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
