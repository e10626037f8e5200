// tagrid archive: what is in an archive, that it is intact, and what its keepers do with it.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/catalogue/forget.h"
#include "tools/catalogue/move.h"
#include "tools/commands/archive_command.h"
#include "tools/commands/commands.h"
#include "tools/report/failure.h"
#include "tools/report/human_bytes.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// list, find

ordered_json time_or_null(const std::optional<double>& seconds) {
  return seconds ? ordered_json(*seconds) : ordered_json(nullptr);
}

ordered_json json_of(const Catalogue& catalogue, const CatalogueEntry& entry) {
  ordered_json json = {
      {"name", text_of_name(entry.name)},
      {"path", text_of_name(catalogue.path_of(entry.name))},
      {"status", entry.status},
      {"problem", json_text_or_null(entry.problem)},
      {"bytes", entry.bytes ? ordered_json(*entry.bytes) : ordered_json(nullptr)},
      {"original",
       entry.recorded ? ordered_json(entry.is_only_copy ? "removed" : "kept") : ordered_json(nullptr)},
      {"input", entry.input.empty() ? ordered_json(nullptr) : ordered_json(text_of_name(entry.input))},
      {"recorded", time_or_null(entry.recorded)},
      {"checked", time_or_null(entry.checked)},
      {"check", json_text_or_null(entry.check)}};
  if (!entry.facts.empty()) json.update(ordered_json::parse(entry.facts));
  return json;
}

std::string shown(const std::string& text) { return text.empty() ? "-" : printable(text); }

struct ListCommand : ArchiveCommand {
  bool json = false, print0 = false, needs_wanted = false;

  void execute() const {
    if (needs_wanted && wanted.empty())
      throw UsageError("find: give conditions, such as patient=Smith* or study_date>=2020-01-01");
    if (json && print0) throw UsageError("--json and --print0: choose one of them");
    const Catalogue catalogue = opened();
    Query query = catalogue.query_of(wanted);
    query.wants_json = json;
    bool is_first = true;
    catalogue.for_each(query, [&](const CatalogueEntry& entry) {
      if (json)
        fmt::print("{}\n{}", is_first ? "[" : ",", written_json(json_of(catalogue, entry)));
      else if (print0)
        fmt::print("{}{}", catalogue.path_of(entry.name), '\0');
      else
        print(entry);
      is_first = false;
    });
    if (json) fmt::print("{}\n]\n", is_first ? "[" : "");
  }

  static void print(const CatalogueEntry& entry) {
    const bool has_ratio = entry.bytes && *entry.bytes > 0 && entry.raw_bytes > 0;
    fmt::print("{:<10}  {:>8}  {:>6}  {:<10}  {:<4}  {:<20}  {}{}\n", entry.status,
               entry.bytes ? human_bytes(*entry.bytes) : "-",
               has_ratio ? fmt::format("{:.2f}", static_cast<double>(entry.raw_bytes) /
                                                     static_cast<double>(*entry.bytes))
                         : "-",
               shown(entry.study_date), shown(entry.modality), shown(entry.patient), printable(entry.name),
               entry.problem.empty() ? "" : ": " + printable(entry.problem));
  }
};

Action add_list(CLI::App& app, const std::string& name, const std::string& help, bool needs_wanted) {
  auto state = std::make_shared<ListCommand>();
  state->needs_wanted = needs_wanted;
  CLI::App* command = add_archive_action(app, *state, name, help);
  command->add_flag("--json", state->json, "Print a JSON array, with one volume per line")
      ->disable_flag_override();
  command->add_flag("--print0", state->print0, "Print only paths, for xargs -0");
  add_keys_option(*command, *state);
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks&) { state->execute(); };
}

// forget

struct ForgetCommand : ArchiveCommand {
  bool yes = false;

  void execute() const {
    run.obey_memory_limit();
    // Before anything is looked up: it removes what a killed run left, which has names.
    RecordsEditor records(folder, keys);
    const Catalogue catalogue = opened();
    const std::vector<CatalogueEntry> entries = named(catalogue, "archive forget");
    require_consent(entries);
    const Forgotten forgotten = forget(catalogue, entries, records);
    if (!run.quiet)
      fmt::print("{} forgotten: {} and {} removed, {}\n", counted(entries.size(), "volume"),
                 counted(forgotten.outputs, "output"), counted(forgotten.records, "record"),
                 human_bytes(forgotten.bytes));
    std::fflush(stdout);
    for (const std::string& place : forgotten.unknown)
      say("tagrid: {} is not a record, and stays; it may have a name", place);
    for (const std::string& path : forgotten.found)
      say("tagrid: {}: still has a name of these volumes", path);
    if (!forgotten.unknown.empty() || !forgotten.found.empty())
      throw BrokenInput("{}: names may be left; see above", folder);
  }

