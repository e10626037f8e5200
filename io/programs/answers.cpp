#include "io/programs/answers.h"

#include <fmt/format.h>

#include "io/errors/errors.h"

namespace tagrid {

const Json& member(const Json& object, const char* key) {
  static const Json none;
  const auto found = object.find(key);
  return found == object.end() ? none : *found;
}

std::string text_in(const Json& object, const char* key) {
  const Json& value = member(object, key);
  if (value.is_null()) return "";
  if (!value.is_string()) throw WrongAnswer(fmt::format("\"{}\" is not a text", key));
  return value.get<std::string>();
}

bool flag_in(const Json& object, const char* key) {
  const Json& flag = member(object, key);
  if (!flag.is_null() && !flag.is_boolean())
    throw WrongAnswer(fmt::format("\"{}\" is neither true nor false", key));
  return flag.is_boolean() && flag.get<bool>();
}

const Json& list_in(const Json& object, const char* key) {
  static const Json none = Json::array();
  const Json& value = member(object, key);
  if (value.is_null()) return none;
  if (!value.is_array()) throw WrongAnswer(fmt::format("\"{}\" is not a list", key));
  return value;
}

std::int64_t count_in(const Json& object, const char* key, std::int64_t otherwise, std::int64_t least) {
  const Json& value = member(object, key);
  if (value.is_null()) return otherwise;
  const bool is_number = value.is_number_integer() && (!value.is_number_unsigned() ||
                                                       value.get<std::uint64_t>() <= std::uint64_t{1} << 62);
  if (!is_number || value.get<std::int64_t>() < least)
    throw WrongAnswer(
        fmt::format("\"{}\" is {}, which is not a whole number of at least {}", key, value.dump(), least));
  return value.get<std::int64_t>();
}

std::vector<std::string> texts_in(const Json& object, const char* key) {
  std::vector<std::string> texts;
  for (const Json& text : list_in(object, key)) {
    if (!text.is_string()) throw WrongAnswer(fmt::format("\"{}\" is not a list of texts", key));
    texts.push_back(text.get<std::string>());
  }
  return texts;
}

namespace {

/// The JSON in a line of a program; discarded if it is not JSON, or so deeply nested that handling it would
/// exhaust the stack.
Json parsed(const std::string& line) {
  constexpr int deepest = 64;
  bool is_too_deep = false;
  Json json = Json::parse(
      line,
      [&](int depth, Json::parse_event_t, Json&) {
        is_too_deep = is_too_deep || depth > deepest;
        return !is_too_deep;
      },
      false);
  return is_too_deep ? Json(Json::value_t::discarded) : json;
}

/// Throws the error that an answer reports: BrokenInput, UsageError or WorldError.
[[noreturn]] void throw_error(const FormatProgram& program, const Json& answer) {
  const std::string kind = text_in(answer, "kind"), message = text_in(answer, "message");
  if (message.empty()) throw WrongAnswer("reports an error without a message");
  const std::string option = text_in(answer, "option");
  if (option == "memory") program.fail_for_memory(message);
  const Problem problem = option == "gaps-ok" ? Problem::slices_missing : Problem::none;
  if (kind == "input") throw BrokenInput(message, problem);
  if (kind == "usage") throw UsageError(message);
  if (kind == "world") throw WorldError(message);
  throw WrongAnswer(fmt::format("reports an error of the unknown kind \"{}\": {}", kind, message));
}

}  // namespace

void hear_hello(FormatProgram& program, const std::string& kind) {
  constexpr int protocol_version = 1;
  with(program, [&] {
    const Json hello = parsed(program.hear());
    const std::int64_t version = hello.is_object() ? count_in(hello, ("tagrid-" + kind).c_str(), 0, 0) : 0;
    if (version == 0) throw WrongAnswer(fmt::format("does not begin as a {} does", kind));
    if (version != protocol_version)
      throw WrongAnswer(fmt::format("speaks version {} of the protocol of {}s; this tagrid knows version {}",
                                    version, kind, protocol_version));
  });
}

Json heard_answer(FormatProgram& program) {
  Json answer = parsed(program.hear());
  if (!answer.is_object()) throw WrongAnswer("its answer is not a JSON object");
  if (text_in(answer, "answer") == "error") throw_error(program, answer);
  return answer;
}

Json next_answer(FormatProgram& program) {
  for (;;)
    if (Json answer = heard_answer(program); text_in(answer, "answer") != "working") return answer;
}

Json required(Json answer, const char* kind) {
  if (const std::string given = text_in(answer, "answer"); given != kind)
    throw WrongAnswer(fmt::format("it answers \"{}\" instead of \"{}\"", given, kind));
  return answer;
}

void say_request(FormatProgram& program, const Json& request, const std::string& path) {
  std::string line;
  try {
    line = request.dump();  // JSON is text
  } catch (const Json::exception&) {
    throw UsageError(
        path +
        ": its name is not UTF-8, which programs that read and write formats need; give it another name");
  }
  program.say(line);
}

}  // namespace tagrid
