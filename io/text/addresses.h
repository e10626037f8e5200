// Addresses of files on servers, as texts.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// True for the texts that are addresses and not names of files: http://, https:// and s3://.
bool is_address(std::string_view text);

/// An address for messages: without the name and the password of a user, and without what follows a question
/// mark, which is often a signature. Other texts stay as they are.
std::string shown_address(std::string_view text);

}  // namespace tagrid
