// An output that fails ends a run at once, even while the input is a pipe from which nothing comes.
#pragma once

#include <atomic>
#include <exception>

namespace tagrid {

/// Runs the work of one node of a flow graph. If that throws, failed() becomes true, for the nodes that wait
/// for something else; and since they may then throw as well, it is the exception that counts.
class UntilItFails {
 public:
  /// REQUIRES: never called at the same time.
  template <class Work>
  void run(Work work) {
    try {
      work();
    } catch (...) {
      exception_ = std::current_exception();
      failed_ = true;
      throw;
    }
  }

  /// Runs the graph itself.
  template <class Graph>
  void rethrow_after(Graph run_graph) {
    try {
      run_graph();
    } catch (...) {
      if (failed_) std::rethrow_exception(exception_);
      throw;
    }
  }

  const std::atomic<bool>& failed() const { return failed_; }

 private:
  std::exception_ptr exception_;
  std::atomic<bool> failed_{false};
};

}  // namespace tagrid
