// tagrid formats: the formats of volumes that can be read and written.

#include "io/formats/table/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "io/programs/find.h"
#include "io/sandbox/sandbox.h"
#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

using Json = nlohmann::ordered_json;

/// A format, as users see it.
struct KnownFormat {
  std::string name, help, extensions;
  bool reads = false, writes = false;
  std::string reader = {}, writer = {};   ///< paths of programs; "" if it needs none, or if it is missing
  std::vector<std::string> missing = {};  ///< programs that are missing
};

KnownFormat known(const Format& format) {
  // The row that reads such files.
  const Format& reading = format.reads.as.empty() ? format : *read_format_named(format.reads.as);
  KnownFormat result{.name = std::string(format.name),
                     .help = std::string(format.help),
                     .extensions = fmt::format("{}", fmt::join(format.extensions, " ")),
                     .reads = reading.reads.any(),
                     .writes = format.writes.any()};
  const auto look = [&](std::string_view name, const auto& program, const char* kind, std::string& path,
                        bool& can) {
    if (name.empty()) return;
    can = program.has_value();
    path = program.value_or("");
    if (!can) result.missing.push_back(fmt::format("tagrid-{}-{}", kind, name));
  };
  look(reading.reads.program, find_reader(reading.reads.program), "read", result.reader, result.reads);
  look(format.writes.program, find_writer(format.writes.program), "write", result.writer, result.writes);
  return result;
}

std::vector<KnownFormat> known_formats() {
  std::vector<KnownFormat> list;
  for (const Format& format : formats())
    if (format.reads.any() || format.writes.any()) list.push_back(known(format));
  std::map<std::string, KnownFormat> added;
  const auto add = [&](const std::vector<FoundProgram>& programs, bool KnownFormat::*can,
                       std::string KnownFormat::*path) {
    for (const FoundProgram& program : programs) {
      if (read_format_named(program.name) != nullptr) continue;
      KnownFormat& format = added[program.name];
      format.name = program.name;
      format.help = "added to this machine";
      format.extensions = "." + program.name;
      format.*can = true;
      format.*path = program.path;
    }
  };
  add(all_readers(), &KnownFormat::reads, &KnownFormat::reader);
  add(all_writers(), &KnownFormat::writes, &KnownFormat::writer);
  for (auto& [name, format] : added) list.push_back(std::move(format));
  return list;
}

Json json_of(const KnownFormat& format) {
  return {{"name", json_text(format.name)},
          {"help", json_text(format.help)},
          {"reads", format.reads},
          {"writes", format.writes},
          {"program", json_text_or_null(format.reader)},
          {"writer", json_text_or_null(format.writer)},
          {"missing", json_text_or_null(fmt::format("{}", fmt::join(format.missing, " ")))}};
}

std::string where(const KnownFormat& format) {
  if (!format.missing.empty())
    return fmt::format("{} {} not installed (package {})", fmt::join(format.missing, " and "),
                       format.missing.size() > 1 ? "are" : "is", package_of_program(format.name));
  std::vector<std::string> programs;
  for (const std::string& path : {format.reader, format.writer})
    if (!path.empty()) programs.push_back(printable(path));
  return programs.empty() ? "built in" : fmt::format("{}", fmt::join(programs, ", "));
}

struct FormatsCommand {
  bool as_json = false, verbose = false;

  void execute() const {
    const std::vector<KnownFormat> list = known_formats();
    if (as_json) {
      Json json = {{"formats", Json::array()}};
      for (const KnownFormat& format : list) json["formats"].push_back(json_of(format));
      json["sandbox"] = sandbox_in_words();
      fmt::print("{}\n", written_json(json, 2));
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
    if (verbose)
      fmt::print("\nsandbox of the programs that come with tagrid and read formats: {}\n",
                 sandbox_in_words());
  }
};

}  // namespace

Action add_formats_command(CLI::App& app) {
  auto state = std::make_shared<FormatsCommand>();
  CLI::App* command = app.add_subcommand("formats", "List the formats that can be read and written");
  command->add_flag("--json", state->as_json, "Print one JSON object");
  command->add_flag("-v,--verbose", state->verbose,
                    "Also print the sandbox of the programs that read formats");
  return [state](Ranks&) { state->execute(); };
}

}  // namespace tagrid
