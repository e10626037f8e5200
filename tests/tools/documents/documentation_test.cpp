// What is made of the program's help: the manual page, the completions of shells, docs/options.md, and the examples.

// gcc 12 with sanitizers warns about the standard library's own code.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <regex>
#include <set>

#include "io/formats/table/formats.h"
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

using Words = std::set<std::string>;

class Documentation : public CommandLine {
 protected:
  static constexpr const char* source = TAGRID_SOURCE_DIR;

  static constexpr const char* documents = TAGRID_DOCUMENTS;

  static std::string content_of(const std::string& path) {
    std::ifstream file(path);
    EXPECT_TRUE(file) << path;
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::string text_of(const std::string& path) { return content_of(std::string(source) + "/" + path); }
  static std::string made(const std::string& name) { return content_of(std::string(documents) + "/" + name); }
  static Words all_matches(const std::string& text, const std::string& pattern) {
    const std::regex regex(pattern);
    Words words;
    for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i) words.insert((*i)[1]);
    return words;
  }

  /// With plain hyphens.
  static std::string manual_page() { return std::regex_replace(made("tagrid.1"), std::regex(R"(\\-)"), "-"); }

  /// The help of a command of one or two words; that of the program for "".
  std::string help_of(const std::string& command) const {
    Arguments words;
    std::istringstream text(command);
    for (std::string word; text >> word;) words.push_back(word);
    words.push_back("--help");
    return tagrid(words).out;
  }
  /// The commands that such a help lists.
  Words listed_by(const std::string& command) const {
    const std::string help = help_of(command);
    const std::size_t at = help.find("\nCommands:");
    return at == help.npos ? Words() : all_matches(help.substr(at), "\n  ([a-z]+) ");
  }
  /// All commands, those of groups by two words.
  Words commands() const {
    Words all;
    for (const std::string& word : listed_by("")) {
      const Words seconds = listed_by(word);
      if (seconds.empty()) all.insert(word);
      for (const std::string& second : seconds) all.insert(word + " " + second);
    }
    return all;
  }
  /// The options of a command, short and long; those of the program itself for "".
  Words options(const std::string& command) const {
    const std::string help = help_of(command);
    Words words = all_matches(help, "\n  (--[a-z0-9-]+)");
    words.merge(all_matches(help, "\n  (-[a-zA-Z])\\b"));
    words.merge(all_matches(help, "\n  -[a-zA-Z],(--[a-z0-9-]+)"));
    return words;
  }
  template <class Can>
  static Words names_of_formats(Can can) {
    Words names;
    for (const Format& format : formats())
      if (can(format)) names.emplace(format.name);
    return names;
  }
  Words all_options() const {
    Words all = options("");
    for (const std::string& command : commands()) all.merge(options(command));
    return all;
  }
};

TEST_F(Documentation, HelpIsGivenForACommandOfThatName) {
  EXPECT_EQ(tagrid({"help"}).out, tagrid({"--help"}).out);
  EXPECT_EQ(tagrid({"help"}).code, 0);
  for (const std::string& command : listed_by(""))
    EXPECT_EQ(tagrid({"help", command}).out, help_of(command)) << command;
  EXPECT_EQ(tagrid({"help", "archive", "check"}).out, help_of("archive check"));
  EXPECT_EQ(tagrid({"help", "nonsense"}).code, 64);
}

TEST_F(Documentation, NoLineOfAnyHelpIsWiderThan100Columns) {
  Words all = commands();
  all.merge(listed_by(""));
  all.insert("");
  for (const std::string& command : all) {
    std::istringstream help(help_of(command));
    for (std::string line; std::getline(help, line);) EXPECT_LE(line.size(), 100U) << command << ": " << line;
  }
}

TEST_F(Documentation, HelpNamesTheValueOfEveryOptionThatHasOne) {
  for (const std::string& command : commands()) {
    const std::string help = help_of(command);
    // What CLI11 prints where an option does not name its value.
    for (const char* type : {" TEXT", " INT", " UINT", " FLOAT", " REQUIRED", " Excludes:"})
      EXPECT_FALSE(has(help, type)) << command << type;
  }
  const std::string help = tagrid({"encode", "--help"}).out;
  for (const char* option :
       {"  -T,--threads <N> ", "  --cube <S> ", "  --effort <fast|default|best> ", "  -o,--output <FILE> "})
    EXPECT_TRUE(has(help, option)) << option << help;
  EXPECT_TRUE(has(tagrid({"surface", "--help"}).out, "  --iso <V> (required) "));
}

TEST_F(Documentation, EveryHelpEndsWithTwoExamplesOf80Columns) {
  Words all = commands();
  all.insert("");
  for (const std::string& command : all) {
    const std::string help = help_of(command);
    const std::size_t at = help.find("\n\nExamples:\n");
    ASSERT_NE(at, help.npos) << command;
    std::istringstream lines(help.substr(at + 12));
    int count = 0;
    for (std::string wish, line; std::getline(lines, wish) && std::getline(lines, line); ++count) {
      EXPECT_LE(std::max(wish.size(), line.size()), 80U) << line;
      EXPECT_TRUE(wish.starts_with("  ") && wish.ends_with(":")) << wish;
      EXPECT_TRUE(line.starts_with("    tagrid " + command)) << line;
    }
    EXPECT_EQ(count, 2) << command;
  }
}

