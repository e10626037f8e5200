// Lines, words and numbers in texts that come from files; and texts from outside, made safe to print.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// Removes and returns the first line of `text`, without its '\n' and any '\r' before it.
std::string_view take_line(std::string_view& text);

/// '0' to '9', whatever the locale.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// `text` without blanks and '\r' around it.
std::string_view trimmed(std::string_view text);

/// The parts of `text` between blanks.
std::vector<std::string_view> words_of(std::string_view text);

/// The parts of `text` between the characters `at`: "a", "" and "b" of "a,,b". At least one.
std::vector<std::string_view> split(std::string_view text, char at);

/// All of `text` as a number of this type, without a plus sign, independent of the locale.
template <class Number>
std::optional<Number> entire(std::string_view text) {
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// All of `text` as a number, independent of the locale; "nan" is one.
std::optional<double> number_of(std::string_view text);

/// All of `text` as a whole number, without a plus sign.
std::optional<std::int64_t> whole_number_of(std::string_view text);

bool is_utf8(std::string_view text);

/// `text` for a message, as UTF-8: shortened, and without anything on which a terminal would act.
std::string quoted(std::string_view text);

/// "1 file", "3 files".
std::string counted(std::uint64_t count, std::string_view noun);

/// The letters A to Z become a to z, whatever the locale.
std::string lower_case(std::string_view text);

/// All letters that have a small form, of any script, as the C library knows them; only A to Z if it knows no letters of
/// Unicode. Bytes that are not UTF-8 stay.
std::string lower_case_of_unicode(std::string_view text);

/// `text` without anything on which a terminal would act. Control characters (including those of Unicode that
/// take two bytes, and those that change the direction of writing) and bytes that are not UTF-8 become \n,
/// \t, \r, or \xHH for each of their bytes. All other text stays as it is.
std::string printable(std::string_view text);

/// The name of an input or an output in messages: its path, or "standard input" or "standard output" for "-".
std::string shown_input(const std::string& path);
std::string shown_output(const std::string& path);

/// A name of a file as UTF-8, such as JSON needs, from which name_of_text() makes the same bytes again. Bytes
/// that are not UTF-8, and those of U+FFFD, become U+FFFD and two hexadecimal digits each.
std::string text_of_name(std::string_view name);
/// The name for such a text.
std::string name_of_text(std::string_view text);

/// A text with some parts replaced.
class TextChanges {
 public:
  /// `text` must outlive this.
  explicit TextChanges(std::string_view text) : text_(text) {}

  /// Replaces a part of the text. REQUIRES: parts are replaced from front to back.
  void replace(std::string_view part, std::string_view by) {
    const auto begin = static_cast<std::size_t>(part.data() - text_.data());
    changed_.append(text_.substr(done_, begin - done_)).append(by);
    done_ = begin + part.size();
  }
  /// The entire text. To be called once.
  std::string finish() { return std::move(changed_.append(text_.substr(done_))); }

 private:
  std::string_view text_;
  std::size_t done_ = 0;  ///< bytes of the text that are in changed_, or replaced there
  std::string changed_;
};

}  // namespace tagrid
