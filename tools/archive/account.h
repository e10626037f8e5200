// Records, sums and messages for the lines that `convert` processes.
#pragma once

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/archive/conversion.h"

namespace tagrid {

/// The record of a line, created when its work begins. From then on it has all keys; unknown values are null.
class LineRecord {
 public:
  /// `sequence`: see KnownOutputs::next_sequence().
  LineRecord(const ManifestLine& line, std::uint64_t sequence);

  /// The results for the line are added here.
  nlohmann::ordered_json& json() { return json_; }
  /// Records that the exception being handled ended the work, on this machine if it has to be named.
  void fail(const std::string& machine = {});
  /// The line of the record, as it is now.
  std::string text();
  /// The error message in its original bytes; "" if nothing failed.
  const std::string& error() const { return error_; }

 private:
  using Clock = std::chrono::steady_clock;

  nlohmann::ordered_json json_;
  std::string error_;
  Clock::time_point begin_ = Clock::now();
};

/// Collects the results of all lines, in one process.
class ConversionAccount {
 public:
  /// Both must outlive the account.
  ConversionAccount(const RunOptions& run, LineFile& results) : run_(run), results_(results) {}

  /// Appends a record to the results.
  void record(const std::string& text) { results_.append(text); }
  /// Counts a line by its last record, and reports its result.
  void settle(const ManifestLine& line, const std::string& record, const std::string& error);

  const ConversionSums& sums() const { return sums_; }

 private:
  const RunOptions& run_;
  LineFile& results_;
  ConversionSums sums_;
};

}  // namespace tagrid
