#include "tools/report/run_report.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"
#include "tools/report/info.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

/// As put() writes them.
constexpr std::string_view beginning_of_report = "{\n  \"command\": ";

/// True if two names belong to one file, which need not exist yet.
bool same_name(const std::string& a, const std::string& b) {
  return real_path(path_of(a)) == real_path(path_of(b));
}

}  // namespace

RunFigures figures_of(const TagHeader& header, const TagIndex& index, std::uint64_t bytes_in,
                      std::uint64_t bytes_out) {
  const CodingParameters& parameters = header.parameters;
  RunFigures figures;
  figures.dims = parameters.dims;
  figures.type = parameters.type;
  figures.settings = settings_json(parameters);
  figures.bytes_in = bytes_in;
  figures.bytes_out = bytes_out;
  figures.achieved = achieved_json(header, index.total);
  return figures;
}

RunReport::RunReport(const std::string& path, int threads, bool overwrite, const std::string& command,
                     const std::string& input, const std::string& output, const std::string& another)
    : json_({{"command", command},
             {"version", TAGRID_VERSION},
             {"input", json_text_or_null(input)},
             {"output", json_text_or_null(output)}}),
      threads_(threads) {
  if (path.empty()) return;
  if (path == "-" ? output == "-" : !output.empty() && same_name(path, output))
    throw UsageError("--json {}: is the output itself; choose another file", path);
  if (!another.empty() && another != "-" && same_name(path, another))
    throw UsageError("--json {}: is a file of the volume; choose another file", path);
  if (!input.empty()) refuse_same_file(input, path);
  // A report replaces only an older report: -f is meant for the output, and a wrong name here must not cost a
  // volume. If the file does not exist now, but exists when the report is complete, this run has written it.
  const bool exists = is_regular_output(path) && status_of_name(path);
  if (exists && overwrite && FileBytes(path).peek(1) != "{")
    throw UsageError("--json {}: exists and is not a JSON file; choose another name", path);
  file_.emplace(path, exists && overwrite);
  // If this run fails, the statistics of an earlier run must not be mistaken for its own. Any other
  // JSON file stays until there is a report.
  if (exists && FileBytes(path).peek(beginning_of_report.size()) == beginning_of_report &&
      unlink(path.c_str()) != 0)
    throw world_error("cannot remove the older report", path, errno);
}

void RunReport::write(const RunFigures& figures) {
  if (!file_) return;
  const double seconds = this->seconds();
  const Index3& n = figures.dims;
  const auto voxels =
      static_cast<double>(n.x) * static_cast<double>(n.y) * static_cast<double>(n.z) * figures.volumes;
  nlohmann::ordered_json json = {
      {"dims", {n.x, n.y, n.z}},      {"type", name_of(figures.type)},
      {"volumes", figures.volumes},   {"settings", figures.settings},
      {"bytes_in", figures.bytes_in}, {"bytes_out", figures.bytes_out},
      {"seconds", seconds},           {"threads", threads_},
      {"peak_memory", peak_memory()}, {"voxels_per_second", voxels / std::max(seconds, 1e-9)},
      {"achieved", figures.achieved}};
  json.update(figures.more);
  put(json);
}

void RunReport::write_json(nlohmann::ordered_json figures) {
  if (!file_) return;
  figures["seconds"] = seconds();
  figures["threads"] = threads_;
  put(figures);
}

void RunReport::put(const nlohmann::ordered_json& figures) {
  json_.update(figures);
  file_->write(written_json(json_, 2) + "\n");
  file_->publish();
}

double RunReport::seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

void RunReport::keep() {
  if (file_) file_->keep();
}

}  // namespace tagrid
