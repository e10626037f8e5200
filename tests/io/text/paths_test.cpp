#include "io/text/paths.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>

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

TEST(Paths, AreAbsoluteNormalAndRelativeByNamesAlone) {
  const std::string here = text_of(std::filesystem::current_path());
  for (const auto& [text, absolute] : {std::pair<std::string, std::string>{"", ""},
                                       {"a", here + "/a"},
                                       {"./a/../b", here + "/./a/../b"},
                                       {"/a/..", "/a/.."},
                                       {"//a/b", "//a/b"}})
    EXPECT_EQ(text_of(absolute_path(path_of(text))), absolute) << text;
  // Two slashes are one, but on Windows.
  for (const auto& [text, normal] : {std::pair<std::string, std::string>{"", ""},
                                     {"a/./b/../c", "a/c"},
                                     {"/../a/", "/a/"},
                                     {"//a/b/../../c", "/c"},
                                     {"a/..", "."}})
    EXPECT_EQ(text_of(normal_path(path_of(text))), normal) << text;
  for (const auto& [text, relative] : {std::pair<std::string, std::string>{"/a/b", "."},
                                       {"/a/b/c/d", "c/d"},
                                       {"/a/c", "../c"},
                                       {"//a/b/c", "c"},
                                       {"b", ""}})
    EXPECT_EQ(text_of(relative_path(path_of(text), path_of("/a/b"))), relative) << text;
  EXPECT_TRUE(is_absolute(path_of("/a")) && is_absolute(path_of("//a/b")));
  EXPECT_FALSE(is_absolute(path_of("a")) || is_absolute(path_of("")));
  EXPECT_EQ(path_in("a", "b"), "a/b");
  EXPECT_EQ(path_in("a", "/b"), "/b");
  EXPECT_EQ(path_in("", "b"), "b");
}

}  // namespace
}  // namespace tagrid
