#include "io/programs/reader_conversation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/errors/errors.h"
#include "io/metadata/rescale.h"
#include "io/metadata/text.h"
#include "io/programs/answers.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

/// Of a reader that does not say what it needs.
constexpr std::uint64_t default_memory = std::uint64_t{256} << 20;

std::array<double, 3> vector_from(const Json& value, const char* key) {
  std::array<double, 3> numbers = {};
  bool good = value.is_array() && value.size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    good = value[i].is_number();
    if (good) numbers[i] = value[i].get<double>();
  }
  if (!good) throw WrongAnswer(fmt::format("\"{}\" does not have 3 numbers", key));
  return numbers;
}

Geometry geometry_of_volume(const Json& answer) {
  Geometry geometry;
  if (const Json& spacing = member(answer, "spacing"); !spacing.is_null()) {
    Json known = spacing;
    if (known.is_array())
      for (Json& distance : known)
        if (distance.is_null()) distance = Geometry::unknown;
    geometry.spacing = vector_from(known, "spacing");
    geometry.has_spacing = true;
  }
  if (const Json& directions = member(answer, "directions"); !directions.is_null()) {
    if (!directions.is_array() || directions.size() != 3)
      throw WrongAnswer("\"directions\" does not have 3 vectors");
    for (std::size_t axis = 0; axis < 3; ++axis)
      geometry.directions[axis] = vector_from(directions[axis], "directions");
    geometry.has_directions = true;
  }
  if (const Json& origin = member(answer, "origin"); !origin.is_null()) {
    geometry.origin = vector_from(origin, "origin");
    geometry.has_origin = true;
  }
  geometry.space = text_in(answer, "space");
  geometry.units.fill(text_in(answer, "units"));
  return geometry;
}

KeyValues pairs_of(const Json& answer) {
  const Json& pairs = member(answer, "pairs");
  if (pairs.is_null()) return {};
  if (!pairs.is_object()) throw WrongAnswer("\"pairs\" is not an object");
  KeyValues texts;
  for (const auto& [key, value] : pairs.items()) {
    if (!value.is_string())
      throw WrongAnswer(fmt::format("\"pairs\": the value of \"{}\" is not a text", key));
    texts.emplace_back(key, value.get<std::string>());
  }
  return texts;
}

VolumeInfo info_of(const Json& answer, const Rescale& rescale) {
  const Json& dims = member(answer, "dims");
  if (!dims.is_array() || dims.size() != 3) throw WrongAnswer("\"dims\" does not have 3 numbers");
  Index3 size;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!dims[axis].is_number_integer()) throw WrongAnswer("\"dims\" are not whole numbers");
    (axis == 0 ? size.x : axis == 1 ? size.y : size.z) = dims[axis].get<std::int64_t>();
  }
  const auto type = sample_type_named(text_in(answer, "type"));
  if (!type)
    throw WrongAnswer(
        fmt::format("\"type\" is {}, which is not the type of samples", member(answer, "type").dump()));
  if (!sample_bytes(size, *type) || !is_volume_size(size))
    throw WrongAnswer(fmt::format("a volume cannot have {} samples", described(size, *type)));
  KeyValues pairs = pairs_of(answer);
  // One slope for all would be wrong; it is for bounds only.
  const bool is_of_slices =
      std::ranges::any_of(pairs, [](const auto& pair) { return pair.first == "slice_slopes"; });
  if (!is_of_slices) add_rescale(rescale, pairs);
  try {
    if (const std::string lines = text_in(answer, "nrrd"); !lines.empty())
      return {size, *type, parse_metadata(lines)};
    return {size, *type, Metadata(geometry_of_volume(answer), pairs)};
  } catch (const BrokenInput& error) {
    throw WrongAnswer(error.what());
  }
}

