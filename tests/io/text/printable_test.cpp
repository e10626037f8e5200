// What is safe to print, and what JSON can hold.
#include "io/text/printable.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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

}  // namespace
}  // namespace tagrid
