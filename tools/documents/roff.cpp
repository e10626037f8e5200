#include "tools/documents/roff.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <vector>

#include "io/text/text.h"

namespace tagrid {
namespace {

/// Words in `code`: names of files are in italics, all else is bold.
std::string code(const std::string& text) {
  const bool is_file = text.front() == '.' || text.find('/') != text.npos || text.find(".tag") != text.npos;
  return fmt::format("\\f{}{}\\fR", is_file && text.find(' ') == text.npos ? 'I' : 'B', roff_text(text));
}

/// Marks within a line.
std::string inline_marks(const std::string& line) {
  static const std::regex mark(R"(\\(.)|`([^`]+)`|\*([^*]+)\*|\[([^\]]+)\]\(([^)]+)\))");
  std::string result;
  auto rest = line.begin();
  for (std::sregex_iterator m(line.begin(), line.end(), mark), end; m != end; ++m) {
    result += roff_text({rest, (*m)[0].first});
    rest = (*m)[0].second;
    if ((*m)[1].matched) result += roff_text((*m)[1].str());
    if ((*m)[2].matched) result += code((*m)[2]);
    if ((*m)[3].matched || (*m)[4].matched)
      result += "\\fI" + roff_text((*m)[3].str() + (*m)[4].str()) + "\\fR";
  }
  return result + roff_text({rest, line.end()});
}

/// A paragraph, each sentence on a line of its own.
std::string sentences(const std::string& paragraph) {
  static const std::regex end(R"(\. (?=[A-Z`*\[]))");
  std::string result;
  const std::string lines = std::regex_replace(paragraph, end, ".\n");
  for (const std::string_view line : split(lines, '\n')) {
    std::string text = inline_marks(std::string(line));
    if (text.starts_with('.') || text.starts_with('\'')) text.insert(0, "\\&");
    result += text + "\n";
  }
  return result;
}

/// "-o" as Fl, "FILE" as Ar.
std::string macro(std::string_view word) {
  return word.starts_with('-') ? fmt::format("Fl {}", word.substr(1)) : fmt::format("Ar {}", word);
}

}  // namespace

std::string roff_text(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  return result;
}

std::string roff(std::string_view markdown) {
  std::string result, paragraph;
  bool in_list = false, after_blank = false;
  const auto flush = [&] {
    if (!paragraph.empty()) result += sentences(paragraph);
    paragraph.clear();
  };
  for (const std::string_view line : split(markdown, '\n')) {
    const bool is_item = line.starts_with("- "), continues = in_list && line.starts_with("  ");
    if (line.empty() || is_item || (in_list && !continues)) flush();
    if (line.empty()) {
      after_blank = true;
      continue;
    }
    if (in_list && !is_item && !continues) {
      result += ".El\n";
      in_list = false;
    }
    if (is_item) {
      if (!in_list) result += ".Bl -bullet -compact\n";
      result += ".It\n";
      in_list = true;
    } else if (after_blank && !in_list && !result.empty()) {
      result += ".Pp\n";
    }
    after_blank = false;
    paragraph += (paragraph.empty() ? "" : " ") + std::string(trimmed(is_item ? line.substr(2) : line));
  }
  flush();
  return result + (in_list ? ".El\n" : "");
}

std::string roff_form(const std::string& form) {
  static const std::regex part(R"(\[([^\]]*)\]|\S+)");
  std::string result = ".Nm\n";
  int number = 0;
  for (std::sregex_iterator m(form.begin(), form.end(), part), end; m != end; ++m, ++number) {
    const std::string word = (*m)[0];
    if (number == 0) continue;
    if (number == 1 && !word.starts_with('-')) {
      result += ".Cm " + word + "\n";
    } else if ((*m)[1].matched) {
      const std::string optional = (*m)[1];
      result += ".Op";
      for (const std::string_view w : words_of(optional)) result += " " + macro(w);
      result += "\n";
    } else {
      result += "." + macro(word) + "\n";
    }
  }
  return result;
}

}  // namespace tagrid
