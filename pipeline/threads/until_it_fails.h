// If an output fails, the run ends at once, even while the input is a pipe without data.
#pragma once

#include <atomic>
#include <exception>

namespace tagrid {

/// Runs the work of one node of a flow graph. If it throws, failed() becomes true, for nodes that wait for
/// something else. As they may then throw, too, rethrow_after() throws the exception of this node.
class UntilItFails {
 public:
  /// REQUIRES: never called by two threads at once.
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
