// Texts of files as messages show them.
#include "io/text/text.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

TEST(QuotedText, ShowsEveryCharacterThatCanBeShown) {
  EXPECT_EQ(quoted(std::string_view("\xc2\xb5m \xe2\x84\xab")), "\"\xc2\xb5m \xe2\x84\xab\"");
  EXPECT_EQ(quoted(std::string_view("a\x1b[31m\n\xb5m")), "\"a\\x1b[31m\\n\\xb5m\"")
      << "controls, and Latin-1";
}

TEST(QuotedText, IsCutBetweenCharacters) {
  const std::string front(59, 'a');
  EXPECT_EQ(quoted(std::string_view(front + "b")), "\"" + front + "b\"");
  EXPECT_EQ(quoted(std::string_view(front + "\xc2\xb5")), "\"" + front + "...\"");
  EXPECT_EQ(quoted(std::string_view(std::string(70, '\xb5'))).size(), 2 + 3 + 4 * 57U) << "no character";
}

}  // namespace
}  // namespace tagrid
