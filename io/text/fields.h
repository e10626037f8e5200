// Texts of names and values between semicolons: "name = value;", as the headers of EDF and VFF have them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

/// Values by names in lower case, both without blanks and line ends around them.
using TextFields = std::map<std::string, std::string, std::less<>>;

/// Of two equal names, the first one counts. Parts without '=' are passed over. Safe for any bytes.
TextFields fields_between_semicolons(std::string_view text);

/// The value of a field; nothing if there is none.
std::optional<std::string_view> field_of(const TextFields& fields, std::string_view name);

}  // namespace tagrid
