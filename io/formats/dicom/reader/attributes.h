// Attributes of a data set as texts and numbers, and remarks on those that cannot be read.
#pragma once

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dctk.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/formats/dicom/reader/dicom_file.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid {

/// "RescaleSlope".
std::string name_of(const DcmTagKey& tag);

/// The value of an attribute without blanks at its end; nothing if it is absent.
std::optional<std::string> text_of(DcmItem& item, const DcmTagKey& tag);
std::string text_of(DcmElement& element);

/// The parts of a text between backslashes.
inline std::vector<std::string_view> values_of(std::string_view text) { return split(text, '\\'); }

/// The first item of a sequence; nullptr if there is none.
DcmItem* item_in(DcmItem& item, const DcmTagKey& tag);

/// One number. Texts of several are unreadable.
ForeignNumber number_in(DcmItem& item, const DcmTagKey& tag);

/// Adds a warning to `notes` if there is something to say of a number.
void remark(const ForeignNumber& number, const DcmTagKey& tag, std::string_view consequence,
            DicomNotes& notes);

/// An attribute with several numbers.
struct DicomNumbers {
  ForeignNumber::Outcome outcome = ForeignNumber::Outcome::absent;
  std::vector<double> values;

  bool are_there() const { return outcome != ForeignNumber::Outcome::absent; }
  bool are_numbers() const { return outcome == ForeignNumber::Outcome::number; }
};

/// `count` numbers, or any count of them if it is 0. An empty attribute is unreadable without a remark,
/// because it means that the value is unknown.
DicomNumbers numbers_in(DcmItem& item, const DcmTagKey& tag, std::size_t count, std::string_view consequence,
                        DicomNotes& notes);

/// A whole number that describes the samples; nothing if it is absent or empty. Throws BrokenInput if it is
/// something else.
std::optional<std::int64_t> integer_in(DcmItem& item, const DcmTagKey& tag);

}  // namespace tagrid
