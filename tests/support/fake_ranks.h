// Ranks that are threads of one process, so that the work of several ranks is tested in milliseconds.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "pipeline/parts/work_orders.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Ranks like those of MPI: one rank sees another only through calls of Ranks. If a rank ends with an
/// exception, the ranks that wait for it end with an exception, too.
class FakeRanks {
 public:
  explicit FakeRanks(int count) : count_(count) {}

  /// Runs body(ranks) for every rank in its own thread. Throws the exception of the first rank that failed by
  /// itself, and was not only left alone.
  void run(const std::function<void(Ranks&)>& body) {
    std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count_));
    {
      std::vector<std::jthread> threads;
      for (int rank = 0; rank < count_; ++rank)
        threads.emplace_back([&, rank] {
          Rank ranks(*this, rank);
          try {
            body(ranks);
          } catch (const LeftAlone&) {
          } catch (...) {
            thrown[static_cast<std::size_t>(rank)] = std::current_exception();
            const std::lock_guard lock(mutex_);
            one_left_ = true;
            changed_.notify_all();
          }
        });
    }
    for (const std::exception_ptr& exception : thrown)
      if (exception) std::rethrow_exception(exception);
  }

 private:
  struct LeftAlone {};
  struct Told {
    const Bytes& bytes;
    bool heard = false;
  };
  using Lock = std::unique_lock<std::mutex>;

  template <class Condition>
  void wait(Lock& lock, Condition condition) {
    changed_.wait(lock, [&] { return condition() || one_left_; });
    if (!condition()) throw LeftAlone();
  }
  /// Returns when all ranks have arrived.
  void meet(Lock& lock) {
    const long mine = meetings_;
    arrive();
    wait(lock, [&] { return meetings_ != mine; });
  }
  void arrive() {
    if (++here_ < count_) return;
    here_ = 0;
    ++meetings_;
    changed_.notify_all();
  }

  class Rank : public Ranks {
   public:
    Rank(FakeRanks& all, int rank) : all_(all), rank_(rank) {}

    int rank() const override { return rank_; }
    int count() const override { return all_.count_; }
    int on_this_machine() const override { return all_.count_; }

    void broadcast(Bytes& bytes) override {
      Lock lock(all_.mutex_);
      if (rank_ == 0) all_.bytes_ = bytes;
      all_.meet(lock);
      bytes = all_.bytes_;
      all_.meet(lock);
    }
    std::vector<Bytes> gather(const Bytes& bytes) override {
      Lock lock(all_.mutex_);
      all_.gathered_.resize(static_cast<std::size_t>(all_.count_));
      all_.gathered_[static_cast<std::size_t>(rank_)] = bytes;
      all_.meet(lock);
      std::vector<Bytes> result;
      if (rank_ == 0) result = all_.gathered_;
      all_.meet(lock);
      return result;
    }

    void begin_counting() override {
      Lock lock(all_.mutex_);
      all_.meet(lock);
      all_.numbers_ = {};
      all_.meet(lock);
    }
    SharedNumbers add(const SharedNumbers& more) override {
      const Lock lock(all_.mutex_);
      return all_.numbers_ += more;
    }

    void tell(const Bytes& bytes) override {
      Lock lock(all_.mutex_);
      Told told{bytes};
      all_.told_.push_back(&told);
      all_.changed_.notify_all();
      all_.wait(lock, [&] { return told.heard; });
    }
    void listen(const Hear& hear) override {
      Lock lock(all_.mutex_);
      // The other ranks receive nothing.
      if (rank_ == 0) hear_all(lock, hear);
    }
    void listen_to_the_end(const Hear& hear) override {
      Lock lock(all_.mutex_);
      const long mine = all_.meetings_;
      all_.arrive();
      while (all_.meetings_ == mine) {
        all_.wait(lock, [&] { return all_.meetings_ != mine || (rank_ == 0 && !all_.told_.empty()); });
        if (rank_ == 0) hear_all(lock, hear);
      }
    }

   private:
    void hear_all(Lock& lock, const Hear& hear) {
      while (!all_.told_.empty()) {
        Told& told = *all_.told_.front();
        all_.told_.pop_front();
        lock.unlock();
        hear(told.bytes);
        lock.lock();
        told.heard = true;
        all_.changed_.notify_all();
      }
    }

    FakeRanks& all_;
    int rank_;
  };

  int count_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool one_left_ = false;
  int here_ = 0;       ///< ranks that wait for a meeting
  long meetings_ = 0;  ///< number of meetings of all ranks so far
  Bytes bytes_;
  std::vector<Bytes> gathered_;
  SharedNumbers numbers_;
  std::deque<Told*> told_;
};

/// Rank 0 does `work` and dismisses the others, which serve; `work` may throw.
inline void by(int count, const std::function<void(Ranks&)>& work) {
  std::atomic<int> served{0};
  std::exception_ptr thrown;
  FakeRanks(count).run([&](Ranks& ranks) {
    if (ranks.rank() > 0) {
      EXPECT_EQ(serve(
                    ranks, [](std::uint64_t) {}, [](const Bytes&) { ADD_FAILURE(); }),
                7);
      ++served;
      return;
    }
    try {
      work(ranks);
    } catch (...) {
      thrown = std::current_exception();
    }
    dismiss(ranks, 7);
  });
  EXPECT_EQ(served, count - 1);
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace tagrid