Rescale rescale_of(const Json& answer) {
  const Json& given = member(answer, "rescale");
  if (given.is_null()) return {};
  if (!given.is_object()) throw WrongAnswer("\"rescale\" is not an object");
  Rescale rescale;
  for (const auto& [key, number] : {std::pair("slope", &rescale.slope), {"intercept", &rescale.intercept}}) {
    const Json& value = member(given, key);
    if (value.is_null()) continue;
    if (!value.is_number()) throw WrongAnswer(fmt::format("\"rescale\": \"{}\" is not a number", key));
    *number = value.get<double>();
  }
  if (!std::isfinite(rescale.slope) || rescale.slope == 0 || !std::isfinite(rescale.intercept))
    throw WrongAnswer("\"rescale\" does not give values");
  rescale.units = text_in(given, "units");
  return rescale;
}

/// A reader that does not claim to have understood everything may have misread something.
std::vector<std::string> not_understood_in(const Json& answer, const std::string& path) {
  std::vector<std::string> texts = texts_in(answer, "not_understood");
  if (texts.empty() && !flag_in(answer, "complete"))
    texts.push_back(path + ": its reader does not say that it understood everything in the file");
  return texts;
}

ReaderVolume volume_of(const Json& answer, const std::string& path) {
  ReaderVolume volume;
  volume.rescale = rescale_of(answer);
  volume.info = info_of(answer, volume.rescale);
  // Lines that a writer was given say it themselves.
  if (member(answer, "rescale").is_null()) volume.rescale = volume.info.metadata.rescale_of_bounds();
  volume.files = texts_in(answer, "files");
  if (volume.files.empty()) volume.files = {path};
  for (const std::string& file : volume.files)
    if (file.empty() || file == "-") throw WrongAnswer(fmt::format("\"{}\" is not the name of a file", file));
  volume.warnings = texts_in(answer, "warnings");
  volume.not_understood = not_understood_in(answer, path);
  volume.scale_doubt = text_in(answer, "scale_doubt");
  const std::string doubt = doubt_of_rescale(volume.info.metadata, volume.info.dims.z);
  if (volume.scale_doubt.empty() && !doubt.empty()) volume.scale_doubt = path + ": " + doubt;
  volume.lasting_name = text_in(answer, "name");
  volume.places = places_in(answer, volume.info, volume.files.size());
  const std::string order = text_in(answer, "order");
  if (!order.empty() && order != "any" && order != "next")
    throw WrongAnswer(fmt::format("\"order\" is \"{}\", and neither \"any\" nor \"next\"", order));
  volume.any_order = order != "next";
  volume.has_plain_form = flag_in(answer, "plain_form");
  volume.has_others = flag_in(answer, "others");
  volume.memory = static_cast<std::uint64_t>(count_in(answer, "memory", default_memory, 0));
  return volume;
}

/// The option of tagrid that sets a reader option. tagrid uses --grid for something else.
std::string setting_of(const std::string& option) { return option == "grid" ? "vdb-grid" : option; }

[[noreturn]] void throw_several(const Json& answer, const std::string& path) {
  const std::string option = text_in(answer, "option");
  if (option != "series" && option != "dataset" && option != "grid")
    throw WrongAnswer(fmt::format("gives a list from which \"{}\" chooses, which is not an option", option));
  std::vector<Choice> choices;
  for (const Json& volume : list_in(answer, "list")) {
    if (!volume.is_object()) throw WrongAnswer("\"list\" is not a list of objects");
    choices.push_back({text_in(volume, "name"), text_in(volume, "text")});
  }
  const std::string setting = setting_of(option), words = "the option " + option;
  const Sentence sentence("{}: holds {} volumes; choose one with {}, by its number or its name:", path,
                          choices.size(), Setting{setting, words});
  throw UsageError(sentence, {.subject = path, .option = setting, .choices = std::move(choices)});
}

/// A program of which only twins open files. It has loaded its libraries and what these read; see
/// docs/dev/decisions/0062-many-small-volumes.md.
struct Original {
  std::vector<std::string> environment;  ///< with which it was started
  std::unique_ptr<FormatProgram> process;
};

