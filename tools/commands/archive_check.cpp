// tagrid archive check and repair: the volumes of an archive are intact, or become so again.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/held_files.h"
#include "io/text/text.h"
#include "pipeline/threads/threads.h"
#include "tools/archive/manifest.h"
#include "tools/catalogue/check.h"
#include "tools/catalogue/lines.h"
#include "tools/commands/archive_command.h"
#include "tools/commands/commands.h"
#include "tools/repair/repair.h"
#include "tools/report/failure.h"
#include "tools/report/human_bytes.h"
#include "tools/report/process.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

/// A part of a hundred: "5%", or "5".
double percentage(const std::string& option, std::string text) {
  if (text.ends_with('%')) text.pop_back();
  const auto number = finite_number(text);
  if (!number || *number <= 0 || *number > 100)
    throw UsageError("{} {}: must be above 0% and at most 100%, such as 5%", option, text);
  return *number;
}

/// Seconds: "90d", "2h", "30m", "45s".
double duration(const std::string& option, const std::string& text) {
  constexpr std::pair<char, double> units[] = {{'s', 1}, {'m', 60}, {'h', 3600}, {'d', 86400}, {'w', 604800}};
  for (const auto& [unit, seconds] : units)
    if (text.ends_with(unit))
      if (const auto number = finite_number(std::string_view(text).substr(0, text.size() - 1));
          number && *number > 0)
        return *number * seconds;
  throw UsageError("{} {}: must be a time, such as 90d, 12h, 30m or 45s", option, text);
}

/// Checks volumes and records what was found, in the order in which they are given.
class CheckRun {
 public:
  CheckRun(const Catalogue& catalogue, const RunOptions& run) : catalogue_(catalogue), run_(run) {
    const std::string path = catalogue.path_of(std::string(events_name) + ".jsonl");
    refuse_link(path);
    try {
      events_.emplace(path);
    } catch (const HeldByAnother&) {
      throw;
    } catch (const WorldError& error) {
      warn(run, "{}; the checks are not recorded", error.what());
    }
  }

  /// Checks the first of `entries`, as many as threads can at once, and passes on the results in their order.
  template <class Take>
  std::size_t check_some(std::span<const CatalogueEntry> entries, bool decodes, const Take& take) {
    const std::size_t count = std::min(entries.size(), static_cast<std::size_t>(threads_.count()));
    RunOptions each = run_;
    if (each.memory) *each.memory /= static_cast<std::uint64_t>(threads_.count());
    each.threads = 1;
    each.progress = ProgressStyle::none;
    std::vector<Checked> found(count);
    threads_.run([&] {
      share_rows(static_cast<std::int64_t>(count), bytes_of_task, 1, [&](std::int64_t i, std::int64_t) {
        const CatalogueEntry& entry = entries[static_cast<std::size_t>(i)];
        found[static_cast<std::size_t>(i)] =
            check_output(catalogue_.path_of(entry.name), entry, decodes, each);
      });
    });
    record(found);
    for (const Checked& checked : found) take(checked);
    return count;
  }

 private:
  /// A full disk does not end the checks.
  void record(const std::vector<Checked>& found) {
    if (!events_) return;
    std::vector<std::string> lines;
    for (const Checked& checked : found)
      if (checked.event.status != "unknown") lines.push_back(line_of(checked.event));
    try {
      events_->append(lines);
    } catch (const WorldError& error) {
      warn(run_, "{}; from here on, checks are not recorded", error.what());
      events_.reset();
    }
  }

  const Catalogue& catalogue_;
  const RunOptions& run_;
  Threads threads_{run_.thread_count()};
  std::optional<LineFile> events_;
};

struct CheckCommand : ArchiveCommand {
  std::string sample, older_than, budget;
  bool decodes = false, overwrite = false;

  void execute() const {
    CheckChoice choice;
    if (!sample.empty()) choice.percent = percentage("--sample", sample);
    if (!older_than.empty()) choice.least_seconds = duration("--older-than", older_than);
    const double most_seconds = budget.empty() ? INFINITY : duration("--budget", budget);
    const Catalogue catalogue = opened();
    RunReport report(run.json, run.thread_count(), overwrite, "archive check", folder, "");
    const std::vector<CatalogueEntry> all = matching(catalogue);
    const std::vector<CatalogueEntry> entries = chosen(all, choice, seconds_since_1970());
    CheckRun checks(catalogue, run);
    ListMeter meter(run.progress, run.quiet, entries.size());
    Sums sums;
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < entries.size();) {
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
      if (passed.count() > most_seconds) break;
      meter.begin_volume(entries[i].name);
      i += checks.check_some(std::span(entries).subspan(i), decodes, [&](const Checked& checked) {
        tell(checked);
        sums.add(checked);
        meter.end_volume(checked.event.bytes);
      });
    }
    report.write_json({{"volumes", all.size()},
                       {"checked", sums.checked},
                       {"ok", sums.ok()},
                       {"damaged", sums.damaged},
                       {"repairable", sums.repairable},
                       {"missing", sums.missing},
                       {"unknown", sums.unknown},
                       {"bytes_in", sums.bytes}});
    report.keep();
    if (!run.quiet && run.json != "-")
      fmt::print("checked {} of {}, {}: {} ok, {} damaged ({} repairable), {} missing{}\n", sums.checked,
                 counted(all.size(), "volume"), human_bytes(sums.bytes), sums.ok(), sums.damaged,
                 sums.repairable, sums.missing,
                 sums.unknown > 0 ? fmt::format(", {} could not be read", sums.unknown) : "");
    std::fflush(stdout);
    if (sums.damaged + sums.missing > 0)
      throw BrokenInput("{}: {} of {} checked volumes {} not intact{}", folder, sums.damaged + sums.missing,
                        sums.checked, sums.damaged + sums.missing == 1 ? "is" : "are",
                        sums.repairable > 0
                            ? fmt::format("; `tagrid archive repair {}` repairs {}", folder, sums.repairable)
                            : "");
    if (sums.unknown > 0)
      throw WorldError("{}: {} could not be read", folder, counted(sums.unknown, "volume"));
  }

  struct Sums {
    std::size_t checked = 0, damaged = 0, repairable = 0, missing = 0, unknown = 0;
    std::uint64_t bytes = 0;

    std::size_t ok() const { return checked - damaged - missing - unknown; }
    void add(const Checked& found) {
      ++checked;
      damaged += found.event.status == "damaged";
      missing += found.event.status == "missing";
      unknown += found.event.status == "unknown";
      repairable += found.is_repairable;
      bytes += found.event.bytes;
    }
  };

  void tell(const Checked& checked) const {
    const CheckEvent& event = checked.event;
    if (event.status != "ok")
      fmt::print("{}  {}: {}{}\n", event.status, printable(event.output), printable(event.error),
                 checked.is_repairable ? "; its parity can repair it" : "");
    else if (run.is_verbose())
      fmt::print("ok  {}\n", printable(event.output));
  }
};

