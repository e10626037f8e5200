// What a run reports to its caller: its progress, and in the end its result.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <utility>

namespace tagrid {

/// Takes the bytes of samples that are done, and their total. Called by one thread at a time.
using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Watches the work on rows of bricks. An exception from it ends the work.
class Watch {
 public:
  virtual ~Watch() = default;
  /// Called before each read, perhaps while done() runs.
  virtual void before_reading() {}
  /// Called by a worker when it is done with a brick, before bricks are put in order; several may call it at
  /// once.
  virtual void brick_done(std::int64_t /*brick*/) {}
  /// Takes the bytes of samples done since the previous call. Called by one thread at a time.
  virtual void done(std::uint64_t /*bytes*/) {}
};

/// Passes the progress towards `total` to `progress`, which may be empty.
class ProgressWatch : public Watch {
 public:
  ProgressWatch(Progress progress, std::uint64_t total) : progress_(std::move(progress)), total_(total) {}
  void done(std::uint64_t bytes) override {
    done_ += bytes;
    if (progress_) progress_(done_, total_);
  }

 private:
  Progress progress_;
  std::uint64_t total_, done_ = 0;
};

/// The failure of what takes the results of some work. It tells more than that of a source that gave up
/// because of it, which may be thrown first. Both functions are for handlers of exceptions.
class SinkFailure {
 public:
  /// Keeps the current exception, which is that of the sink.
  void keep() { failure_ = std::current_exception(); }
  /// Throws what was kept; otherwise, the current exception again.
  [[noreturn]] void rethrow() const {
    std::rethrow_exception(failure_ ? failure_ : std::current_exception());
  }

 private:
  std::exception_ptr failure_;
};

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
