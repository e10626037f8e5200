#include "pipeline/threads/node_times.h"

#include <atomic>
#include <ctime>
#include <utility>

namespace tagrid {
namespace {

struct Entry {
  std::string_view name;
  bool is_serial;
};
constexpr std::array<Entry, static_cast<std::size_t>(Node::count)> entries = {{{"read slices", true},
                                                                               {"read samples", false},
                                                                               {"sum blocks", false},
                                                                               {"plan", true},
                                                                               {"curvature", false},
                                                                               {"subdivide", false},
                                                                               {"encode", false},
                                                                               {"complete mesh", true},
                                                                               {"measure mesh", false},
                                                                               {"write bricks", true},
                                                                               {"read bricks", true},
                                                                               {"decode", false},
                                                                               {"write rows", true},
                                                                               {"write samples", false}}};

std::array<std::atomic<std::uint64_t>, entries.size()> nanoseconds_of_nodes;

thread_local TimeOfNode* innermost = nullptr;

std::uint64_t nanoseconds_of_thread() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(now.tv_nsec);
}

}  // namespace

std::array<NodeTime, entries.size()> node_times() {
  std::array<NodeTime, entries.size()> times;
  for (std::size_t i = 0; i < times.size(); ++i)
    times[i] = {entries[i].name, entries[i].is_serial, 1e-9 * static_cast<double>(nanoseconds_of_nodes[i])};
  return times;
}

TimeOfNode::TimeOfNode(Node node)
    : node_(node), outer_(std::exchange(innermost, this)), start_(nanoseconds_of_thread()) {}

TimeOfNode::~TimeOfNode() {
  const std::uint64_t all = nanoseconds_of_thread() - start_;
  nanoseconds_of_nodes[static_cast<std::size_t>(node_)].fetch_add(all - inner_, std::memory_order_relaxed);
  if (outer_) outer_->inner_ += all;
  innermost = outer_;
}

}  // namespace tagrid
