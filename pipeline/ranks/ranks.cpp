#include "pipeline/ranks/ranks.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include "io/files/errors.h"

namespace tagrid {
namespace {

std::unique_ptr<Ranks>& the_ranks() {
  static std::unique_ptr<Ranks> started = std::make_unique<Ranks>();
  return started;
}

enum class Kind : std::uint8_t { none, stopped, usage, broken, closed, world, memory, bug };

struct Failure {
  Kind kind = Kind::none;
  std::string message;
};

Failure described(const std::exception_ptr& exception) {
  if (!exception) return {};
  try {
    std::rethrow_exception(exception);
  } catch (const Stopped&) {
    return {Kind::stopped, ""};
  } catch (const UsageError& error) {
    return {Kind::usage, error.what()};
  } catch (const BrokenInput& error) {
    return {Kind::broken, error.what()};
  } catch (const ClosedPipe& error) {
    return {Kind::closed, error.what()};
  } catch (const WorldError& error) {
    return {Kind::world, error.what()};
  } catch (const std::bad_alloc&) {
    return {Kind::memory, ""};
  } catch (const std::system_error& error) {
    return {Kind::world, error.what()};
  } catch (const std::exception& error) {
    return {Kind::bug, error.what()};
  } catch (...) {
    return {Kind::bug, "something that is no exception was thrown"};
  }
}

Bytes packed(const Failure& failure) {
  Bytes bytes = {static_cast<std::byte>(failure.kind)};
  for (const char c : failure.message.substr(0, 4000)) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}

Failure unpacked(const Bytes& bytes) {
  if (bytes.empty()) return {};
  Failure failure{static_cast<Kind>(bytes[0]), ""};
  for (std::size_t i = 1; i < bytes.size(); ++i) failure.message += static_cast<char>(bytes[i]);
  return failure;
}

[[noreturn]] void raise_failure(const Failure& failure) {
  switch (failure.kind) {
    case Kind::usage:
      throw UsageError(failure.message);
    case Kind::broken:
      throw BrokenInput(failure.message);
    case Kind::closed:
      throw ClosedPipe(failure.message);
    case Kind::world:
      throw WorldError(failure.message);
    case Kind::memory:
      throw std::bad_alloc();
    default:
      throw std::runtime_error(failure.message);
  }
}

}  // namespace

Ranks& ranks() { return *the_ranks(); }
void start_ranks(std::unique_ptr<Ranks> started) { the_ranks() = std::move(started); }

void Ranks::attend(const std::function<void()>& work, const std::function<void()>& look) {
  std::mutex mutex;
  std::condition_variable ended;
  bool done = false;
  std::exception_ptr failure;
  std::thread worker([&] {
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    done = true;
    ended.notify_one();
  });
  std::unique_lock lock(mutex);
  for (int waits = 1; !ended.wait_for(lock, std::chrono::milliseconds(2), [&] { return done; }); ++waits) {
    pass_messages();
    if (waits % 16 == 0) look();
  }
  lock.unlock();
  worker.join();
  if (failure) std::rethrow_exception(failure);
}

void agree(Ranks& ranks, std::exception_ptr failure) {
  if (ranks.count() == 1) {
    if (failure) std::rethrow_exception(failure);
    return;
  }
  Failure chosen;
  const std::vector<Bytes> all = ranks.gather(packed(described(failure)));
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    Failure its = unpacked(all[rank]);
    if (its.kind == Kind::none || (its.kind == Kind::stopped && chosen.kind != Kind::none)) continue;
    if (chosen.kind != Kind::none && chosen.kind != Kind::stopped) continue;
    if (rank > 0 && !its.message.empty()) its.message = fmt::format("rank {}: {}", rank, its.message);
    chosen = std::move(its);
  }
  Bytes bytes = packed(chosen);
  ranks.broadcast(bytes);
  chosen = unpacked(bytes);
  if (chosen.kind != Kind::none) raise_failure(chosen);
}

void share_out(Ranks& ranks, SharedWork& shared) {
  std::exception_ptr failure;
  // The exception that is being handled. What was thrown because of `stop` is not what failed.
  const auto fail = [&] {
    if (failure) return;
    failure = shared.stop ? std::make_exception_ptr(Stopped{}) : std::current_exception();
    if (!shared.stop) ranks.tell_failure();
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
    if (done != reported) ranks.add_done(done - reported);
    reported = done;
    const SharedNumbers numbers = ranks.numbers();
    if (numbers.failed) shared.stop = true;
    if (shared.look) shared.look(numbers);
  };
  ranks.begin_counting();
  try {
    while (!shared.stop) {
      const std::int64_t item = ranks.next();
      if (item >= shared.count) break;
      ranks.attend([&] { shared.work(item); }, look);
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
