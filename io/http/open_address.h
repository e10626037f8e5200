// Files on servers as inputs: https://HOST/scan.tag, s3://BUCKET/scan.tag.
#pragma once

#include <string>

namespace tagrid {

/// Declares an address as a source (declare_source()), and returns its name there, which has no secrets. REQUIRES:
/// is_address(text); the user gave it, and no file. Throws UsageError.
std::string declare_address(const std::string& text);

}  // namespace tagrid
