// Attributes of other programs about the position and the meaning of samples.
#pragma once

#include <hdf5.h>

#include <cmath>
#include <string>
#include <vector>

#include "io/formats/hdf5/attributes.h"

namespace tagrid {

using IsGood = bool (*)(const std::vector<double>&);

/// True if all numbers are finite.
bool are_finite(const std::vector<double>& numbers);
/// True if they are finite and not 0, as distances between samples are.
bool are_steps(const std::vector<double>& numbers);

/// Reads attributes of one object, and gathers what users should know about them.
class Fields {
 public:
  /// `name` is what messages call the object: "scan.h5: HDF5 file: /data".
  Fields(hid_t object, std::string name) : object_(object), name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  bool has(const std::string& attribute) const { return H5Aexists(object_, attribute.c_str()) > 0; }
  /// `count` numbers that are good. Otherwise, the attribute is unreadable, and `consequence` says what that
  /// means: "the spacing is unknown".
  AttributeNumbers numbers(const std::string& attribute, std::size_t count, const char* consequence,
                           IsGood is_good = are_finite);
  /// A text; "" if there is none.
  std::string text(const std::string& attribute, const char* consequence);

  /// A sentence about an attribute: "scan.h5: HDF5 file: /data: spacing is ..."; "" if nothing is unusual.
  std::string remark(const std::string& attribute, const AttributeNumbers& found, std::size_t count,
                     const char* consequence) const;

  std::vector<std::string> warnings;

 private:
  hid_t object_;
  std::string name_;
};

}  // namespace tagrid
