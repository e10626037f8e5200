#include "tools/options/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <sstream>

#include "io/text/paths.h"

namespace tagrid {
namespace {

constexpr std::size_t left_column = 32, right_column = 68;

/// Breaks lines between words, so that none is wider than the right column. Keeps the breaks of `text`.
std::string wrapped(const std::string& text) {
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::size_t width = 0;
    std::istringstream words(line);
    if (!result.empty()) result += '\n';
    for (std::string word; words >> word; width += word.size()) {
      const bool fits = width + 1 + word.size() <= right_column;
      if (width > 0) result += fits ? ' ' : '\n';
      width = width > 0 && fits ? width + 1 : 0;
      result += word;
    }
  }
  return result;
}

class HelpLayout : public CLI::Formatter {
 public:
  HelpLayout() {
    column_width(left_column);
    label("SUBCOMMAND", "COMMAND");
  }

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string help = CLI::Formatter::make_help(app, std::move(name), mode);
    // CLI11 puts two empty lines between groups.
    for (std::size_t at; (at = help.find("\n\n\n")) != help.npos;) help.erase(at, 1);
    return help;
  }
  // Some versions of CLI11 wrap it.
  std::string make_footer(const CLI::App* app) const override { return app->get_footer() + "\n"; }
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_positional()) return "";
    const std::string& value = option->get_option_text();
    return (value.empty() ? "" : " <" + value + ">") + (option->get_required() ? " (required)" : "");
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    return wrapped(option->get_description());
  }
};

/// The edit distance with swaps (optimal string alignment), computed by rows of the table of all prefixes.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

std::vector<std::string> options_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> subcommands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

std::string unknown(const std::string& what, const std::string& word, const std::string& help,
                    const std::vector<std::string>& candidates) {
  const auto meant = nearest(word, candidates);
  const std::string advice = meant ? fmt::format("did you mean {}?", *meant) : fmt::format("see {}", help);
  return fmt::format("unknown {} {}; {}", what, word, advice);
}

/// The name of the option in a word: "-T2" is -T, "--threads=2" is --threads.
std::string name_of_option(const std::string& word) {
  return word.starts_with("--") ? word.substr(0, word.find('=')) : word.substr(0, 2);
}

/// Finds a word before the command that would be an option after it.
std::optional<std::string> before_the_command(const CLI::App& app) {
  const std::vector<CLI::App*> given = app.get_subcommands();
  const auto takes = [](const CLI::App* command, const std::string& name) {
    return command->get_option_no_throw(name) != nullptr;
  };
  for (const std::string& word : app.remaining()) {
    if (word.size() < 2 || word[0] != '-') continue;
    const std::string name = name_of_option(word);
    const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
    if (!given.empty() && takes(given.front(), name))
      return fmt::format("{}: options come after the command: tagrid {} {} ...", name,
                         given.front()->get_name(), name);
    if (given.empty() && std::ranges::any_of(commands, [&](const CLI::App* c) { return takes(c, name); }))
      return fmt::format("{}: options come after a command, such as encode: tagrid encode {} ...", name,
                         name);
  }
  return std::nullopt;
}

std::string too_many(const CLI::App& command, const std::string& word, const std::string& help) {
  const std::string name = command.get_name();
  if (name == "convert" && command.get_option("--manifest")->empty())
    return fmt::format(
        "{}: {}: convert takes a list: tagrid convert --find {} > list.tsv, then tagrid convert --manifest "
        "list.tsv --output-dir DIR",
        name, word, word);
  if (command.get_option_no_throw("INPUT") == nullptr)
    return fmt::format("{}: {}: one argument too many; see {}", name, word, help);
  const std::string several = name == "encode" || name == "estimate"
                                  ? "if these are the slices of one volume, give their directory instead; to "
                                    "encode several volumes, use "
                                    "tagrid convert"
                                  : "for several inputs, use a shell loop";
  return fmt::format(
      "{}: {}: one argument too many: only one input is accepted; {}; quote a name that contains spaces",
      name, word, several);
}

/// What the parser found wrong with the options of a command.
std::string wrong_use(const CLI::App& command, const CLI::ParseError& error) {
  std::string what = error.what();
  std::replace(what.begin(), what.end(), '\n', ' ');
  if (const std::size_t verb = what.find(" excludes "); verb != what.npos)
    return fmt::format("{} and {} cannot be combined", what.substr(0, verb), what.substr(verb + 10));
  // An option that is the last word: "--max-error: 1 required TEXT missing".
  const std::string name = what.substr(0, what.find(':'));
  const CLI::Option* option = command.get_option_no_throw(name);
  if (error.get_name() != "ArgumentMismatch" || option == nullptr) return what;
  return fmt::format("{}: needs a value: {} <{}>", name, name, option->get_option_text());
}

}  // namespace

void lay_out_help(CLI::App& app) { app.formatter(std::make_shared<HelpLayout>()); }

std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& candidates) {
  std::optional<std::string> best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t d = distance(word, candidate);
    if (d >= least) continue;
    least = d;
    best = candidate;
  }
  return best;
}

std::string memory_advice(const CLI::App& command) {
  const auto has = [&](const char* option) { return command.get_option_no_throw(option) != nullptr; };
  if (has("--brick")) return "fewer threads (-T), a limit (-M SIZE) or a smaller --brick need less";
  if (has("--memory")) return "fewer threads (-T) or a limit (-M SIZE) need less";
  return has("--threads") ? "fewer threads (-T) need less" : "";
}

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* inner = &app;
  std::string name;
  while (!inner->get_subcommands().empty()) {
    inner = inner->get_subcommands().front();
    name += (name.empty() ? "" : " ") + inner->get_name();
  }
  const CLI::App& command = *inner;
  const bool needs_command = command.get_require_subcommand_min() > 0;
  const std::string where = name.empty() ? "" : name + ": ";
  const std::string help = name.empty() ? "tagrid --help" : fmt::format("tagrid {} --help", name);
  // A word that was not understood explains all errors that followed from it.
  const std::vector<std::string> words = app.remaining(true);
  if (const auto misplaced = before_the_command(app)) return *misplaced;
  const auto option =
      std::find_if(words.begin(), words.end(), [](const auto& w) { return w.size() > 1 && w[0] == '-'; });
  if (option != words.end() && *option == "--")
    return where + "--: everything after it is a file name; give options before it, and one name after it";
  if (std::error_code none; option != words.end() && std::filesystem::exists(path_of(*option), none))
    return fmt::format("{}unknown option {}; for the file of this name, give ./{}", where, *option, *option);
  // What is nearest to it is another bound.
  if (option != words.end() && command.get_name() == "estimate" && name_of_option(*option) == "--max-error")
    return where + "unknown option --max-error; did you mean --errors?";
  if (option != words.end())
    return where + unknown("option", option->substr(0, option->find('=')), help, options_of(command));
  if (needs_command && !words.empty())
    return where + unknown("command", words.front(), help, subcommands_of(command));
  if (!words.empty()) return too_many(command, words.front(), help);
  if (needs_command && error.get_name() == "RequiredError")
    return fmt::format("{}give a command, such as: {}; see {}", where,
                       name.empty() ? "tagrid encode VOLUME" : "tagrid archive list DIR", help);
  return fmt::format("{}{}; see {}", where, wrong_use(command, error), help);
}

}  // namespace tagrid
