// What a run reports to its caller: its progress, and in the end its result.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

namespace tagrid {

/// Takes the bytes of samples that are done, and their total. Called by one thread at a time.
using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Watches the work on rows of bricks. An exception from it ends the work.
struct Watch {
  /// Takes the bytes of samples done since the previous call. Called by one thread at a time.
  std::function<void(std::uint64_t bytes)> done;
  /// Called before each read, perhaps while done() runs. May be empty.
  std::function<void()> before_reading = {};
};

/// A watch that passes the progress towards `total` to `progress`, which may be empty. Copies count together.
inline Watch watch_for(const Progress& progress, std::uint64_t total) {
  if (!progress) return {[](std::uint64_t) {}};
  return {[progress, total, done = std::make_shared<std::uint64_t>(0)](std::uint64_t bytes) {
    progress(*done += bytes, total);
  }};
}

/// The result of a successful run: everything is written, but the output does not have its name yet. Steps
/// that must succeed together with the run come before commit(). Without commit() the output is removed.
template <class Result>
class [[nodiscard]] Finished {
 public:
  /// `output` has commit(). Its destructor removes the output if it was not committed.
  template <class Output>
  Finished(Result result_of_run, std::shared_ptr<Output> output)
      : result(std::move(result_of_run)), commit_([output = std::move(output)] { output->commit(); }) {}
  Finished(Finished&&) = default;
  Finished& operator=(Finished&&) = default;

  Result result;

  /// Gives the output its name. To be called once.
  void commit() { std::exchange(commit_, nullptr)(); }

 private:
  std::function<void()> commit_;
};

}  // namespace tagrid
