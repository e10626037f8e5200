// The manual page and the completions of shells name every option that exists, and no other.

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

  static std::string text_of(const std::string& path) {
    std::ifstream file(std::string(source) + "/" + path);
    EXPECT_TRUE(file) << path;
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static Words all_matches(const std::string& text, const std::string& pattern) {
    const std::regex regex(pattern);
    Words words;
    for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i) words.insert((*i)[1]);
    return words;
  }

  /// The commands that `tagrid --help` lists.
  Words commands() const {
    const std::string help = tagrid({"--help"}).out;
    return all_matches(help.substr(help.find("Commands:")), "\n  ([a-z]+) ");
  }
  /// The options of a command, short and long; those of the program itself for "".
  Words options(const std::string& command) const {
    const std::string help = tagrid(command.empty() ? Arguments{"--help"} : Arguments{command, "--help"}).out;
    Words words = all_matches(help, "\n  (--[a-z-]+)");
    words.merge(all_matches(help, "\n  (-[a-zA-Z])\\b"));
    words.merge(all_matches(help, "\n  -[a-zA-Z],(--[a-z-]+)"));
    return words;
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
  for (const std::string& command : commands())
    EXPECT_EQ(tagrid({"help", command}).out, tagrid({command, "--help"}).out) << command;
  EXPECT_EQ(tagrid({"help", "nonsense"}).code, 64);
}

TEST_F(Documentation, NoLineOfAnyHelpIsWiderThan100Columns) {
  Words all = commands();
  all.insert("");
  for (const std::string& command : all) {
    std::istringstream help(tagrid(command.empty() ? Arguments{"--help"} : Arguments{command, "--help"}).out);
    for (std::string line; std::getline(help, line);) EXPECT_LE(line.size(), 100U) << command << ": " << line;
  }
}

TEST_F(Documentation, HelpNamesTheValueOfEveryOptionThatHasOne) {
  for (const std::string& command : commands()) {
    const std::string help = tagrid({command, "--help"}).out;
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

TEST_F(Documentation, TheManualNamesEveryOptionAndNoOther) {
  const std::string manual = text_of("docs/tagrid.1");
  Words listed, mentioned;
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
  const std::string manual = text_of("docs/tagrid.1");
  EXPECT_EQ(all_matches(manual.substr(manual.find("The commands are"), manual.find(".Sh OPTIONS")),
                        "\n\\.It Cm ([a-z]+)"),
            commands());
  const Words codes = all_matches(text_of("tools/report/failure.h"), "int exit_[a-z_]+ = ([0-9]+);");
  EXPECT_EQ(all_matches(manual, "\n\\.It ([0-9]+)\n"), codes);
  EXPECT_GE(codes.size(), 5U);
}

TEST_F(Documentation, TheManualIsWellFormed) {
  if (script("command -v mandoc").code != 0) GTEST_SKIP() << "mandoc is not installed";
  EXPECT_EQ(script("mandoc -Tlint -Wwarning " + std::string(source) + "/docs/tagrid.1").out, "");
}

TEST_F(Documentation, BashCompletesEveryOptionAndNoOther) {
  const auto completed = [&](const std::string& words) {
    const Ending ending = script(
        "source " + std::string(source) + "/tools/completion/tagrid.bash; COMP_WORDS=(tagrid " + words +
        "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _tagrid; printf '%s\\n' \"${COMPREPLY[@]}\"");
    expect_ok(ending);
    return all_matches("\n" + ending.out, "\n([^\n]+)");
  };
  EXPECT_EQ(completed("''"), commands());
  EXPECT_EQ(completed("-"), options(""));
  for (const std::string& command : commands())
    EXPECT_EQ(completed(command + " -"), options(command)) << command;
  EXPECT_EQ(completed("encode --ma"), (Words{"--max-error", "--max-level"}));
  EXPECT_EQ(completed("decode x.tag --format n"), (Words{"nrrd", "nhdr", "nifti", "nifti.gz"}));
  EXPECT_EQ(completed("decode --format = r"), Words{"raw"});
}

// A second list of formats in a help text would become outdated.
TEST_F(Documentation, HelpRefersToOneListOfFormats) {
  for (const char* command : {"encode", "estimate"})
    EXPECT_TRUE(has(tagrid({command, "--help"}).out, "tagrid formats")) << command;
  for (const std::string& command : commands()) {
    const std::string help = tagrid({command, "--help"}).out;
    EXPECT_FALSE(has(help, "NRRD, ")) << command;
    EXPECT_FALSE(has(help, "NRRD or ")) << command;
  }
}

TEST_F(Documentation, EveryFormatThatIsWrittenIsOneOfFormat) {
  std::string words, choice;
  for (const Format* format : written_formats()) {
    words += (words.empty() ? "" : " ") + std::string(format->name);
    choice += (choice.empty() ? "" : " | ") + std::string(format->name);
  }
  EXPECT_TRUE(has(text_of("docs/tagrid.1"), ".It Fl -format Cm " + choice + "\n"));
  EXPECT_TRUE(has(text_of("tools/completion/tagrid.bash"), "values='" + words + "'"));
  EXPECT_TRUE(has(text_of("tools/completion/_tagrid"), ":format:(" + words + ")"));
  const std::string help = tagrid({"decode", "--help"}).out;
  for (const Format* format : written_formats())
    EXPECT_TRUE(has(help, std::string(format->name) + " (" + std::string(format->help).substr(0, 6)));
}

TEST_F(Documentation, ZshCompletesEveryOptionAndNoOther) {
  std::string text = text_of("tools/completion/_tagrid");
  // The description of an option, and the completion of its value, may look like an option.
  text = std::regex_replace(text, std::regex("\\[[a-zA-Z0-9 ,.-]*\\]"), "");
  text = std::regex_replace(text, std::regex("_arguments -[sC]|_files -g"), "");
  const auto part = [&](const std::string& start, const std::string& end) {
    const std::size_t at = text.find("\n" + start);
    EXPECT_NE(at, text.npos) << start;
    return at == text.npos ? "" : text.substr(at, text.find("\n" + end, at + 1) - at);
  };
  for (const std::string& command : commands()) {
    std::string body = part("_tagrid_" + command + "() {", "}");
    for (const char* array : {"run", "memory", "spool", "report", "output", "removal", "error", "encoding",
                              "source", "headerless"})
      if (body.find("$_tagrid_" + std::string(array)) != body.npos)
        body += array == std::string("report") ? part("_tagrid_report=(", "_tagrid_removal")
                                               : part("_tagrid_" + std::string(array) + "=(", ")");
    if (body.find("$_tagrid_format") != body.npos) body += part("_tagrid_format=(", "_tagrid_tag");
    EXPECT_EQ(all_matches(body, "[ '\"{,(*)](--?[a-zA-Z][a-z-]*)"), options(command)) << command;
  }
  EXPECT_EQ(all_matches(part("_tagrid() {", "}"), "\n    '([a-z]+):"), commands());
  if (script("command -v zsh").code == 0)
    expect_ok(script("zsh -n " + std::string(source) + "/tools/completion/_tagrid"));
}

}  // namespace
}  // namespace tagrid
