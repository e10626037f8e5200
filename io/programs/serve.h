// Common parts of our programs that read and write formats: how they answer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace tagrid {

using OrderedJson = nlohmann::ordered_json;

/// What a program of ours takes besides what it says: libraries, and what descriptions take.
inline constexpr std::uint64_t memory_besides = std::uint64_t{32} << 20;

/// The next line of the standard input; nothing at its end.
std::optional<std::string> next_request();
/// Starts a twin of this program with the streams that came with the last request. True in the twin, which begins the
/// conversation anew; this program has answered.
bool is_new_twin();

/// Begins a conversation. What libraries print on the standard output goes to the standard error from now on.
void begin_to_answer();
/// Says one line. What is not UTF-8 in a text becomes a replacement character.
void say(const OrderedJson& answer);
/// Says samples, which may stay in a buffer until the next line, or flush_samples().
void say_samples(const std::vector<std::byte>& samples);
void flush_samples();
/// Reports what is wrong with the file at `path`; `of_memory` is the message if memory ran out.
void say_error(const std::exception_ptr& exception, const std::string& path, const std::string& of_memory);
/// Says that this program still works, but not more often than once a second. To be called during long work.
void say_working();

}  // namespace tagrid
