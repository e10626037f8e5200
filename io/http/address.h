// Addresses of files on servers, how the servers are asked for them, and such files as inputs:
// https://HOST/scan.tag, s3://BUCKET/scan.tag.
#pragma once

#include <string>

namespace tagrid {

struct Address {
  std::string name;  ///< for messages: shown_address()
  std::string url;   ///< http or https
  /// Of an object store. Without keys, requests are not signed.
  bool is_object = false;
  std::string key, secret, token, region;
};

/// The address of a text for which is_address() is true. Of s3://BUCKET/KEY, the variables of AWS say the
/// server, the region and the keys. Throws UsageError.
Address address_of(const std::string& text);

/// Declares an address as a source (declare_source()), and returns its name there, which has no secrets. REQUIRES:
/// is_address(text); the user gave it, and no file. Throws UsageError.
std::string declare_address(const std::string& text);

}  // namespace tagrid
