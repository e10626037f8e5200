// Runs a flow graph to its end, whatever fails.
#pragma once

#include <oneapi/tbb/flow_graph.h>

#include <atomic>
#include <exception>

namespace tagrid {

/// Starts the graph at `first` and waits for it. Throws the exceptions of its nodes. When this returns or
/// throws, no task of the graph runs or waits any more, so that its nodes can be destroyed.
template <class InputNode>
void run_graph(oneapi::tbb::flow::graph& graph, InputNode& first) {
  try {
    first.activate();
    graph.wait_for_all();
  } catch (...) {
    // The exception may not be that of a node: oneTBB itself allocates memory.
    graph.cancel();
    try {
      graph.wait_for_all();
    } catch (...) {
      // The first exception says what happened.
    }
    throw;
  }
}

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
