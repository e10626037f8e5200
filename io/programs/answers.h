// Common parts of conversations with readers and with writers: JSON objects in lines, and errors.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/programs/format_program.h"

namespace tagrid {

using Json = nlohmann::json;

/// An answer that breaks the rules of docs/readers.md. The conversation adds the name of the program.
struct WrongAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The JSON in a line of a program; discarded if it is not JSON, or so deeply nested that handling it would exhaust the stack.
Json parsed(const std::string& line);

/// Calls a function; a wrong answer ends the conversation.
template <class Work>
auto with(FormatProgram& program, Work work) {
  try {
    return work();
  } catch (const WrongAnswer& wrong) {
    program.fail(wrong.what());
  }
}

// All of these throw WrongAnswer if the answer is not as it should be.

/// The value of a key; null if there is none.
const Json& member(const Json& object, const char* key);
std::string text_in(const Json& object, const char* key);
/// False if there is none.
bool flag_in(const Json& object, const char* key);
const Json& list_in(const Json& object, const char* key);
/// A whole number of at least `least`; `otherwise` if there is none.
std::int64_t count_in(const Json& object, const char* key, std::int64_t otherwise, std::int64_t least);
std::vector<std::string> texts_in(const Json& object, const char* key);

/// Throws the error that an answer of the program reports: BrokenInput, UsageError or WorldError.
[[noreturn]] void throw_error(const FormatProgram& program, const Json& answer);

/// Hears how the program begins. `kind` is "reader" or "writer". A program of another kind, or one that speaks another
/// version of the protocol, is a WorldError.
void hear_hello(FormatProgram& program, const std::string& kind);
/// The next answer that is not a sign of life. Throws what the program says is wrong.
Json next_answer(FormatProgram& program);
void require_answer(const Json& answer, const char* kind);

/// Sends a request about the file at `path`. Throws UsageError if its name is not UTF-8.
void say_request(FormatProgram& program, const Json& request, const std::string& path);

}  // namespace tagrid
