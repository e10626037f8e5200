#include "tools/options/help_layout.h"

#include <memory>
#include <sstream>
#include <string>

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
  HelpLayout() { column_width(left_column); }

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string help = CLI::Formatter::make_help(app, std::move(name), mode);
    // CLI11 puts two empty lines between groups.
    for (std::size_t at; (at = help.find("\n\n\n")) != help.npos;) help.erase(at, 1);
    return help;
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_positional()) return "";
    const std::string& value = option->get_option_text();
    return (value.empty() ? "" : " <" + value + ">") + (option->get_required() ? " (required)" : "");
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    return wrapped(option->get_description());
  }
};

}  // namespace

void lay_out_help(CLI::App& app) { app.formatter(std::make_shared<HelpLayout>()); }

}  // namespace tagrid
