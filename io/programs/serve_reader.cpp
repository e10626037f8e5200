#include "io/programs/serve_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/programs/answers.h"
#include "io/programs/serve.h"
#include "io/sandbox/sandbox.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

OrderedJson json_of(const ServedVolume& volume) {
  OrderedJson json = {{"answer", "volume"},
                      {"dims", {volume.dims.x, volume.dims.y, volume.dims.z}},
                      {"type", name_of(volume.type)}};
  const Geometry& g = volume.geometry;
  if (g.has_directions)
    json["directions"] = g.directions;
  else if (g.has_spacing)
    json["spacing"] = g.spacing;
  if (g.has_origin) json["origin"] = g.origin;
  if (!g.space.empty()) json["space"] = g.space;
  if (!g.units[0].empty()) json["units"] = g.units[0];
  for (const auto& [key, value] : volume.pairs) json["pairs"][key] = value;
  if (volume.metadata && !volume.metadata->empty()) json["nrrd"] = text_of(*volume.metadata);
  if (volume.rescale != Rescale{})
    json["rescale"] = {{"slope", volume.rescale.slope},
                       {"intercept", volume.rescale.intercept},
                       {"units", volume.rescale.units}};
  json["files"] = volume.files;
  if (!volume.lasting_name.empty()) json["name"] = volume.lasting_name;
  json["warnings"] = volume.warnings;
  json["complete"] = volume.not_understood.empty();
  if (!volume.not_understood.empty()) json["not_understood"] = volume.not_understood;
  if (!volume.scale_doubt.empty()) json["scale_doubt"] = volume.scale_doubt;
  for (const SliceRun& run : volume.places) json["places"].push_back(json_of(run));
  json["order"] = volume.any_order ? "any" : "next";
  if (volume.has_plain_form) json["plain_form"] = true;
  if (volume.has_others) json["others"] = true;
  // Headers may be read once more for the samples.
  json["memory"] = memory_besides + 2 * memory_of_this_process() + volume.memory;
  return json;
}

OrderedJson json_of(const SeveralVolumes& several) {
  OrderedJson json = {{"answer", "several"}, {"option", several.option}};
  for (const Choice& choice : several.list)
    json["list"].push_back({{"name", choice.name}, {"text", choice.text}});
  return json;
}

void give_slices(ServedVolume& volume, std::int64_t from, std::int64_t to) {
  if (from < 0 || to > volume.dims.z || from >= to)
    throw UsageError("there are no slices {} to {}", from, to);
  std::vector<std::byte> slice(memory_size(*sample_bytes({volume.dims.x, volume.dims.y, 1}, volume.type)));
  for (std::int64_t z = from; z < to; ++z) {
    volume.read_slice(z, slice.data());
    say({{"answer", "slices"}, {"from", z}, {"to", z + 1}});
    say_samples(slice);
  }
  flush_samples();
}

constexpr std::size_t most_listed = 10;

void answer(const OrderedJson& request, OpenServed open, std::unique_ptr<ServedVolume>& volume) {
  const std::string what = request.value("request", "");
  if (what == "describe") {
    volume.reset();
    volume = open(request.at("path"), request.value("options", ReaderOptions()));
    say(json_of(*volume));
  } else if (what == "slices") {
    if (!volume) throw UsageError("slices are asked for before a description");
    give_slices(*volume, request.at("from"), request.at("to"));
  } else if (what == "plain file") {
    const std::size_t file = request.at("file");
    if (!volume || file >= volume->files.size()) throw UsageError("there is no such file");
    say(json_of(volume->plain_file(file)));
  } else {
    say({{"answer", "unknown"}});
  }
}

}  // namespace

std::size_t chosen(const std::string& path, const std::string& option, const std::string& wanted,
                   const std::vector<Choice>& list) {
  if (wanted.empty()) {
    if (list.size() == 1) return 0;
    throw SeveralVolumes{option, list};
  }
  // Which of them is meant would depend on their order.
  if (const auto count = std::ranges::count(list, wanted, &Choice::name); count > 1)
    throw UsageError(
        "{}: has {} volumes that are called {}; move the files of one of them to another directory", path,
        count, wanted);
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].name == wanted) return i;
  for (std::size_t i = 0; i < list.size(); ++i)
    if (std::to_string(i + 1) == wanted) return i;
  std::vector<std::string> names;
  for (const Choice& choice : list) names.push_back(choice.name);
  const std::string those = names.size() <= most_listed ? fmt::format("it has {}", fmt::join(names, ", "))
                                                        : "without this option, the existing ones are listed";
  throw UsageError("{}: has no {} {}; {}", path, option, wanted, those);
}

int serve_volumes(const std::string& name, OpenServed open, const FilesBeside& beside, void (*prepare)()) {
  // Libraries of other programs start threads, of which a twin has none.
  const bool makes_twins = prepare != nullptr && can_start_twins();
  const OrderedJson hello = {
      {"tagrid-reader", 1}, {"name", name}, {"version", TAGRID_VERSION}, {"twins", makes_twins}};
  begin_to_answer();
  say(hello);
  std::unique_ptr<ServedVolume> volume;
  std::string path;
  bool is_twin = false;
  while (const auto line = next_request()) {
    try {
      const OrderedJson request = OrderedJson::parse(*line);
      if (makes_twins && path.empty() && request.value("request", "") == "twin") {
        if (prepare != nullptr) std::exchange(prepare, nullptr)();
        is_twin = is_new_twin();
        if (is_twin) say(hello);
        continue;
      }
      // tagrid starts a program for each source.
      if (path.empty() && request.contains("path"))
        confine_to(request.at("path"), beside, request.value("options", ReaderOptions())["dataset"]);
      path = request.value("path", path);
      answer(request, open, volume);
    } catch (const SeveralVolumes& several) {
      say(json_of(several));
    } catch (const std::exception&) {
      say_error(std::current_exception(), path,
                volume ? "needs more memory than expected; it may be damaged"
                       : "to describe it, its reader needs more memory than its limit");
    }
  }
  volume.reset();
  // What libraries would free has pages in common with the other twins, which would first be copied.
  if (is_twin) std::_Exit(0);
  return 0;
}

}  // namespace tagrid
