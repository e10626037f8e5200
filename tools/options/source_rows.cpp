#include "tools/options/source_rows.h"

#include "tools/options/raw_rows.h"

namespace tagrid {
namespace {

using SourceRow = OptionRow<SourceOptions>;

std::vector<SourceRow> all_source_rows() {
  constexpr const char* group = "Other input formats";
  const auto row = [](const char* name, const char* value, const char* help,
                      std::string SourceOptions::*member) {
    return SourceRow{name, group, value, help,
                     [member](SourceOptions& o, const std::string& text) { o.*member = text; }};
  };
  std::vector<SourceRow> rows;
  for (const auto& raw : raw_rows()) {
    const auto set = [set = raw.set](SourceOptions& o, const std::string& text) { set(o.raw, text); };
    rows.push_back({raw.name, raw.group, raw.value, raw.help, set, raw.words});
  }
  rows.push_back(row("from", "FORMAT",
                     "Format of the input (default: from its content, then its name); see tagrid formats",
                     &SourceOptions::from));
  rows.push_back(
      row("series", "NAME|N", "One of several series or volumes, by name or number", &SourceOptions::series));
  rows.push_back(row("dataset", "PATH", "Data set of a file that has several", &SourceOptions::dataset));
  rows.push_back(
      {"gaps-ok", group, "",
       "Read a directory although slice numbers are missing or DICOM images are unreadable",
       [](SourceOptions& o, const std::string& text) { o.gaps_ok = flag_value("gaps-ok", text); }});
  rows.push_back(
      row("vdb-grid", "NAME", "Grid of an OpenVDB file that has several", &SourceOptions::vdb_grid));
  return rows;
}

}  // namespace

SourceDescription SourceOptions::description() const {
  SourceDescription description(raw.description(), vdb_grid);
  description.from = from;
  description.series = series;
  description.dataset = dataset;
  description.gaps_ok = gaps_ok;
  return description;
}

bool SourceOptions::empty() const {
  return !raw.description() && vdb_grid.empty() && from.empty() && series.empty() && dataset.empty() &&
         !gaps_ok;
}

const std::vector<SourceRow>& source_rows() {
  static const std::vector<SourceRow> rows = all_source_rows();
  return rows;
}

void add_source_options(CLI::App& command, SourceOptions& options) {
  for (const auto& row : source_rows()) add_row(command, row, options);
}

}  // namespace tagrid
