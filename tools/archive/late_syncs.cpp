#include "tools/archive/late_syncs.h"

#include "io/errors/errors.h"
#include "io/system/files.h"

namespace tagrid {

void LateSyncs::add(const std::string& folder) {
  const std::lock_guard lock(mutex_);
  folders_.insert(folder);
}

void LateSyncs::append(const std::string& record) {
  const std::lock_guard lock(mutex_);
  records_->append_later(record);
}

void LateSyncs::sync() {
  const std::lock_guard lock(mutex_);
  sync_now();
}

void LateSyncs::sync_now() {
  if (failure_) std::rethrow_exception(failure_);
  for (const std::string& folder : folders_)
    if (const int error = sync_folder(folder); error != 0)
      throw world_error("cannot sync the directory", folder, error);
  folders_.clear();
  if (records_ != nullptr) records_->sync();
  last_ = Clock::now();
}

void LateSyncs::sync_if_due() {
  const std::lock_guard lock(mutex_);
  if (failure_ || Clock::now() - last_ < std::chrono::seconds(1)) return;
  try {
    sync_now();
  } catch (const WorldError&) {
    failure_ = std::current_exception();
  }
}

}  // namespace tagrid
