// What a run returns before its output has a name.
#pragma once

#include <functional>
#include <memory>
#include <utility>

namespace tagrid {

/// The end of a run that went well: everything is written, but the output has no name yet. What has to succeed
/// together with the run comes before commit(). Without commit() the output is removed.
template <class Result>
class [[nodiscard]] Finished {
 public:
  /// `output` has commit(), and its destructor removes what was not committed.
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
