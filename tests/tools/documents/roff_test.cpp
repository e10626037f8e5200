// The Markdown of docs/options.in becomes roff, and what is in that file twice, or nowhere, is found.
#include "tools/documents/roff.h"

#include <gtest/gtest.h>

#include "tools/documents/texts.h"

namespace tagrid {
namespace {

TEST(Roff, HasEachSentenceOnALineOfItsOwn) {
  EXPECT_EQ(roff("One, 2.5 of it. Two\nis longer. `-o` is three."),
            "One, 2.5 of it.\nTwo is longer.\n\\fB\\-o\\fR is three.\n");
}

TEST(Roff, ShowsMarksAsFonts) {
  EXPECT_EQ(roff("`--max-error` of *E*, in `a.tag`"),
            "\\fB\\-\\-max\\-error\\fR of \\fIE\\fR, in \\fIa.tag\\fR\n");
  EXPECT_EQ(roff("2 \\* 3, see [Memory](#memory)"), "2 * 3, see \\fIMemory\\fR\n");
}

// A line that begins with a dot or an apostrophe is a request.
TEST(Roff, HasNoRequestsInTexts) {
  EXPECT_EQ(roff(".tag is added"), "\\&.tag is added\n");
  EXPECT_EQ(roff("'a' is not"), "\\&'a' is not\n");
  EXPECT_EQ(roff_text("a\\b"), "a\\eb");
}

TEST(Roff, HasListsAndParagraphs) {
  EXPECT_EQ(roff("a\n- b\n  c\n- d\n\ne\n\nf"),
            "a\n.Bl -bullet -compact\n.It\nb c\n.It\nd\n.El\n.Pp\ne\n.Pp\nf\n");
  EXPECT_EQ(roff("- b"), ".Bl -bullet -compact\n.It\nb\n.El\n");
  EXPECT_EQ(roff(""), "");
}

TEST(Roff, HasTheFormsOfACommand) {
  EXPECT_EQ(roff_form("tagrid mesh --level N [options] in.tag [-o FILE]"),
            ".Nm\n.Cm mesh\n.Fl -level\n.Ar N\n.Op Ar options\n.Ar in.tag\n.Op Fl o Ar FILE\n");
}

TEST(Texts, AreThoseOfCommandsAndOfOptionsInSections) {
  const Texts texts = texts_in(
      "not used\n\n# Commands\n\n## info\n\n```\ntagrid info in.tag\n```\n\nPrints.\n\n# Options\n\n## "
      "All\n\nIntro.\n\n### "
      "--json\n\nOne.\n\nTwo.\n");
  EXPECT_EQ(texts.commands.at("info").forms, std::vector<std::string>{"tagrid info in.tag"});
  EXPECT_EQ(texts.commands.at("info").text, "Prints.");
  ASSERT_EQ(texts.sections.size(), 1U);
  EXPECT_EQ(texts.sections[0].text, "Intro.");
  EXPECT_EQ(texts.sections[0].options.at(0).name, "--json");
  EXPECT_EQ(texts.sections[0].options.at(0).text, "One.\n\nTwo.");
  EXPECT_THROW(texts_in("# Commands\n\nlost\n"), std::runtime_error);
}

TEST(Texts, AreThereForEachOptionOnce) {
  const auto texts = [](const std::string& options) {
    return texts_in("# Commands\n\n## info\n\n# Options\n\n## All\n\n" + options);
  };
  CommandOption json, level;
  json.names = {"--json"};
  level.names = {"-l", "--level"};
  Command info;
  info.name = "info";
  info.options = {json, level};
  EXPECT_NO_THROW(compare(texts("### --json\n\n### --level\n"), {info}));
  EXPECT_THROW(compare(texts("### --json\n"), {info}), std::runtime_error);
  EXPECT_THROW(compare(texts("### --json\n\n### --level\n\n### --level\n"), {info}), std::runtime_error);
  EXPECT_THROW(compare(texts("### --json\n\n### --level\n"), {}), std::runtime_error);
}

}  // namespace
}  // namespace tagrid
