// Fields of other programs' files that hold several numbers.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/text/foreign_number.h"

namespace tagrid {

/// One reading of a field of `count` numbers with blanks between them.
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
