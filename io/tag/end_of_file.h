// Messages about the end of a .tag file, shared by all ways of reading it.
#pragma once

namespace tagrid {

/// For the place at which the footer should be. A reader that begins at the end cannot tell a damaged file
/// from a complete one that is followed by other bytes.
inline constexpr const char* no_footer =
    "the file does not end with a footer: it is truncated or damaged, was never finished, or has extra bytes "
    "after its end";
/// For a reader that has read the complete file before.
inline constexpr const char* bytes_follow = "there are extra bytes after the end of the file";

}  // namespace tagrid
