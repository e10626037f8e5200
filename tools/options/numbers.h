// Numbers in the form of the command line: decimal, whatever the locale, without surrounding text. Anything
// else returns nullopt; the caller reports the option.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "io/text/text.h"
#include "io/volume/volume_info.h"
#include "stages/grid/box.h"

namespace tagrid {

/// A whole number that fits `Whole`: "20", "-3", "+3", and "020", which is 20. No other base is read.
template <class Whole>
std::optional<Whole> whole_number(std::string_view text) {
  // "+-3" keeps its sign, and so is not a number.
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  return entire<Whole>(text);
}

/// A finite number: "2", "-0.5", "1e3". Zero has no sign.
std::optional<double> finite_number(std::string_view text);

/// A number of bytes: a whole number, or a number followed by K, M, G or T for that many times 1024, 1024^2,
/// 1024^3 or 1024^4. As in xz, k, KB and KiB are the same as K.
std::optional<std::uint64_t> byte_count(std::string_view text);

/// "X,Y,Z", the sizes of a volume: each from 1 to 2^31.
std::optional<Index3> three_sizes(std::string_view text);

/// "X,Y,Z", or one number for all axes: the distances of samples, each above 0 and at most 1e300. A unit of length may
/// follow the last number, or each of them: "0.01mm", "10,10,25um".
std::optional<GivenSpacing> given_spacing(std::string_view text);

/// "lo:hi", two finite numbers.
std::optional<std::pair<double, double>> value_range(std::string_view text);

/// Advice for a text that `read`, one of the functions above, would read with decimal points instead of
/// commas; "" for others.
template <class Read>
std::string hint_of_decimal_comma(std::string_view text, Read read) {
  std::string with_points(text);
  std::ranges::replace(with_points, ',', '.');
  return with_points != text && read(with_points) ? "; use a decimal point, not a comma" : "";
}

/// From the first number up to, but not including, the second; a missing end is open.
using IndexRange = std::pair<std::optional<std::int64_t>, std::optional<std::int64_t>>;

/// "x0:x1,y0:y1,z0:z1", whole numbers, any of which may be missing: ":,:,40:41".
std::optional<std::array<IndexRange, 3>> three_ranges(std::string_view text);

}  // namespace tagrid
