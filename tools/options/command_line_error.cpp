#include "tools/options/command_line_error.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/options/suggestion.h"

namespace tagrid {
namespace {

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

}  // namespace

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> given = app.get_subcommands();
  const CLI::App& command = given.empty() ? app : *given.front();
  const std::string where = given.empty() ? "" : command.get_name() + ": ";
  const std::string help =
      given.empty() ? "tagrid --help" : fmt::format("tagrid {} --help", command.get_name());
  // A word that was not understood explains all that followed from it.
  const std::vector<std::string> words = app.remaining(true);
  const auto option =
      std::find_if(words.begin(), words.end(), [](const auto& w) { return w.size() > 1 && w[0] == '-'; });
  if (option != words.end())
    return where + unknown("option", option->substr(0, option->find('=')), help, options_of(command));
  if (given.empty() && !words.empty()) return unknown("subcommand", words.front(), help, subcommands_of(app));
  if (!words.empty()) return fmt::format("{}{}: one argument too many; see {}", where, words.front(), help);
  std::string what = error.what();
  std::replace(what.begin(), what.end(), '\n', ' ');
  return fmt::format("{}{}; see {}", where, what, help);
}

}  // namespace tagrid
