#include "pipeline/ranks/ranks.h"

#include <fmt/format.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "io/errors/errors.h"
#include "pipeline/ranks/messages.h"

namespace tagrid {

TAGRID_MEMBERS(Choice, name, text)
TAGRID_MEMBERS(SmallerBrick, edge, needed)
TAGRID_MEMBERS(MemoryNeeds, needed, allowed, with_spool, smaller_brick)
TAGRID_MEMBERS(ErrorDetail, problem, subject, with_options, memory, option, choices)
TAGRID_MEMBERS(SortedError, kind, message, detail)

namespace {

/// The messages of ranks about the end of their work.
struct Outcome {
  enum class State : std::uint8_t { well, stopped, failed } state = State::well;
  SortedError error;
  std::string machine;
};
TAGRID_MEMBERS(Outcome, state, error, machine)

Outcome outcome_of(const std::exception_ptr& exception) {
  if (!exception) return {};
  try {
    std::rethrow_exception(exception);
  } catch (const Stopped&) {
    return {Outcome::State::stopped, {ErrorKind::bug, "the work was stopped", {}}, {}};
  } catch (...) {
    constexpr std::size_t longest_message = 4000;
    SortedError error = sorted_error(exception);
    if (error.message.size() > longest_message) {
      error.message.resize(longest_message);
      error.detail = {};
    }
    return {Outcome::State::failed, error, {}};
  }
}

// A single process needs no second thread to look, and has no other rank to agree with.
void do_alone(SharedWork& shared) {
  shared.looks_at_once = true;
  for (std::int64_t item = 0; item < shared.count; ++item) {
    shared.work(item);
    if (shared.take) shared.take(shared.account);
  }
}

}  // namespace

void Ranks::attend(const std::function<void()>& work, const std::function<void()>& look) {
  using Clock = std::chrono::steady_clock;
  std::mutex mutex;
  std::condition_variable ended;
  bool done = false;
  std::exception_ptr of_work, of_look;
  {
    // The thread is always joined, even if an exception is thrown here.
    const std::jthread worker([&] {
      try {
        work();
      } catch (...) {
        of_work = std::current_exception();
      }
      const std::lock_guard lock(mutex);
      done = true;
      ended.notify_one();
    });
    std::unique_lock lock(mutex);
    auto next_look = Clock::now() + look_interval;
    while (!ended.wait_for(lock, patience(), [&] { return done; })) {
      lock.unlock();
      const bool is_told = pass_messages();
      if (!of_look && (is_told || Clock::now() >= next_look)) {
        next_look = Clock::now() + look_interval;
        try {
          look();
        } catch (...) {
          of_look = std::current_exception();
        }
      }
      lock.lock();
    }
  }
  if (of_look) std::rethrow_exception(of_look);
  if (of_work) std::rethrow_exception(of_work);
}

void SharedWork::add_done(std::int64_t amount) {
  done += amount;
  if (looks_at_once && look) look({.taken = 0, .done = done, .failed = false});
}

void agree(Ranks& ranks, std::exception_ptr failure) {
  if (ranks.count() == 1) {
    if (failure) std::rethrow_exception(failure);
    return;
  }
  using State = Outcome::State;
  Outcome chosen;
  Outcome own = outcome_of(failure);
  own.machine = ranks.machine();
  const std::vector<Bytes> all = ranks.gather(packed_order(own));
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    auto its = unpacked_order<Outcome>(all[rank]);
    // The first rank that failed; if none did, one that was stopped.
    if (its.state <= chosen.state) continue;
    if (rank > 0 && its.state == State::failed) {
      const std::string where = its.machine.empty() ? fmt::format("rank {}: ", rank)
                                                    : fmt::format("rank {} on {}: ", rank, its.machine);
      its.error.message = where + its.error.message;
      if (auto& words = its.error.detail.with_options) words = where + *words;
    }
    chosen = std::move(its);
  }
  Bytes bytes = packed_order(chosen);
  ranks.broadcast(bytes);
  chosen = unpacked_order<Outcome>(bytes);
  if (chosen.state != State::well) throw_sorted(chosen.error);
}

void share_out(Ranks& ranks, SharedWork& shared) {
  if (ranks.count() == 1) return do_alone(shared);
  std::exception_ptr failure;
  // Handles the current exception. Exceptions thrown because of `stop` are not the cause.
  const auto fail = [&] {
    if (failure) return;
    failure = shared.stop ? std::make_exception_ptr(Stopped{}) : std::current_exception();
    if (!shared.stop) ranks.add({.taken = 0, .done = 0, .failed = true});
    shared.stop = true;
  };
  const Ranks::Hear take = [&](const Bytes& account) {
    try {
      if (!failure) shared.take(account);
    } catch (...) {
      fail();
    }
  };
  std::int64_t reported = 0;
  const auto look = [&] {
    if (shared.take) ranks.listen(take);
    const std::int64_t done = shared.done;
    const SharedNumbers numbers = ranks.add({.taken = 0, .done = done - reported, .failed = false});
    reported = done;
    if (numbers.failed) shared.stop = true;
    if (shared.look) shared.look(numbers);
  };
  // If `look` throws, the work is told to stop, and is waited for.
  const auto look_or_fail = [&] {
    try {
      look();
    } catch (...) {
      fail();
    }
  };
  ranks.begin_counting();
  try {
    while (!shared.stop) {
      const std::int64_t item = ranks.next();
      if (item >= shared.count) break;
      ranks.attend([&] { shared.work(item); }, look_or_fail);
      look();
      if (!shared.take) continue;
      if (ranks.rank() == 0)
        take(shared.account);
      else
        ranks.tell(shared.account);
    }
  } catch (...) {
    fail();
  }
  if (shared.take) ranks.listen_to_the_end(take);
  agree(ranks, failure);
}

}  // namespace tagrid
