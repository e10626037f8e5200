// The processes that work on one run together: one process, or those that mpirun started. Only the code that
// starts them knows which; all other code uses this interface.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <vector>

namespace tagrid {

using Bytes = std::vector<std::byte>;

/// Numbers that all ranks share while they work on something together.
struct SharedNumbers {
  std::int64_t taken = 0;  ///< number of items that ranks have taken; it may exceed the number of items
  std::int64_t done = 0;   ///< the sum of add_done()
  bool failed = false;     ///< a rank has reported a failure

  SharedNumbers& operator+=(const SharedNumbers& more) {
    taken += more.taken;
    done += more.done;
    failed = failed || more.failed;
    return *this;
  }
};

/// The thread that started the program calls all members. Collective members are called by all ranks, in the
/// same order. No single message is longer than 2^26 bytes.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const { return 0; }
  virtual int count() const { return 1; }
  /// The number of ranks that share this machine's memory.
  virtual int on_this_machine() const { return 1; }
  /// The name of this machine if there are ranks on others, too; otherwise empty.
  virtual std::string machine() const { return {}; }

  /// Collective: all ranks get the bytes of rank 0.
  virtual void broadcast(Bytes&) {}
  /// Collective: rank 0 gets the bytes of all ranks, in their order; the others get nothing. For some kB.
  virtual std::vector<Bytes> gather(const Bytes& bytes) { return {bytes}; }

  /// Collective: the shared numbers become 0.
  virtual void begin_counting() { numbers_ = {}; }
  /// Adds to the shared numbers, and returns the sums.
  virtual SharedNumbers add(const SharedNumbers& more) { return numbers_ += more; }
  /// Takes the next item: 0, 1, 2, ... Each item is given to only one rank.
  std::int64_t next() { return add({.taken = 1, .done = 0, .failed = false}).taken - 1; }

  /// Called by rank 0 with the bytes that another rank tells. Does not throw.
  using Hear = std::function<void(const Bytes&)>;
  /// Called by ranks other than 0: sends bytes to rank 0, and returns when it has heard them.
  virtual void tell(const Bytes&) {}
  /// Called by rank 0: hears what ranks are telling now, and does not wait for more.
  virtual void listen(const Hear&) {}
  /// Collective: rank 0 hears the other ranks until all of them call this.
  virtual void listen_to_the_end(const Hear&) {}

  /// Runs `work`, which must not call any member, in a thread, and calls `look` now and then meanwhile. Then
  /// throws the exception of `look`, which ends its calls, or that of `work`.
  void attend(const std::function<void()>& work, const std::function<void()>& look);

 protected:
  static constexpr std::chrono::milliseconds look_interval{32};
  /// Called every patience() while this rank works: answers other ranks. Returns true if one of them has
  /// news, so that `look` should listen now. patience() is how long other ranks may have to wait.
  virtual bool pass_messages() { return false; }
  virtual std::chrono::milliseconds patience() const { return look_interval; }

 private:
  SharedNumbers numbers_;
};

/// The items that share_out() distributes, and what it calls.
struct SharedWork {
  using Look = std::function<void(const SharedNumbers&)>;

  std::int64_t count = 0;
  std::function<void(std::int64_t item)> work;
  /// Information about an item for rank 0, which the `work` of the item sets. Rank 0 takes all of them, one
  /// after the other as they come, before the rank starts its next item.
  Bytes account;
  std::function<void(const Bytes& account)> take = {};
  /// Called now and then by the thread of share_out(); with one process, by add_done() in that thread.
  Look look = {};
  std::atomic<bool> stop{false};

  /// Called by `work`, by one thread at a time: adds to SharedNumbers::done.
  void add_done(std::int64_t amount);

  std::atomic<std::int64_t> done{0};  ///< of this rank, so far
  bool looks_at_once = false;         ///< share_out() sets it for one process
};

/// Collective: items 0 .. count - 1 are processed, each by one rank. `look` is called now and then. If it
/// throws, or `work` fails on another rank, `stop` becomes true for ranks that still work; they may then
/// throw anything. Throws the first failure on all ranks, as the same kind of exception, with the rank in its
/// message.
void share_out(Ranks& ranks, SharedWork& work);

/// Collective: throws on all ranks if `failure`, an exception of this rank or null, is set on any.
void agree(Ranks& ranks, std::exception_ptr failure);

/// Collective: does the work, and throws on all ranks if it fails on any of them.
template <class Work>
void all_do(Ranks& ranks, Work work) {
  std::exception_ptr failure;
  try {
    work();
  } catch (...) {
    failure = std::current_exception();
  }
  agree(ranks, failure);
}

/// Thrown by a rank whose work was stopped because another rank's work had failed.
struct Stopped {};

}  // namespace tagrid
