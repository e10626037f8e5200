// Numbers in texts of other programs. A field that exists but cannot be read is not an absent field:
// every reader of a format asks here, and tells its user what it found.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// One reading of a field.
struct ForeignNumber {
  enum class Outcome : unsigned char {
    absent,      ///< The source has no such field.
    number,      ///< `value` is what the source means.
    unreadable,  ///< The field exists, but its number is unclear.
  };

  Outcome outcome = Outcome::absent;
  double value = 0;            ///< finite
  bool decimal_comma = false;  ///< The text has a comma where numbers have a point; `value` counts it as one.
  std::string text;            ///< what stands in the source

  bool is_absent() const { return outcome == Outcome::absent; }
  bool is_number() const { return outcome == Outcome::number; }
  bool is_unreadable() const { return outcome == Outcome::unreadable; }
  double value_or(double otherwise) const { return is_number() ? value : otherwise; }
};

/// Reads the text of a field, which may have blanks around it; nullopt: the field is absent.
/// Independent of the locale. Unreadable are empty texts, infinities and NaN, numbers with a unit, and lists.
/// A decimal comma is read where it cannot separate thousands: in "2,50" and "0,125", but not in "1,024".
ForeignNumber foreign_number(std::optional<std::string_view> text);

/// The same for a field that holds a binary number, which may be infinite or NaN.
ForeignNumber foreign_number(double stored);

/// A sentence without a full stop for users: what is unusual about the field `name`; "" if nothing is.
/// `consequence` says what was done about an unreadable one: "it is taken as 1".
std::string remark_on(const ForeignNumber& number, std::string_view name, std::string_view consequence);

/// One reading of a field that holds `count` numbers with blanks between them.
struct ForeignNumbers {
  bool is_absent = true;
  std::string text;  ///< the text in the source
  std::size_t count = 0;
  std::vector<ForeignNumber> numbers;  ///< `count`; none if the field is absent or has more or fewer words

  /// Each of them is a number.
  bool are_numbers() const;
  /// Their values. REQUIRES: are_numbers().
  std::vector<double> values() const;
};

/// Reads the text of a field; nothing means that the field is absent. See foreign_number().
ForeignNumbers foreign_numbers(std::optional<std::string_view> text, std::size_t count);

/// A sentence without a full stop for users: what is unusual about the field `name`; "" if nothing is.
/// `consequence` says what was done about unreadable ones.
std::string remark_on(const ForeignNumbers& numbers, std::string_view name, std::string_view consequence);

}  // namespace tagrid
