// tagrid formats: the formats of volumes that can be read and written.

#include "io/formats/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/readers/find.h"
#include "tools/commands/commands.h"
#include "tools/report/printable.h"

namespace tagrid {
namespace {

using Json = nlohmann::ordered_json;

/// A format, as users see it.
struct KnownFormat {
  std::string name, help, extensions;
  bool reads = false, writes = false;
  std::string program =
      "";  ///< the path of the reader; "" if tagrid reads the format itself, or if it is missing
  std::string missing = "";  ///< the program that is missing
};

KnownFormat known(const Format& format) {
  KnownFormat result{.name = std::string(format.name),
                     .help = std::string(format.help),
                     .extensions = fmt::format("{}", fmt::join(format.extensions, " ")),
                     .reads = format.is_read() || !format.read_as.empty(),
                     .writes = format.create != nullptr};
  if (format.reader.empty()) return result;
  const auto program = find_reader(format.reader);
  if (program)
    result.program = *program;
  else
    result.missing = fmt::format("tagrid-read-{}", format.reader);
  result.reads = program.has_value();
  return result;
}

std::vector<KnownFormat> known_formats() {
  std::vector<KnownFormat> list;
  for (const Format& format : formats())
    if (format.is_read() || format.create != nullptr) list.push_back(known(format));
  for (const ReaderProgram& reader : all_readers())
    if (read_format_named(reader.name) == nullptr)
      list.push_back({.name = reader.name,
                      .help = "added to this machine",
                      .extensions = "." + reader.name,
                      .reads = true,
                      .program = reader.path});
  return list;
}

Json json_of(const KnownFormat& format) {
  Json json = {
      {"name", format.name}, {"help", format.help}, {"reads", format.reads}, {"writes", format.writes}};
  json["program"] = format.program.empty() ? Json(nullptr) : Json(printable(format.program));
  json["missing"] = format.missing.empty() ? Json(nullptr) : Json(format.missing);
  return json;
}

std::string where(const KnownFormat& format) {
  if (!format.missing.empty())
    return fmt::format("{} is not installed (package tagrid-readers)", format.missing);
  return format.program.empty() ? "built in" : printable(format.program);
}

struct FormatsCommand {
  bool as_json = false;

  void execute() const {
    const std::vector<KnownFormat> list = known_formats();
    if (as_json) {
      Json json = {{"formats", Json::array()}};
      for (const KnownFormat& format : list) json["formats"].push_back(json_of(format));
      fmt::print("{}\n", json.dump(2));
      return;
    }
    const auto described = [](const KnownFormat& format) {
      return fmt::format("{} ({})", format.help, format.extensions);
    };
    std::size_t names = 0, descriptions = 0;
    for (const KnownFormat& format : list) {
      names = std::max(names, format.name.size());
      descriptions = std::max(descriptions, described(format).size());
    }
    const auto print = [&](std::string_view name, std::string_view reads, std::string_view writes,
                           std::string_view description, std::string_view by) {
      fmt::print("{:<{}}  {:<5}  {:<6}  {:<{}}  {}\n", name, names, reads, writes, description, descriptions,
                 by);
    };
    print("format", "reads", "writes", "", "by");
    for (const KnownFormat& format : list)
      print(format.name, format.reads ? "yes" : "-", format.writes ? "yes" : "-", described(format),
            where(format));
  }
};

}  // namespace

Action add_formats_command(CLI::App& app) {
  auto state = std::make_shared<FormatsCommand>();
  CLI::App* command =
      app.add_subcommand("formats", "List the formats of volumes that can be read and written");
  command->add_flag("--json", state->as_json, "Print one JSON object");
  return [state](Ranks&) { state->execute(); };
}

}  // namespace tagrid
