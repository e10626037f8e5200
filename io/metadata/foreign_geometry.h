// Positions in files of other formats: how they are read, what the names of their spaces mean, and what such
// files cannot record.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/metadata/geometry.h"
#include "io/text/foreign_number.h"

namespace tagrid {

/// Whether the format gives a negative distance a meaning.
enum class NegativeSpacing {
  mirrors,     ///< The axis runs the other way.
  is_unknown,  ///< It has no meaning.
};

/// Sets the spacing of the first axes, up to three. Unreadable numbers and 0 have no meaning and stay
/// unknown. Adds a sentence to `warnings` for each; `names` are those of the fields, one for each axis, or
/// one for all.
void set_spacing(const std::vector<ForeignNumber>& numbers, const std::vector<std::string>& names,
                 NegativeSpacing negative, Geometry& geometry, std::vector<std::string>& warnings);

/// For each axis of the world: +1 if it runs to the right, to the front, or up; -1 if it runs the other way.
/// Nothing if the name ("left-posterior-superior", "LPS") does not say it, or not in this order.
std::optional<std::array<int, 3>> signs_of_space(const std::string& space);

/// "LPS" for "left-posterior-superior", and such. Another name has its letters, digits and '-' alone, at most
/// 32 of them.
std::string short_name_of_space(const std::string& space);

/// A format of such files.
struct OneSpaceFormat {
  std::string_view name;          ///< "NIfTI"
  std::string_view space;         ///< that of its positions: "right-anterior-superior"
  std::string_view unknown_unit;  ///< a clause: what comes of lengths whose unit is not known
};

/// Sentences for users; none if nothing is lost.
std::vector<std::string> lost_places(const Geometry& geometry, const OneSpaceFormat& format);

}  // namespace tagrid