  void require_consent(const std::vector<CatalogueEntry>& entries) const {
    if (yes) return;
    const auto only = static_cast<std::size_t>(std::ranges::count_if(entries, &CatalogueEntry::is_only_copy));
    const std::string what =
        fmt::format("{}, of which {} the only {} of removed originals", counted(entries.size(), "volume"),
                    only == 1 ? "one is" : fmt::format("{} are", only), only == 1 ? "copy" : "copies");
    if (!is_terminal(standard_input) || !is_terminal(standard_error))
      throw UsageError("archive forget: would remove {}; confirm it with --yes", what);
    constexpr std::size_t most = 20;
    for (std::size_t i = 0; i < std::min(entries.size(), most); ++i) say("  {}", entries[i].name);
    if (entries.size() > most) say("  and {} more", entries.size() - most);
    say("Remove {} for good? Type yes:", what);
    std::string answer;
    std::getline(std::cin, answer);
    if (answer != "yes") throw UsageError("archive forget: nothing was removed");
  }
};

Action add_forget(CLI::App& app) {
  auto state = std::make_shared<ForgetCommand>();
  CLI::App* command = add_archive_action(
      app, *state, "forget", "Remove volumes for good: outputs, records, and names in the archive");
  command->add_flag("--yes", state->yes, "Do not ask");
  add_keys_option(*command, *state);
  add_run_options(*command, state->run);
  return [state](Ranks&) { state->execute(); };
}

// move

struct MoveCommand : ArchiveCommand {
  std::string from, to;

  void execute() const {
    const std::string old = absolute(from, "--from"), now = text_of(real_path(path_of(absolute(to, "--to"))));
    Moved moved = move_originals(folder, old, now, keys);
    // Records have paths without links.
    if (moved.changed == 0) moved = move_originals(folder, text_of(real_path(path_of(old))), now, keys);
    for (const std::string& place : moved.unknown)
      say("tagrid: {} is not a record, and stays as it is", place);
    if (moved.changed == 0)
      throw UsageError("--from {}: no record in {} names a file below it{}", from, folder,
                       keys.empty() ? "; if it is an archive without names, give --keys FILE" : "");
    if (!is_folder(to)) warn(run, "{}: does not exist yet", to);
    if (!run.quiet) fmt::print("{} of {} changed\n", moved.changed, counted(moved.records, "record"));
  }

  static std::string absolute(const std::string& path, const char* option) {
    if (path.empty()) throw UsageError("give {} DIR", option);
    std::string text = text_of(normal_path(absolute_path(path_of(path))));
    while (text.size() > 1 && text.ends_with('/')) text.pop_back();
    return text;
  }
};

Action add_move(CLI::App& app) {
  auto state = std::make_shared<MoveCommand>();
  CLI::App* command = add_archive_action(app, *state, "move",
                                         "Tell the records that the directory of originals has moved", false);
  add_text_option(*command, "--from", state->from, "DIR", "The directory that the records name");
  add_text_option(*command, "--to", state->to, "DIR", "The directory in its place");
  add_keys_option(*command, *state);
  add_run_options(*command, state->run);
  return [state](Ranks&) { state->execute(); };
}

}  // namespace

Catalogue ArchiveCommand::opened() const {
  run.obey_memory_limit();
  std::optional<KeyFile> key_file;
  if (!keys.empty()) key_file.emplace(keys);
  Catalogue catalogue(folder, run.thread_count(), key_file ? &*key_file : nullptr);
  for (const std::string& remark : catalogue.remarks()) warn(run, remark);
  return catalogue;
}

std::vector<CatalogueEntry> ArchiveCommand::named(const Catalogue& catalogue, const char* command) const {
  if (wanted.empty())
    throw UsageError("{}: give names of volumes or conditions, such as patient=Smith* or 'name=*'", command);
  return matching(catalogue);
}

std::vector<CatalogueEntry> ArchiveCommand::matching(const Catalogue& catalogue) const {
  std::vector<CatalogueEntry> entries = catalogue.entries(catalogue.query_of(wanted));
  // A mistake in a condition must not look as if all was done.
  if (entries.empty() && !wanted.empty())
    throw UsageError("{}: no volume matches {}", folder, fmt::join(wanted, " "));
  return entries;
}

void add_keys_option(CLI::App& command, ArchiveCommand& state) {
  add_text_option(command, "--keys", state.keys, "FILE", "Key file of an archive without names");
}

CLI::App* add_archive_action(CLI::App& app, ArchiveCommand& state, const std::string& name,
                             const std::string& help, bool takes_wanted) {
  const auto groups = app.get_subcommands([](const CLI::App* one) { return one->get_name() == "archive"; });
  CLI::App* group = groups.empty() ? nullptr : groups.front();
  if (group == nullptr) {
    group = app.add_subcommand("archive", "List, search, check and keep the volumes of an archive");
    group->require_subcommand(1);
  }
  CLI::App* command = group->add_subcommand(name, help);
  command->add_option("DIR", state.folder, "Directory of the outputs and their records")->required();
  if (takes_wanted)
    command
        ->add_option("VOLUME", state.wanted,
                     "Names of outputs, and conditions: patient=Smith*, study_date>=2020")
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return command;
}

Action add_archive_list_command(CLI::App& app) {
  return add_list(app, "list", "List the volumes of an archive, one per line", false);
}
Action add_archive_find_command(CLI::App& app) {
  return add_list(app, "find", "List the volumes that meet conditions", true);
}
Action add_archive_forget_command(CLI::App& app) { return add_forget(app); }
Action add_archive_move_command(CLI::App& app) { return add_move(app); }

}  // namespace tagrid
