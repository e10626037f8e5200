// Attributes of groups and data sets of HDF5 files, and what HDF5 calls the types of samples.
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <vector>

#include "io/metadata/metadata.h"
#include "io/text/foreign_number.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// Little endian, whatever the machine is.
hid_t hdf5_type_of(SampleType type);

/// The type of samples, and whether their most significant byte comes first.
struct StoredSamples {
  SampleType type;
  bool big_endian;
};

/// Nothing if samples of this HDF5 type are not supported.
std::optional<StoredSamples> stored_samples_of(hid_t type);
/// What a data set of this type has: "integers of 64 bits".
std::string samples_in_words(hid_t type);

/// A text; nothing if there is no such attribute, or if it is not one text.
std::optional<std::string> text_attribute(hid_t object, const std::string& name);
/// One text or several, at most 100; none if there is no such attribute, or if it is not of texts.
std::vector<std::string> text_list_attribute(hid_t object, const std::string& name);
/// Numbers, at most 1000; none if there is no such attribute, or if it is not of numbers.
std::vector<double> number_attribute(hid_t object, const std::string& name);
/// One reading of an attribute that should hold numbers, whoever wrote it.
struct AttributeNumbers {
  ForeignNumber::Outcome outcome = ForeignNumber::Outcome::absent;
  std::vector<double> values;  ///< as many as were asked for; NaN and infinities are possible
  bool decimal_comma = false;  ///< a text whose commas count as points
  std::string text;            ///< the text of the attribute, for messages

  bool is_absent() const { return outcome == ForeignNumber::Outcome::absent; }
  bool is_number() const { return outcome == ForeignNumber::Outcome::number; }
  bool is_unreadable() const { return outcome == ForeignNumber::Outcome::unreadable; }
};

/// `count` numbers, which may be texts: "[0.5, 0.5, 2]", "0,5 0,5 2" or a list of texts. The attribute is
/// unreadable if it has another type or another count.
AttributeNumbers foreign_numbers(hid_t object, const std::string& name, std::size_t count);
/// What an attribute holds, for messages: its texts or numbers, otherwise the name of its type; "" if there
/// is none.
std::string attribute_in_words(hid_t object, const std::string& name);

/// Names and values of all attributes that are texts or numbers, not too many of them.
KeyValues all_attributes(hid_t object);

/// The names of all attributes, in their order; none if one of them is damaged.
std::vector<std::string> attribute_names(hid_t object);

}  // namespace tagrid