std::unique_ptr<FormatProgram> twin_of(FormatProgram& original, const FormatProgram::Limits& limits) {
  Child child = original.ask_for_twin(R"({"request": "twin"})");
  with(original, [&] {
    const Json answer = required(next_answer(original), "twin");
    child.process = static_cast<int>(count_in(answer, "process", 0, 1));
  });
  auto twin = std::make_unique<FormatProgram>(original.program(), std::move(child), limits);
  hear_hello(*twin, "reader");
  return twin;
}

/// The program, which has said how it begins.
std::unique_ptr<FormatProgram> started(const std::string& path, const FormatProgram::Limits& limits) {
  // A program ends with the thread that started it.
  thread_local std::map<std::string, Original> originals;
  std::vector<std::string> environment = environment_of_programs();
  const auto known = originals.find(path);
  if (known != originals.end() && known->second.environment == environment) try {
      return twin_of(*known->second.process, limits);
    } catch (const WorldError&) {
      // Somebody ended it.
    }
  if (known != originals.end()) originals.erase(known);
  auto program = std::make_unique<FormatProgram>(path, limits);
  if (!hear_hello(*program, "reader")) return program;
  try {
    auto twin = twin_of(*program, limits);
    originals[path] = {std::move(environment), std::move(program)};
    return twin;
  } catch (const WorldError&) {
    program = std::make_unique<FormatProgram>(path, limits);  // it says that it cannot
    hear_hello(*program, "reader");
    return program;
  }
}

}  // namespace

ReaderConversation::ReaderConversation(const std::string& program, const FormatProgram::Limits& limits)
    : process_(started(program, limits)) {}

ReaderVolume ReaderConversation::describe(const std::string& path, const ReaderOptions& options) {
  process_->reads(path);
  say_request(*process_, {{"request", "describe"}, {"path", path}, {"options", options}}, path);
  return with(*process_, [&] {
    Json answer = next_answer(*process_);
    if (text_in(answer, "answer") == "several") throw_several(answer, path);
    ReaderVolume volume = volume_of(required(std::move(answer), "volume"), path);
    process_->limit_memory(volume.memory);
    return volume;
  });
}

PlainForm ReaderConversation::plain_form(const ReaderVolume& volume) {
  PlainForm form;
  std::vector<NumberedRun> places;
  std::vector<std::string> compressions;
  for (std::size_t i = 0; i < volume.files.size(); ++i) {
    const Json request = {{"request", "plain file"}, {"file", i}};
    process_->say(request.dump());
    ReaderPlainFile file = with(*process_, [&] {
      const Json answer = required(next_answer(*process_), "plain file");
      return plain_file_in(answer, i, volume.files.size(), volume.info);
    });
    form.warnings.insert(form.warnings.end(), file.warnings.begin(), file.warnings.end());
    if (file.why_not)
      return {"", {}, {}, fmt::format("{}: {}", volume.files[i], *file.why_not), std::move(form.warnings)};
    if (!file.compression.empty() && std::ranges::find(compressions, file.compression) == compressions.end())
      compressions.push_back(file.compression);
    form.files.push_back({volume.files[i], !file.compression.empty(), std::move(file.pieces)});
    places.insert(places.end(), file.places.begin(), file.places.end());
  }
  form.compression = fmt::format("{}", fmt::join(compressions, ", "));
  with(*process_, [&] { form.places = in_order(std::move(places), volume.info.dims.z); });
  return form;
}

void ReaderConversation::ask_for_slices(std::int64_t from, std::int64_t to) {
  const Json request = {{"request", "slices"}, {"from", from}, {"to", to}};
  process_->say(request.dump());
}

std::int64_t ReaderConversation::hear_of_slices(std::int64_t from, std::int64_t to) {
  return with(*process_, [&] {
    const Json answer = required(next_answer(*process_), "slices");
    const std::int64_t first = count_in(answer, "from", -1, 0), end = count_in(answer, "to", -1, 0);
    if (first != from || end <= from || end > to)
      throw WrongAnswer(
          fmt::format("gives slices {} to {}, but was asked for {} to {}", first, end, from, to));
    return end;
  });
}

}  // namespace tagrid
