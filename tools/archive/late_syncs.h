// Directories and records of a run become durable together, about once a second.
#pragma once

#include <chrono>
#include <exception>
#include <mutex>
#include <set>
#include <string>

#include "io/files/held_files.h"

namespace tagrid {

/// What a power failure may still take: names of new directories, and records of outputs. The outputs themselves are
/// durable before they get their names. Who encodes the volumes again finds the outputs that have no record, and makes
/// those that are lost. So nothing may be removed before sync(). Several threads may use it.
class LateSyncs {
 public:
  /// `records`: null if another process writes them.
  explicit LateSyncs(LineFile* records) : records_(records) {}

  /// A name in this directory has to become durable.
  void add(const std::string& folder);
  void append(const std::string& record);
  /// Makes everything durable: directories first, so that records are true. Throws WorldError.
  void sync();
  /// The same, if the last time is long ago. If it fails, the next sync() does.
  void sync_if_due();

 private:
  using Clock = std::chrono::steady_clock;

  void sync_now();

  std::mutex mutex_;
  LineFile* records_;
  std::set<std::string> folders_;
  Clock::time_point last_ = Clock::now();
  std::exception_ptr failure_;
};

}  // namespace tagrid
