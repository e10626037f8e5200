// What is kept of the lines that `convert` does: records, sums, and what is said of them.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/conversion/conversion.h"

namespace tagrid {

/// The record of a line, begun when its work begins. It has all keys from then on: those of which nothing is
/// known are null.
class LineRecord {
 public:
  explicit LineRecord(const ManifestLine& line);

  /// What came of the line goes here.
  nlohmann::ordered_json& json() { return json_; }
  /// The exception that is being handled ended the work.
  void fail();
  /// The line of the record, now.
  std::string text();
  /// What went wrong, in the bytes of the message; "" where nothing did.
  const std::string& error() const { return error_; }

 private:
  using Clock = std::chrono::steady_clock;

  nlohmann::ordered_json json_;
  std::string error_;
  Clock::time_point begin_ = Clock::now();
};

/// Everything that becomes of the lines comes together here: in one process.
class ConversionAccount {
 public:
  /// Both outlive the account.
  ConversionAccount(const RunOptions& run, LineFile& results) : run_(run), results_(results) {}

  /// Appends a record to the results.
  void record(const std::string& text) { results_.append(text); }
  /// Counts a line by its last record, and says what came of it.
  void settle(const ManifestLine& line, const std::string& record, const std::string& error);

  const ConversionSums& sums() const { return sums_; }

 private:
  const RunOptions& run_;
  LineFile& results_;
  ConversionSums sums_;
};

}  // namespace tagrid
