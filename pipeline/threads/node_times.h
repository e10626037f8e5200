// The processor time that the nodes of the flow graphs take, to see what keeps more threads from being faster.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tagrid {

/// The nodes that work. Those of an encoding come before those of a decoding.
enum class Node : std::uint8_t {
  read_slice,
  read_samples,
  sum_blocks,
  plan,
  curvature,
  subdivide,
  encode,
  complete_mesh,
  measure_mesh,
  write_brick,
  read_brick,
  decode,
  write_rows,
  write_samples,
  count
};

/// What a node took so far in this process, as the processor time of the process is one number for all runs.
struct NodeTime {
  std::string_view name;   ///< as in docs/dev/design.md
  bool is_serial = false;  ///< true if one thread at a time is in this node
  double seconds = 0;      ///< of processor time, of all threads
};

/// The times of all nodes, in the order of Node.
std::array<NodeTime, static_cast<std::size_t>(Node::count)> node_times();

/// Adds the processor time of this thread, from the construction of the object to its destruction, to a node. An
/// object that is made meanwhile, on the same thread, takes its time from this one: a thread that waits for tasks
/// does others. Not for anything smaller than a slice or a brick, as it costs some hundred nanoseconds.
class TimeOfNode {
 public:
  explicit TimeOfNode(Node node);
  ~TimeOfNode();
  TimeOfNode(const TimeOfNode&) = delete;
  TimeOfNode& operator=(const TimeOfNode&) = delete;

 private:
  Node node_;
  TimeOfNode* outer_;  ///< of the same thread; null if there is none
  std::uint64_t start_, inner_ = 0;
};

}  // namespace tagrid
