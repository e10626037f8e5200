// --json FILE: the statistics of a run, for scripts.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "io/files/output_file.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// Figures of a run.
struct RunFigures {
  Index3 dims;  ///< of each volume
  SampleType type = SampleType::uint8;
  nlohmann::ordered_json settings;
  std::uint64_t bytes_in = 0, bytes_out = 0;
  nlohmann::ordered_json achieved;  ///< errors against the original; null if nothing is known of them
  nlohmann::ordered_json more = nlohmann::ordered_json::object();  ///< what only some runs have
  int volumes = 1;
};

/// Those of a run on a .tag file.
RunFigures figures_of(const TagHeader& header, const TagIndex& index, std::uint64_t bytes_in,
                      std::uint64_t bytes_out);

/// Create it before the run, so that a bad name is found first and time is measured.
class RunReport {
 public:
  /// `path` is the report's file, "" if none was requested. An older report there is removed, so that a run that fails
  /// leaves none. `input` is null ("") if there is none. Throws
  /// UsageError if the file exists and `overwrite` is false, or if it is the input, the output, or `another`
  /// file that the run reads or writes ("": none).
  RunReport(const std::string& path, int threads, bool overwrite, const std::string& command,
            const std::string& input, const std::string& output, const std::string& another = "");

  /// Ends the run: measures its time, and writes the report if one was requested. Without keep() the file is
  /// removed again: a run has succeeded only when its output has its name, too.
  void write(const RunFigures& figures);
  /// The same, then gives the output its name and keeps the report. `finished` has commit(): a Finished.
  template <class Output>
  void write(const RunFigures& figures, Output& finished) {
    write(figures);
    finished.commit();
    keep();
  }
  /// The same for a run that is not about one volume; `figures` is an object.
  void write_json(nlohmann::ordered_json figures);
  void keep();

 private:
  using Clock = std::chrono::steady_clock;

  double seconds() const;
  void put(const nlohmann::ordered_json& figures);

  nlohmann::ordered_json json_;  ///< what is known before the run
  int threads_;
  std::optional<OutputFile> file_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace tagrid
