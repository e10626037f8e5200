// The result of a run whose output does not have its name yet.
#pragma once

#include <functional>
#include <memory>
#include <utility>

namespace tagrid {

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
