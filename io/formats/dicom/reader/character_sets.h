// Texts of DICOM files in UTF-8, by their SpecificCharacterSet (DICOM PS3.3, C.12.1.1.2) and the escape sequences in
// them, which select other sets (PS3.5, 6.1.2.5). DCMTK converts with the same tables, but knows no Japanese set where
// it uses the C library, and leaves all texts of a file as they are if one of them is damaged.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

class CharacterSets {
 public:
  /// `terms`: the values of SpecificCharacterSet, "\ISO 2022 IR 87"; "" if there are none.
  explicit CharacterSets(std::string_view terms);

  /// The text in UTF-8; nothing if it has bytes that are no letters in these sets. After each of `delimiters`, which
  /// separate values or parts of a name, and after a control character, the first set holds again.
  std::optional<std::string> in_utf8(std::string_view text, std::string_view delimiters) const;

 private:
  /// ASCII and, in bytes of 128 and more, the set with this number; 0: none.
  std::int64_t first_ = 0;
  /// Instead: the name of an encoding without escape sequences; "": none.
  std::string whole_;
};

}  // namespace tagrid