Action add_check(CLI::App& app) {
  auto state = std::make_shared<CheckCommand>();
  CLI::App* command =
      add_archive_action(app, *state, "check", "Check that volumes are intact, and record when");
  add_text_option(*command, "--sample", state->sample, "P%",
                  "Check P percent of the volumes, oldest check first");
  add_text_option(*command, "--older-than", state->older_than, "TIME",
                  "Check only volumes whose last check was so long ago: 90d, 12h");
  add_text_option(*command, "--budget", state->budget, "TIME",
                  "Begin no other volume after this time: 2h, 30m");
  command->add_flag("--decode", state->decodes, "Also decode every brick, as verify does");
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  add_json_option(*command, state->run);
  command->add_flag("-f,--force", state->overwrite, "Overwrite files that exist");
  return [state](Ranks&) { state->execute(); };
}

struct ArchiveRepairCommand : ArchiveCommand {
  /// Those that are wanted, otherwise all that are known to be damaged.
  std::vector<CatalogueEntry> chosen_entries(const Catalogue& catalogue) const {
    if (!wanted.empty()) return matching(catalogue);
    std::vector<CatalogueEntry> entries;
    for (const char* status : {"damaged", "unreadable"})
      for (CatalogueEntry& entry : catalogue.entries({.conditions = {{"status", "=", status}}}))
        entries.push_back(std::move(entry));
    return entries;
  }

  void execute(const Ranks& ranks) const {
    const Catalogue catalogue = opened();
    CheckRun checks(catalogue, run);
    std::size_t repaired = 0, intact = 0, failed = 0;
    std::vector<CatalogueEntry> unchecked;
    for (const CatalogueEntry& entry : chosen_entries(catalogue)) {
      const std::string path = catalogue.path_of(entry.name);
      try {
        require_own_folders(catalogue.folder(), entry.name);
        const UnchangedFiles watched(entry.bytes ? std::vector{path} : std::vector<std::string>());
        const auto parity = entry.bytes ? survey_parity(path, run, "repairing a file") : std::nullopt;
        if (!entry.bytes) throw BrokenInput(path + ": is gone");
        if (!parity) throw BrokenInput(path + ": has no parity, or none of its descriptions is left");
        if (!parity->condition.is_intact()) {
          if (!parity->condition.is_repairable())
            throw BrokenInput("{}: {}", path, why_not_repairable(*parity, path));
          remove_abandoned(run, {}, {path});
          repair_file(*parity, watched, path, path, true, run, ranks);
        }
        checks.check_some({&entry, 1}, false, [&](const Checked& checked) {
          if (checked.event.status != "ok") throw BrokenInput("{}: {}", path, checked.event.error);
        });
        ++(parity->condition.is_intact() ? intact : repaired);
        if (run.is_verbose())
          fmt::print("{}  {}\n", parity->condition.is_intact() ? "intact" : "repaired",
                     printable(entry.name));
      } catch (const Error& error) {
        ++failed;
        say("tagrid: {}", current_failure().message);
        if (entry.bytes && entry.check != "damaged") unchecked.push_back(entry);
      }
    }
    // Otherwise, `convert --skip-done` would skip them.
    for (std::size_t i = 0; i < unchecked.size();)
      i += checks.check_some(std::span(unchecked).subspan(i), false, [](const Checked&) {});
    if (!run.quiet) fmt::print("{} repaired, {} intact, {} not repaired\n", repaired, intact, failed);
    std::fflush(stdout);
    if (failed > 0)
      throw BrokenInput(
          "{}: {} could not be repaired; restore {} from a copy, or remove {} and convert again with "
          "--skip-done if {} still there",
          folder, counted(failed, "volume"), failed == 1 ? "it" : "them", failed == 1 ? "it" : "them",
          failed == 1 ? "its original is" : "their originals are");
  }
};

Action add_repair(CLI::App& app) {
  auto state = std::make_shared<ArchiveRepairCommand>();
  CLI::App* command = add_archive_action(
      app, *state, "repair", "Repair volumes from their parity: those named, or all damaged ones");
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace

Action add_archive_check_command(CLI::App& app) { return add_check(app); }
Action add_archive_repair_command(CLI::App& app) { return add_repair(app); }

}  // namespace tagrid
