// Addresses of files on servers, as texts.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// True for the texts that are addresses and not names of files: http://, https:// and s3://.
bool is_address(std::string_view text);

/// True for texts that begin as addresses do, with a scheme and ":/": also gs:// and http:/ (a slash is missing). A file
/// can have such a name, if a directory is called "gs:". One letter is a drive of Windows, as in "C:/scans".
bool has_scheme(std::string_view text);

/// True if a signature is in the query of an address: whoever has the address may read what is there.
bool is_signed_address(std::string_view text);

/// An address for messages: without the name and the password of a user, and without what follows a question
/// mark, which is often a signature. The same for other texts with a scheme; all others stay as they are.
std::string shown_address(std::string_view text);

/// A text for a path or the value of a query: bytes other than letters, digits, -._~ and those of `kept` as %20.
std::string percent_encoded(std::string_view text, std::string_view kept = "");

}  // namespace tagrid
