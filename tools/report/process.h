// Manners towards the world around the process: signals, and the standard streams.
#pragma once

#include <cstdint>
#include <string_view>

namespace tagrid {

/// Makes sure that descriptors 0, 1 and 2 are taken, so that no file of ours becomes a standard stream that
/// was closed by the caller. Reading or writing one that was closed fails.
void occupy_standard_streams();

/// From now on a signal that ends the process removes the temporaries before. Signals that the caller set to
/// be ignored remain so. A file that grows over its limit is a write error, not a signal.
void catch_signals();

/// Sets up the heap for speed: memory that a brick gave back is kept for the next one.
void keep_freed_memory();
/// Sets it up for a limit on memory, in bytes: what is large for it goes back to the system as soon as it is
/// free.
void give_back_freed_memory(std::uint64_t limit);

/// The most memory that this process had so far, resident, in bytes.
std::uint64_t peak_memory();

/// Writes a line for people to the standard error, as printable() has it. That nobody hears it is no failure.
void say_line(std::string_view text);
/// The same of text that a terminal is to act on, as it is: every part of it that came from outside has to be
/// printable().
void say_to_terminal(std::string_view text);

/// Writes out what the standard output still holds. Throws WorldError, ClosedPipe where nobody reads it.
void flush_standard_output();

}  // namespace tagrid
