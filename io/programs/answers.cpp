#include "io/programs/answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

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

bool hear_hello(FormatProgram& program, const std::string& kind) {
  constexpr int protocol_version = 1;
  return with(program, [&] {
    const Json hello = parsed(program.hear());
    const std::int64_t version = hello.is_object() ? count_in(hello, ("tagrid-" + kind).c_str(), 0, 0) : 0;
    if (version == 0) throw WrongAnswer(fmt::format("does not begin as a {} does", kind));
    if (version != protocol_version)
      throw WrongAnswer(fmt::format("speaks version {} of the protocol of {}s; this tagrid knows version {}",
                                    version, kind, protocol_version));
    return flag_in(hello, "twins");
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

// Where samples lie, according to readers.

namespace {

constexpr std::int64_t most_added = std::int64_t{1} << 30;  // to a sample

SliceRows rows_of(const VolumeInfo& info) {
  return {*sample_bytes({info.dims.x, 1, 1}, info.type), info.dims.y};
}

StoredBits stored_bits_of(const Json& place, SampleType type) {
  StoredBits stored;
  const std::int64_t bits = count_in(place, "bits", 0, 0), add = count_in(place, "add", 0, -most_added);
  const auto type_bits = static_cast<std::int64_t>(8 * size_of(type));
  if (bits > type_bits)
    throw WrongAnswer(fmt::format("\"bits\" is {}, but a sample has {}", bits, type_bits));
  if (add > most_added) throw WrongAnswer(fmt::format("\"add\" is {}, which is too much", add));
  stored.bits = bits == type_bits ? 0 : static_cast<int>(bits);
  stored.is_signed = flag_in(place, "signed");
  stored.add = static_cast<std::int32_t>(add);
  if (!stored.changes_nothing() && (is_float_type(type) || type_bits > 32))
    throw WrongAnswer("only integers can have \"bits\" and \"add\"");
  return stored;
}

/// More than any source has, and few enough for the memory of any machine.
constexpr std::int64_t most_files = std::int64_t{1} << 31;

SliceRun place_of(const Json& place, const VolumeInfo& info) {
  if (!place.is_object()) throw WrongAnswer("\"places\" is not a list of objects");
  SliceRun run;
  const std::int64_t file = count_in(place, "file", 0, 0);
  if (file >= most_files) throw WrongAnswer(fmt::format("\"file\" is {}, but there are fewer", file));
  run.file = static_cast<std::size_t>(file);
  run.offset = static_cast<std::uint64_t>(count_in(place, "offset", 0, 0));
  run.slices = count_in(place, "slices", 1, 1);
  const auto row_bytes = static_cast<std::int64_t>(rows_of(info).bytes);
  run.bottom_up = flag_in(place, "bottom_up");
  if (run.bottom_up || place.contains("row_step"))
    run.row_step = static_cast<std::uint64_t>(count_in(place, "row_step", row_bytes, row_bytes));
  const auto span = span_of_slice(run, rows_of(info));
  constexpr std::uint64_t most = std::uint64_t{1} << 62;
  if (!span || *span > most) throw WrongAnswer("\"row_step\" is beyond all files");
  run.step = static_cast<std::uint64_t>(count_in(place, "step", static_cast<std::int64_t>(*span), 0));
  run.big_endian = flag_in(place, "big_endian");
  run.stored = stored_bits_of(place, info.type);
  return run;
}

std::string bytes_of_hex(const std::string& hex) {
  std::string bytes(hex.size() / 2, '\0');
  bool good = hex.size() % 2 == 0;
  for (std::size_t i = 0; i < bytes.size() && good; ++i) {
    unsigned char byte = 0;
    const char* digits = hex.data() + 2 * i;
    good = std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    bytes[i] = static_cast<char>(byte);
  }
  if (!good) throw WrongAnswer("\"hex\" is not a text of bytes in hexadecimal digits");
  return bytes;
}

PlainPiece piece_in(const Json& json, std::size_t file, std::size_t files) {
  if (!json.is_object()) throw WrongAnswer("\"pieces\" is not a list of objects");
  if (json.contains("hex")) return PlainPiece::given(bytes_of_hex(text_in(json, "hex")));
  if (json.contains("samples"))
    return PlainPiece::samples(static_cast<std::uint64_t>(count_in(json, "samples", 0, 1)));
  const std::int64_t from = count_in(json, "from", 0, 0), to = count_in(json, "to", -1, from);
  const std::int64_t number = count_in(json, "file", static_cast<std::int64_t>(file), 0);
  if (number >= static_cast<std::int64_t>(files))
    throw WrongAnswer(fmt::format("a piece is in file {}, but there are {}", number, files));
  return PlainPiece::stretch(static_cast<std::size_t>(number), static_cast<std::uint64_t>(from),
                             static_cast<std::uint64_t>(to));
}

std::uint64_t size_of(const std::vector<PlainPiece>& pieces) {
  std::uint64_t all = 0;
  for (const PlainPiece& piece : pieces)
    if (__builtin_add_overflow(all, piece.size.value_or(piece.bytes.size()), &all))
      throw WrongAnswer("\"pieces\" have more bytes than a file can have");
  return all;
}

}  // namespace

std::vector<SliceRun> places_in(const Json& answer, const VolumeInfo& info, std::size_t files) {
  std::vector<SliceRun> places;
  std::int64_t left = info.dims.z;
  for (const Json& place : list_in(answer, "places")) {
    const SliceRun run = place_of(place, info);
    if (run.file >= files)
      throw WrongAnswer(fmt::format("a place is in file {}, but there are {}", run.file, files));
    if (run.slices > left) throw WrongAnswer(fmt::format("its places have more than {} slices", info.dims.z));
    left -= run.slices;
    places.push_back(run);
  }
  if (!places.empty() && left > 0)
    throw WrongAnswer(fmt::format("its places have {} of {} slices", info.dims.z - left, info.dims.z));
  return places;
}

ReaderPlainFile plain_file_in(const Json& answer, std::size_t file, std::size_t files,
                              const VolumeInfo& info) {
  ReaderPlainFile plain;
  if (const std::string why = text_in(answer, "why_not"); !why.empty()) plain.why_not = why;
  plain.warnings = texts_in(answer, "warnings");
  if (plain.why_not) return plain;
  plain.compression = text_in(answer, "compression");
  for (const Json& piece : list_in(answer, "pieces")) plain.pieces.push_back(piece_in(piece, file, files));
  const std::uint64_t size = size_of(plain.pieces);
  for (const Json& place : list_in(answer, "places")) {
    NumberedRun numbered{0, place_of(place, info)};
    numbered.first = count_in(place, "first", -1, 0);
    SliceRun& run = numbered.run;
    run.file = file;
    if (const auto end = end_of_run(run, rows_of(info)); !end || *end > size)
      throw WrongAnswer(fmt::format("a place of file {} lies beyond its end", file));
    plain.places.push_back(numbered);
  }
  return plain;
}

std::vector<SliceRun> in_order(std::vector<NumberedRun> runs, std::int64_t slices) {
  std::ranges::sort(runs, {}, &NumberedRun::first);
  std::vector<SliceRun> places;
  std::int64_t next = 0;
  for (const auto& [first, run] : runs) {
    if (first != next || run.slices > slices - next)
      throw WrongAnswer(fmt::format("slice {} has no place in a plain form, or two", next));
    next += run.slices;
    places.push_back(run);
  }
  if (next != slices) throw WrongAnswer(fmt::format("slice {} has no place in a plain form", next));
  return places;
}

nlohmann::ordered_json json_of(const SliceRun& run) {
  nlohmann::ordered_json json = {{"file", run.file},
                                 {"offset", run.offset},
                                 {"slices", run.slices},
                                 {"step", run.step},
                                 {"big_endian", run.big_endian}};
  if (run.row_step != 0) json["row_step"] = run.row_step;
  if (run.bottom_up) json["bottom_up"] = true;
  if (run.stored.bits != 0) json["bits"] = run.stored.bits;
  if (run.stored.is_signed) json["signed"] = true;
  if (run.stored.add != 0) json["add"] = run.stored.add;
  return json;
}

nlohmann::ordered_json json_of(const ReaderPlainFile& file) {
  nlohmann::ordered_json json = {{"answer", "plain file"}};
  if (!file.warnings.empty()) json["warnings"] = file.warnings;
  if (file.why_not) {
    json["why_not"] = *file.why_not;
    return json;
  }
  json["compression"] = file.compression;
  for (const PlainPiece& piece : file.pieces) switch (piece.kind) {
      case PlainPiece::Kind::given: {
        std::string hex;
        for (const char byte : piece.bytes) hex += fmt::format("{:02x}", static_cast<unsigned char>(byte));
        json["pieces"].push_back({{"hex", hex}});
        break;
      }
      case PlainPiece::Kind::stretch:
        json["pieces"].push_back(
            {{"file", piece.file}, {"from", piece.offset}, {"to", piece.offset + *piece.size}});
        break;
      case PlainPiece::Kind::samples:
        json["pieces"].push_back({{"samples", *piece.size}});
        break;
      case PlainPiece::Kind::content:
        break;  // readers have none
    }
  for (const auto& [first, run] : file.places) {
    nlohmann::ordered_json place = json_of(run);
    place.erase("file");
    place["first"] = first;
    json["places"].push_back(place);
  }
  return json;
}

}  // namespace tagrid
