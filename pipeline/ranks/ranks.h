// The processes that work on one run together: one, or those that mpirun started. Who starts them knows
// which; everything else sees this.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <vector>

namespace tagrid {

using Bytes = std::vector<std::byte>;

/// Numbers that all ranks share while they work on something together. Not to be waited for.
struct SharedNumbers {
  std::int64_t taken = 0;  ///< items that some rank has taken, or more
  std::int64_t done = 0;   ///< whatever add_done() counts
  bool failed = false;     ///< a rank has told a failure
};

/// All members are called by the thread that started the program. What is collective is called by all ranks,
/// in the same order. No message on its way is longer than 2^26 bytes.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const { return 0; }
  virtual int count() const { return 1; }
  /// Of these, those that share this machine's memory.
  virtual int on_this_machine() const { return 1; }

  /// Collective: all get the bytes that rank 0 has.
  virtual void broadcast(Bytes&) {}
  /// Collective: rank 0 gets the bytes of all, in the order of ranks; others get nothing. For some kB.
  virtual std::vector<Bytes> gather(const Bytes& bytes) { return {bytes}; }

  /// Collective: the shared numbers become 0.
  virtual void begin_counting() { numbers_ = {}; }
  /// Takes the next item: 0, 1, 2, ..., each given to one rank only.
  virtual std::int64_t next() { return numbers_.taken++; }
  virtual void add_done(std::int64_t amount) { numbers_.done += amount; }
  virtual void tell_failure() { numbers_.failed = true; }
  virtual SharedNumbers numbers() { return numbers_; }

  /// What rank 0 does with something that another rank tells. Throws nothing.
  using Hear = std::function<void(const Bytes&)>;
  /// By other ranks than 0, which hears it: returns when it has.
  virtual void tell(const Bytes&) {}
  /// By rank 0: hears what is being told, and does not wait for more.
  virtual void listen(const Hear&) {}
  /// Collective: rank 0 hears whatever the others tell until all of them call this.
  virtual void listen_to_the_end(const Hear&) {}

  /// Does `work`, which must not call any member, in a thread of its own, and calls `look` now and then
  /// meanwhile. When the work has ended, throws what `look` threw, which is then not called again, or `work`.
  void attend(const std::function<void()>& work, const std::function<void()>& look);

 protected:
  static constexpr std::chrono::milliseconds look_interval{32};
  /// Called every patience() while this rank works: how long other ranks may have to wait for an answer.
  virtual void pass_messages() {}
  virtual std::chrono::milliseconds patience() const { return look_interval; }

 private:
  SharedNumbers numbers_;
};

/// Collective: items 0 .. count - 1 are done, each by one rank. `look` is called now and then. Where one
/// fails, or `work` of another rank does, `stop` becomes true for those that still work: they may then throw
/// anything. Throws on all ranks what failed first, as the same kind of exception, with the rank in its
/// message.
struct SharedWork {
  std::int64_t count = 0;
  std::function<void(std::int64_t item)> work;
  /// What rank 0 has to know of an item: set by its `work`. Rank 0 takes all of them, one after the other as
  /// they come, before the rank goes on to its next item.
  Bytes account;
  std::function<void(const Bytes& account)> take = {};
  /// Called now and then by the thread that called share_out(); by add_done() where there is one process,
  /// which works in the thread that called share_out().
  std::function<void(const SharedNumbers&)> look = {};
  std::atomic<bool> stop{false};

  /// By `work`, one thread at a time: adds to SharedNumbers::done.
  void add_done(std::int64_t amount);

  std::atomic<std::int64_t> done{0};  ///< by this rank, so far
  bool looks_at_once = false;         ///< share_out() sets it for one process
};
void share_out(Ranks& ranks, SharedWork& work);

/// Collective: throws on all ranks if `failure`, an exception of this rank or nothing, is there on any.
void agree(Ranks& ranks, std::exception_ptr failure);

/// Collective: does the work, and throws on all ranks if it fails on any.
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

/// What a rank throws whose work was stopped because another's had failed.
struct Stopped {};

}  // namespace tagrid
