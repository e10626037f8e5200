#include "io/programs/writer_conversation.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/metadata/text.h"
#include "io/programs/answers.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

Json json_of(const VolumeInfo& info) {
  const Geometry& g = info.geometry();
  Json json = {{"dims", {info.dims.x, info.dims.y, info.dims.z}},
               {"type", name_of(info.type)},
               {"nrrd", text_of(info.metadata)},
               {"pairs", Json::object()}};
  if (g.has_directions)
    json["directions"] = g.directions;
  else if (g.has_spacing)
    json["spacing"] = g.spacing;  // null where it is not known
  if (g.has_origin || g.origin != Geometry().origin) json["origin"] = g.origin;
  if (!g.space.empty()) json["space"] = g.space;
  if (!g.units[0].empty()) json["units"] = g.units[0];
  for (const auto& [key, value] : info.metadata.pairs()) json["pairs"][key] = value;
  return json;
}

Json json_of(const MeshLayout::Data& data) {
  Json list = Json::array();
  for (const auto& [name, type] : data) list.push_back({{"name", name}, {"type", name_of(type)}});
  return list;
}

Json json_of(const MeshLayout& mesh) {
  Json json = {{"points", mesh.points},
               {"tetrahedra", mesh.tetrahedra},
               {"point_data", json_of(mesh.point_data)},
               {"cell_data", json_of(mesh.cell_data)}};
  if (mesh.nodes != 4) json["nodes"] = mesh.nodes;
  for (const MeshField& field : mesh.fields)
    json["fields"].push_back(field.texts.empty() ? Json{{"name", field.name}, {"numbers", field.numbers}}
                                                 : Json{{"name", field.name}, {"texts", field.texts}});
  return json;
}

/// Lines of older programs may be in Latin-1. JSON is UTF-8.
std::string in_utf8(std::string_view lines) {
  std::string result;
  while (!lines.empty()) {
    const std::string line(lines.substr(0, lines.find('\n')));
    lines.remove_prefix(std::min(line.size() + 1, lines.size()));
    const bool is_good = is_utf8(line);
    for (const char c : line)
      if (const auto byte = static_cast<unsigned char>(c); is_good || byte < 0x80)
        result += c;
      else
        result += {static_cast<char>(0xc0 | byte >> 6), static_cast<char>(0x80 | (byte & 0x3f))};
    result += '\n';
  }
  return result;
}

}  // namespace

std::vector<MeshArray> MeshLayout::arrays() const {
  std::vector<MeshArray> all = {{positions_array, points, 3 * sizeof(double)},
                                {connectivity_array, tetrahedra, nodes * sizeof(std::int64_t)}};
  for (const auto& [name, type] : point_data) all.push_back({name, points, size_of(type)});
  for (const auto& [name, type] : cell_data) all.push_back({name, tetrahedra, size_of(type)});
  return all;
}

WriterConversation::WriterConversation(const std::string& program, const FormatProgram::Limits& limits)
    : process_(program, limits) {
  hear_hello(process_, "writer");
}

WriterReady WriterConversation::begin(const std::string& path, const std::string& name,
                                      const VolumeInfo& info, const WriterOptions& options) {
  const std::string& text = text_of(info.metadata);
  const bool is_text = is_utf8(text);
  VolumeInfo volume = info;
  if (!is_text) {
    volume.metadata = parse_metadata(in_utf8(text));
    volume.metadata.set_origin(info.geometry().origin);
  }
  WriterReady ready = begin({{"request", "write"},
                             {"path", path},
                             {"name", name},
                             {"volume", json_of(volume)},
                             {"options", options}},
                            name);
  if (!is_text)
    ready.warnings.push_back(name + ": texts that are not UTF-8 are taken as Latin-1, and written as UTF-8");
  return ready;
}

WriterReady WriterConversation::begin(const std::string& path, const std::string& name,
                                      const MeshLayout& mesh, const WriterOptions& options) {
  return begin({{"request", "write-mesh"},
                {"path", path},
                {"name", name},
                {"mesh", json_of(mesh)},
                {"options", options}},
               name);
}

WriterReady WriterConversation::begin(const Json& request, const std::string& name) {
  process_.writes(name);
  say_request(process_, request, name);
  return with(process_, [&] {
    const Json answer = required(next_answer(process_), "ready");
    const std::int64_t memory = count_in(answer, "memory", -1, 0);
    if (memory < 0) throw WrongAnswer("does not say how much memory it takes");
    process_.limit_memory(static_cast<std::uint64_t>(memory));
    return WriterReady{static_cast<std::uint64_t>(memory), texts_in(answer, "warnings")};
  });
}

void WriterConversation::announce_slices(std::int64_t from, std::int64_t to) {
  say({{"request", "slices"}, {"from", from}, {"to", to}});
}

void WriterConversation::announce_entries(const std::string& array, std::int64_t from, std::int64_t to) {
  say({{"request", "array"}, {"name", array}, {"from", from}, {"to", to}});
}

void WriterConversation::say(const Json& request) {
  const std::string line = request.dump() + '\n';
  write(reinterpret_cast<const std::byte*>(line.data()), line.size());
}

void WriterConversation::write(const std::byte* bytes, std::size_t size) {
  for (;;) {
    const std::size_t sent = process_.write(bytes, size);
    listen();
    if (sent == size) return;
    bytes += sent;
    size -= sent;
  }
}

void WriterConversation::listen() {
  with(process_, [&] {
    while (process_.has_line())
      if (const std::string kind = text_in(heard_answer(process_), "answer"); kind != "working")
        throw WrongAnswer(fmt::format("it answers \"{}\" while it is given bytes", kind));
  });
}

std::string WriterConversation::finish() {
  say({{"request", "finish"}});
  return with(process_, [&] {
    const Json answer = required(next_answer(process_), "done");
    const Json& facts = member(answer, "facts");
    if (!facts.is_null() && !facts.is_object()) throw WrongAnswer("\"facts\" is not an object");
    process_.finish();
    return facts.is_null() ? "{}" : facts.dump();
  });
}

}  // namespace tagrid
