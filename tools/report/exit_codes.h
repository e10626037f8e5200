// Exit codes for scripts; the numbers are those of <sysexits.h>.
#pragma once

namespace tagrid {

inline constexpr int exit_ok = 0;
inline constexpr int exit_usage = 64;         ///< the command is wrong
inline constexpr int exit_broken_input = 65;  ///< the input is broken
inline constexpr int exit_bug = 70;           ///< a bug in tagrid
inline constexpr int exit_world = 74;         ///< a file, a disk or a permission failed
inline constexpr int exit_resumable = 75;     ///< interrupted; the same command continues

}  // namespace tagrid
