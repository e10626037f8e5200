#include "tools/catalogue/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/parity/parity.h"
#include "io/system/files.h"
#include "io/tag/file.h"
#include "pipeline/run/run.h"
#include "tools/archive/records.h"
#include "tools/catalogue/facts.h"
#include "tools/repair/survey.h"

namespace tagrid {
namespace {

/// Throws BrokenInput if the file is not what its record says. An original that was removed may have no other copy.
void require_written(const std::string& path, const CatalogueEntry& entry) {
  if (entry.checksum.empty()) return;
  KnownOutput known;
  known.bytes_out = entry.written;
  known.output_checksum = entry.checksum;
  if (!has_written_size(known, path)) throw BrokenInput("has another size than was written");
  if (!is_as_written(known, path))
    throw BrokenInput("is intact, but not what was written: its checksum is not that of its record");
}

void require_intact(const SurveyedParity& parity) {
  if (parity.condition.is_intact()) return;
  throw BrokenInput(parity.condition.is_file_intact() ? "is intact, but its parity is damaged"
                                                      : fmt::format("has {}", damage_text(parity.condition)));
}

/// Parity that is seen without a search through the file.
std::optional<SurveyedParity> parity_of(const std::string& path, const RunOptions& run) {
  if (!parity_at_end(FileSource(path)) && !is_regular_input(parity_beside(path))) return std::nullopt;
  return survey_parity(path, run, "checking parity");
}

void check_entry(const std::string& path, const CatalogueEntry& entry, bool decodes, const RunOptions& run) {
  if (decodes) {
    Ranks alone;
    verify_file(alone, {.input = path, .resources = run.resources(alone)});
  } else {
    TagReader(path).read_to_end();
  }
  require_written(path, entry);
  if (const auto parity = parity_of(path, run)) require_intact(*parity);
}

bool is_repairable(const std::string& path, const RunOptions& run) {
  try {
    const auto parity = survey_parity(path, run, "checking parity");
    return parity && parity->condition.is_repairable() && !parity->condition.is_intact();
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

std::vector<CatalogueEntry> chosen(std::vector<CatalogueEntry> entries, const CheckChoice& choice,
                                   double now) {
  const std::size_t all = entries.size();
  // A clock may have been wrong: what was checked in the future was not.
  const auto last = [&](const CatalogueEntry& entry) {
    return entry.checked && *entry.checked <= now ? *entry.checked : 0;
  };
  // What was never encoded has nothing to be checked.
  std::erase_if(entries, [&](const CatalogueEntry& entry) {
    return entry.status == "failed" || (last(entry) > 0 && now - last(entry) < choice.least_seconds);
  });
  std::ranges::stable_sort(entries, {}, last);
  const auto most = static_cast<std::size_t>(std::ceil(static_cast<double>(all) * choice.percent / 100));
  entries.resize(std::min(entries.size(), most));
  return entries;
}

Checked check_output(const std::string& path, const CatalogueEntry& entry, bool decodes,
                     const RunOptions& run) {
  Checked checked;
  CheckEvent& event = checked.event;
  event.output = entry.name;
  event.status = "ok";
  try {
    if (const auto status = status_of(path)) {
      event.bytes = status->size;
      event.modified = status->modified.in_nanoseconds();
      check_entry(path, entry, decodes, run);
    } else {
      event.status = "missing";
      event.error = entry.is_only_copy ? "is gone, and its original was removed" : "is gone";
    }
  } catch (const BrokenInput& broken) {
    event.status = "damaged";
    event.error = without_path(broken.what(), path);
    checked.is_repairable = is_repairable(path, run);
  } catch (const WorldError& error) {
    // It says nothing of the file.
    event.status = "unknown";
    event.error = without_path(error.what(), path);
  }
  event.finished = seconds_since_1970();
  return checked;
}

}  // namespace tagrid