TEST_F(Documentation, TheReferenceIsWhatTheProgramMakes) {
  EXPECT_TRUE(text_of("docs/options.md") == made("options.md"))
      << "docs/options.md is not what follows from the help and docs/options.in; this rewrites it: cp "
      << documents << "/options.md " << source << "/docs/options.md";
}

TEST_F(Documentation, TheReferenceHasAHeadingForEveryCommandAndOption) {
  Words headings = commands();
  for (const std::string& option : all_options())
    if (option.starts_with("--")) headings.insert(option);
  EXPECT_EQ(all_matches(made("options.md"), "\n### ([^\n]+)"), headings);
}

TEST_F(Documentation, AnOptionWithoutTextIsFound) {
  const std::string folder = path("docs");
  std::filesystem::create_directory(folder);
  std::string texts = text_of("docs/options.in");
  const std::string heading = "### --max-level\n";
  texts.replace(texts.find(heading), heading.size(), "### --max-lever\n");
  std::ofstream(folder + "/options.in") << texts;
  std::ofstream(folder + "/tagrid.1.in") << text_of("docs/tagrid.1.in");
  const Ending ending = script(std::string(TAGRID_DOCUMENTS_PROGRAM) + " " + folder + " " + folder);
  EXPECT_EQ(ending.code, 65);
  EXPECT_TRUE(has(ending.err, "without a heading: --max-level; not in the program, or twice: --max-lever"))
      << ending.err;
}

TEST_F(Documentation, TheManualNamesEveryOptionAndNoOther) {
  const std::string manual = manual_page();
  // Those of the texts are only in bold.
  Words listed, mentioned = all_matches(manual, R"(\\fB(--?[a-zA-Z][a-zA-Z0-9-]*))");
  std::istringstream lines(manual);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    bool flags = false;
    for (std::string word; words >> word;) {
      if (word == "Fl" || word == ".Fl") {
        flags = true;
      } else if (word == "Ar" || word == "Cm" || word == ".") {
        flags = false;
      } else if (flags && word != "," && word != "|" && word != ":" && word != ";") {
        mentioned.insert("-" + word);
        if (line.starts_with(".It ")) listed.insert("-" + word);
      }
    }
  }
  EXPECT_EQ(listed, all_options());
  for (const std::string& option : mentioned) EXPECT_TRUE(listed.contains(option)) << option;
}

TEST_F(Documentation, TheManualNamesEveryCommandAndExitCode) {
  const std::string manual = made("tagrid.1");
  EXPECT_EQ(all_matches(manual.substr(manual.find("The commands are"), manual.find(".Sh OPTIONS")),
                        "\n\\.It Cm ([a-z ]+)"),
            commands());
  const Words codes = all_matches(text_of("tools/report/failure.h"), "int exit_[a-z_]+ = ([0-9]+);");
  EXPECT_EQ(all_matches(manual, "\n\\.It ([0-9]+)\n"), codes);
  EXPECT_GE(codes.size(), 5U);
}

TEST_F(Documentation, TheManualIsWellFormed) {
  if (script("command -v mandoc").code != 0) GTEST_SKIP() << "mandoc is not installed";
  EXPECT_EQ(script("mandoc -Tlint -Wwarning " + std::string(documents) + "/tagrid.1").out, "");
}

class BashCompletion : public Documentation {
 protected:
  /// What bash offers after these words, the last of which is what was typed of the next one; in the directory of
  /// the test.
  Words completed(const std::string& words) const {
    const Ending ending =
        script("source " + std::string(documents) + "/tagrid.bash; COMP_WORDS=(tagrid " + words +
               "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _tagrid; printf '%s\\n' \"${COMPREPLY[@]}\"");
    expect_ok(ending);
    return all_matches("\n" + ending.out, "\n([^\n]+)");
  }
};

TEST_F(BashCompletion, HasEveryOptionAndNoOther) {
  EXPECT_EQ(completed("''"), listed_by(""));
  EXPECT_EQ(completed("help ''"), listed_by(""));
  EXPECT_EQ(completed("archive ''"), listed_by("archive"));
  EXPECT_EQ(completed("-"), options(""));
  for (const std::string& command : commands())
    EXPECT_EQ(completed(command + " -"), options(command)) << command;
  EXPECT_EQ(completed("encode --ma"), (Words{"--max-error", "--max-level"}));
}

