#include "io/text/paths.h"

#include <gtest/gtest.h>

#include <string>

namespace tagrid {
namespace {

TEST(Paths, NamesOfOthersStayInTheirFolder) {
  for (const char* name :
       {"a", "a/b", "..a", "a..", "...", "a/.b/c", " ", "\xff", "a\\b", "C:x", "a:stream", "CON"})
    EXPECT_TRUE(is_relative_name(name) && is_safe_name(name)) << name;
  for (const std::string name :
       {"", "/", "/a", "a/", "..", "../a", "a/../b", "a/..", "./a", ".", "a//b", "a/./b"})
    EXPECT_FALSE(is_relative_name(name) || is_safe_name(name)) << name;
  EXPECT_FALSE(is_relative_name(std::string("a\0b", 3)));
}

// From what Microsoft says of names: "Naming Files, Paths, and Namespaces".
TEST(Paths, NamesThatWindowsDoesNotTakeForFiles) {
  for (const char* name :
       {"a", "a/b", ".a", "..a", "a b", "Z\xC3\xBCrich/\xE7\x9B\xAE\xE5\xBD\x95", "console", "com", "com10",
        "comx", "lpt", "a.con", "nul_", "auxiliary/x.prnt", "com\xC2\xBD", "a'b&c;d"})
    EXPECT_TRUE(is_name_on_windows(name)) << name;
  for (const char* name : {"..\\..\\evil.nrrd",
                           "a\\b",
                           "C:x",
                           "C:\\x",
                           "\\\\server\\share",
                           "a:stream",
                           "a::$DATA",
                           "12:30.dcm",
                           "what?",
                           "*",
                           "a<b",
                           "a>b",
                           "a|b",
                           "\"a\"",
                           "a.",
                           "a ",
                           "...",
                           "a./b",
                           "a /b",
                           "CON",
                           "con",
                           "Prn.txt",
                           "aux.tar.gz",
                           "NUL",
                           "nul .x",
                           "COM1",
                           "com9.nii",
                           "COM0",
                           "LPT1",
                           "lpt\xC2\xB2",
                           "com\xC2\xB9.x",
                           "CONIN$",
                           "conout$",
                           "CLOCK$",
                           "a/nul/b",
                           "a\x1f",
                           "\n",
                           "\xff",
                           "\xC3"})
    EXPECT_FALSE(is_name_on_windows(name)) << name;
}

// Bytes that are not UTF-8 are legal in names here.
TEST(Paths, TextsAndPathsAreEachOther) {
  for (const std::string text :
       {"", "/", "a/b.nrrd", "../a//b/", "\xC3\xBC\xE7\x9B\xAE", "a\\b", "\xff\xC3"}) {
    EXPECT_EQ(text_of(path_of(text)), text);
    EXPECT_EQ(path_of(text).native(), text);
  }
}

}  // namespace
}  // namespace tagrid
