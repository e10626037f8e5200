// Runs a flow graph to its end, whatever fails.
#pragma once

#include <oneapi/tbb/flow_graph.h>

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

}  // namespace tagrid
