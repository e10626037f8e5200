// JSON of conversations with readers and with writers: answers in lines, errors, and where samples lie.
// docs/dev/readers.md specifies it.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/programs/format_program.h"
#include "io/programs/reader_conversation.h"
#include "io/volume/sample_places.h"
#include "io/volume/volume_info.h"

namespace tagrid {

using Json = nlohmann::json;

/// An answer that breaks the rules of docs/dev/readers.md. The conversation adds the name of the program.
struct WrongAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

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

/// The value of a key; null if the key is missing, or if `object` is not an object.
const Json& member(const Json& object, const char* key);
std::string text_in(const Json& object, const char* key);
/// False if there is none.
bool flag_in(const Json& object, const char* key);
const Json& list_in(const Json& object, const char* key);
/// A whole number of at least `least`; `otherwise` if there is none.
std::int64_t count_in(const Json& object, const char* key, std::int64_t otherwise, std::int64_t least);
std::vector<std::string> texts_in(const Json& object, const char* key);

/// Hears how the program begins. `kind` is "reader" or "writer". A program of another kind, or one that
/// speaks another version of the protocol, is a WorldError. Returns true if it makes twins.
bool hear_hello(FormatProgram& program, const std::string& kind);
/// The next answer. Throws what the program says is wrong: BrokenInput, UsageError or WorldError.
Json heard_answer(FormatProgram& program);
/// The next answer that is not a sign of life.
Json next_answer(FormatProgram& program);
/// The answer. Throws WrongAnswer if it is of another kind.
Json required(Json answer, const char* kind);

/// Sends a request about the file at `path`. Throws UsageError if its name is not UTF-8.
void say_request(FormatProgram& program, const Json& request, const std::string& path);

// All of these throw WrongAnswer.

/// The places of all slices of a volume in its `files`; none if the reader gives them.
std::vector<SliceRun> places_in(const Json& answer, const VolumeInfo& info, std::size_t files);
/// The plain form of the file with this number.
ReaderPlainFile plain_file_in(const Json& answer, std::size_t file, std::size_t files,
                              const VolumeInfo& info);
/// The runs from front to back. They must be `slices` slices.
std::vector<SliceRun> in_order(std::vector<NumberedRun> runs, std::int64_t slices);

/// The other side of the conversation.
nlohmann::ordered_json json_of(const SliceRun& run);
nlohmann::ordered_json json_of(const ReaderPlainFile& file);

}  // namespace tagrid
