// What is said of the end of a .tag file, however it is read.
#pragma once

namespace tagrid {

/// Where the footer would have to be. What follows a whole file looks like this, too, to whoever begins at the end.
inline constexpr const char* no_footer =
    "the file does not end with a footer: it is truncated, damaged, was never finished, or bytes follow "
    "after its end";
/// To whoever has read all of the file before.
inline constexpr const char* bytes_follow = "bytes follow after the end of the file";

}  // namespace tagrid
