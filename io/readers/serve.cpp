#include "io/readers/serve.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "io/files/error_kinds.h"
#include "io/files/errors.h"

namespace tagrid {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// What a program of ours takes besides what it says: libraries, and what descriptions take.
constexpr std::uint64_t own_memory = std::uint64_t{32} << 20;

/// The memory of its own that this program has touched.
std::uint64_t memory_now() {
  std::uint64_t size = 0, resident = 0, of_files = 0;
  std::ifstream statm("/proc/self/statm");
  if (!(statm >> size >> resident >> of_files) || resident < of_files) return 0;
  return (resident - of_files) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void say(const OrderedJson& answer) {
  // What is not UTF-8 in a text becomes a replacement character.
  const std::string line = answer.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + '\n';
  std::fwrite(line.data(), 1, line.size(), stdout);
  std::fflush(stdout);
}

OrderedJson json_of(const SliceRun& run) {
  OrderedJson json = {{"file", run.file},
                      {"offset", run.offset},
                      {"slices", run.slices},
                      {"step", run.step},
                      {"big_endian", run.big_endian}};
  if (run.stored.bits != 0) json["bits"] = run.stored.bits;
  if (run.stored.is_signed) json["signed"] = true;
  if (run.stored.add != 0) json["add"] = run.stored.add;
  return json;
}

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
  if (volume.rescale != Rescale{})
    json["rescale"] = {{"slope", volume.rescale.slope},
                       {"intercept", volume.rescale.intercept},
                       {"units", volume.rescale.units}};
  json["files"] = volume.files;
  json["warnings"] = volume.warnings;
  for (const SliceRun& run : volume.places) json["places"].push_back(json_of(run));
  json["order"] = volume.any_order ? "any" : "next";
  // Headers may be read once more for the samples.
  json["memory"] = own_memory + 2 * memory_now() + volume.memory;
  return json;
}

OrderedJson json_of(const SeveralVolumes& several) {
  OrderedJson json = {{"answer", "several"}, {"option", several.option}};
  for (const Choice& choice : several.list)
    json["list"].push_back({{"name", choice.name}, {"text", choice.text}});
  return json;
}

void say_error(const std::exception_ptr& exception) {
  const SortedError error = sorted_error(exception);
  const char* kind = error.kind == ErrorKind::usage          ? "usage"
                     : error.kind == ErrorKind::broken_input ? "input"
                                                             : "world";
  OrderedJson answer = {{"answer", "error"}, {"kind", kind}, {"message", error.message}};
  if (error.detail.problem == Problem::slices_missing) answer["option"] = "gaps-ok";
  say(answer);
}

void give_slices(ServedVolume& volume, std::int64_t from, std::int64_t to) {
  if (from < 0 || to > volume.dims.z || from >= to)
    throw UsageError(fmt::format("there are no slices {} to {}", from, to));
  std::vector<std::byte> slice(*sample_bytes({volume.dims.x, volume.dims.y, 1}, volume.type));
  for (std::int64_t z = from; z < to; ++z) {
    volume.read_slice(z, slice.data());
    say({{"answer", "slices"}, {"from", z}, {"to", z + 1}});
    std::fwrite(slice.data(), 1, slice.size(), stdout);
  }
  std::fflush(stdout);
}

void answer(const OrderedJson& request, const OpenServed& open, std::unique_ptr<ServedVolume>& volume) {
  const std::string what = request.value("request", "");
  if (what == "describe") {
    volume.reset();
    volume = open(request.at("path"), request.value("options", ReaderOptions()));
    say(json_of(*volume));
  } else if (what == "slices") {
    if (!volume) throw UsageError("slices are asked for before a description");
    give_slices(*volume, request.at("from"), request.at("to"));
  } else {
    say({{"answer", "unknown"}});
  }
}

}  // namespace

void say_working() {
  using Clock = std::chrono::steady_clock;
  static Clock::time_point last = Clock::now();
  if (Clock::now() - last < std::chrono::seconds(1)) return;
  last = Clock::now();
  say({{"answer", "working"}});
}

std::size_t chosen(const std::string& path, const std::string& option, const std::string& wanted,
                   const std::vector<Choice>& list) {
  if (wanted.empty()) {
    if (list.size() == 1) return 0;
    throw SeveralVolumes{option, list};
  }
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].name == wanted) return i;
  for (std::size_t i = 0; i < list.size(); ++i)
    if (std::to_string(i + 1) == wanted) return i;
  throw UsageError(fmt::format("{}: has no {} {}; without this option, those that it has are listed", path,
                               option, wanted));
}

int serve_volumes(const std::string& name, const OpenServed& open) {
  say({{"tagrid-reader", 1}, {"name", name}, {"version", TAGRID_VERSION}});
  std::unique_ptr<ServedVolume> volume;
  for (std::string line; std::getline(std::cin, line);) {
    try {
      answer(OrderedJson::parse(line), open, volume);
    } catch (const SeveralVolumes& several) {
      say(json_of(several));
    } catch (const std::exception&) {
      say_error(std::current_exception());
    }
  }
  return 0;
}

}  // namespace tagrid