TEST_F(BashCompletion, OffersTheValuesOfOptions) {
  EXPECT_EQ(completed("decode x.tag --format n"), (Words{"nrrd", "nhdr", "nifti", "nifti.gz", "npy"}));
  EXPECT_EQ(completed("decode --format = r"), Words{"raw"});
  EXPECT_EQ(completed("encode --from ''"),
            names_of_formats([](const Format& format) { return format.reads.any(); }));
  EXPECT_EQ(completed("decode --format ''"),
            names_of_formats([](const Format& format) { return format.writes.any(); }));
  EXPECT_EQ(completed("encode --effort ''"), (Words{"fast", "default", "best"}));
  EXPECT_EQ(completed("encode --type f"), (Words{"float32", "float64"}));
  EXPECT_EQ(completed("encode --range ''"), Words{"auto"});
  EXPECT_EQ(completed("encode --lead ''"), (Words{"0", "1"}));
}

TEST_F(BashCompletion, OffersFilesOrDirectoriesAsFits) {
  std::filesystem::create_directory(path("folder"));
  for (const char* name : {"scan.tag", "scan.nhdr"}) std::ofstream(path(name)) << "";
  EXPECT_EQ(completed("encode --spool ''"), Words{"folder"});
  EXPECT_EQ(completed("restore x.tag -o ''"), Words{"folder"});
  EXPECT_EQ(completed("convert --find f"), Words{"folder"});
  EXPECT_EQ(completed("encode --json s"), (Words{"scan.tag", "scan.nhdr"}));
  EXPECT_EQ(completed("encode s"), (Words{"scan.tag", "scan.nhdr"}));
  EXPECT_EQ(completed("info ''"), (Words{"folder", "scan.tag"}));
  EXPECT_EQ(completed("info --json ''"), (Words{"folder", "scan.tag"}));
  EXPECT_EQ(completed("info scan.n"), Words{"scan.nhdr"});
  EXPECT_EQ(completed("encode --accuracy ''"), Words{});
  EXPECT_EQ(completed("formats ''"), Words{});
}

TEST_F(BashCompletion, IsGoodStyle) {
  if (script("command -v shellcheck").code != 0) GTEST_SKIP() << "shellcheck is not installed";
  const Ending ending = script("shellcheck --shell=bash " + std::string(documents) + "/tagrid.bash");
  EXPECT_EQ(ending.code, 0) << ending.out;
}

// A second list of formats in a help text would become outdated.
TEST_F(Documentation, HelpRefersToOneListOfFormats) {
  for (const char* command : {"encode", "estimate"})
    EXPECT_TRUE(has(tagrid({command, "--help"}).out, "tagrid formats")) << command;
  for (const std::string& command : commands()) {
    const std::string help = help_of(command);
    EXPECT_FALSE(has(help, "NRRD, ")) << command;
    EXPECT_FALSE(has(help, "NRRD or ")) << command;
  }
}

TEST_F(Documentation, EveryFormatThatIsWrittenIsOneOfFormat) {
  const std::string help = tagrid({"decode", "--help"}).out, manual = manual_page();
  for (const Format* format : written_formats()) {
    const std::string described = std::string(format->name) + " (" + std::string(format->help).substr(0, 6);
    EXPECT_TRUE(has(help, described)) << described;
    EXPECT_TRUE(has(manual, "\n.It\n" + described)) << described;
  }
}

TEST_F(Documentation, ZshCompletesEveryOptionAndNoOther) {
  const std::string text = made("_tagrid");
  for (const std::string& command : commands()) {
    const std::size_t at =
        text.find("\n_tagrid_" + std::regex_replace(command, std::regex(" "), "_") + "() {");
    ASSERT_NE(at, text.npos) << command;
    const std::string body = text.substr(at, text.find("\n}", at + 1) - at);
    // An option is before its description, alone or as {-o+,--output=}; (-o --output) is what it excludes.
    Words completed = all_matches(body, R"(\n    '(?:\([^)]*\))?\*?(--?[a-zA-Z][a-z0-9-]*)=?\[)");
    for (const std::string& pair : all_matches(body, R"('\{([^}]*)\}')"))
      completed.merge(all_matches(pair, "(--?[a-zA-Z][a-z0-9-]*)"));
    EXPECT_EQ(completed, options(command)) << command;
  }
  EXPECT_EQ(all_matches(text.substr(text.rfind("local -a commands")), "\n    '([a-z]+):"), listed_by(""));
  for (const auto& [option, words] :
       {std::pair("--from=", names_of_formats([](const Format& format) { return format.reads.any(); })),
        std::pair("--effort=", Words{"fast", "default", "best"})}) {
    const Words lists = all_matches(text, std::string(option) + R"(\[[^\n]*:\(([^)]*)\)')");
    ASSERT_EQ(lists.size(), 1U) << option;
    EXPECT_EQ(all_matches(*lists.begin(), "([^ ]+)"), words);
  }
  EXPECT_TRUE(has(text, "'--spool=[Directory for temporary files]:DIR:_files -/'"));
  if (script("command -v zsh").code == 0) expect_ok(script("zsh -n " + std::string(documents) + "/_tagrid"));
}

}  // namespace
}  // namespace tagrid
