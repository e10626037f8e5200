#include "pipeline/ranks/mpi/mpi_ranks.h"

#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <stdexcept>

namespace tagrid {
namespace {

// Far below 1 GiB, which is the limit for messages in some networks.
constexpr std::size_t largest_message = std::size_t{1} << 26;

// Positions in the window of rank 0.
enum Number : int { taken, done, failed, number_count };

// Messages between two ranks: the bytes that are told, preceded by their size, and the answer after they were
// heard.
enum Tag : int { told, heard };

// Waits without taking a core from working threads. Requests of other ranks are answered meanwhile.
// `meanwhile` is called now and then.
template <class Meanwhile>
void await(MPI_Request request, Meanwhile meanwhile) {
  for (int looks = 0;; ++looks) {
    int complete = 0;
    MPI_Test(&request, &complete, MPI_STATUS_IGNORE);
    if (complete) return;
    meanwhile();
    if (looks > 200) usleep(looks > 2000 ? 2000 : 100);
  }
}

void await(MPI_Request request) {
  await(request, [] {});
}

class MpiRanks : public Ranks {
 public:
  MpiRanks() {
    int given = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    if (given < MPI_THREAD_FUNNELED)
      throw std::runtime_error("this MPI library does not support programs with threads");
    MPI_Comm neighbours;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &neighbours);
    MPI_Comm_size(neighbours, &on_this_machine_);
    MPI_Comm_free(&neighbours);
    const MPI_Aint size = rank_ == 0 ? number_count * sizeof(std::int64_t) : 0;
    MPI_Win_allocate(size, sizeof(std::int64_t), MPI_INFO_NULL, MPI_COMM_WORLD, &numbers_, &window_);
    for (int i = 0; i < number_count && rank_ == 0; ++i) numbers_[i] = 0;
    MPI_Win_lock_all(0, window_);
  }
  ~MpiRanks() override {
    MPI_Win_unlock_all(window_);
    MPI_Win_free(&window_);
    MPI_Finalize();
  }
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  int rank() const override { return rank_; }
  int count() const override { return count_; }
  int on_this_machine() const override { return on_this_machine_; }

  void broadcast(Bytes& bytes) override {
    std::uint64_t size = bytes.size();
    broadcast_bytes(&size, sizeof size);
    bytes.resize(size);
    for_each_message(bytes, broadcast_bytes);
  }

  std::vector<Bytes> gather(const Bytes& bytes) override {
    const int size = static_cast<int>(bytes.size());
    std::vector<int> sizes(static_cast<std::size_t>(count_)), places(sizes.size());
    MPI_Request request;
    MPI_Igather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, 0, MPI_COMM_WORLD, &request);
    await(request);
    for (std::size_t i = 1; i < sizes.size(); ++i) places[i] = places[i - 1] + sizes[i - 1];
    Bytes all(rank_ == 0 ? static_cast<std::size_t>(places.back() + sizes.back()) : 0);
    MPI_Igatherv(bytes.data(), size, MPI_BYTE, all.data(), sizes.data(), places.data(), MPI_BYTE, 0,
                 MPI_COMM_WORLD, &request);
    await(request);
    std::vector<Bytes> result;
    for (std::size_t i = 0; i < sizes.size() && rank_ == 0; ++i) {
      const auto first = all.begin() + places[i];
      result.emplace_back(first, first + sizes[i]);
    }
    return result;
  }

  void tell(const Bytes& bytes) override {
    const std::uint64_t size = bytes.size();
    send_bytes(&size, sizeof size);
    for_each_message(bytes, send_bytes);
    MPI_Request request;
    MPI_Irecv(nullptr, 0, MPI_BYTE, 0, heard, MPI_COMM_WORLD, &request);
    await(request);
  }
  void listen(const Hear& hear) override {
    for (int is_told = 1; is_told;) {
      MPI_Status status;
      MPI_Iprobe(MPI_ANY_SOURCE, told, MPI_COMM_WORLD, &is_told, &status);
      if (is_told) hear_one(status.MPI_SOURCE, hear);
    }
  }
  void listen_to_the_end(const Hear& hear) override {
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    await(request, [&] {
      if (rank_ == 0) listen(hear);
    });
  }

  void begin_counting() override {
    barrier();
    for (int i = 0; i < number_count && rank_ == 0; ++i) change(static_cast<Number>(i), 0, MPI_REPLACE);
    barrier();
  }
  std::int64_t next() override { return change(taken, 1, MPI_SUM); }
  void add_done(std::int64_t amount) override { change(done, amount, MPI_SUM); }
  void tell_failure() override { change(failed, 1, MPI_SUM); }
  SharedNumbers numbers() override {
    return {change(taken, 0, MPI_NO_OP), change(done, 0, MPI_NO_OP), change(failed, 0, MPI_NO_OP) != 0};
  }

 protected:
  // Other ranks reach the shared numbers, which are those of rank 0, only while rank 0 passes messages.
  std::chrono::milliseconds patience() const override {
    return rank_ == 0 ? std::chrono::milliseconds(2) : look_interval;
  }
  void pass_messages() override {
    int waiting = 0;
    MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &waiting, MPI_STATUS_IGNORE);
  }

 private:
  template <class ByteVector, class Send>
  static void for_each_message(ByteVector& bytes, Send send) {
    for (std::size_t at = 0; at < bytes.size(); at += largest_message)
      send(bytes.data() + at, std::min(largest_message, bytes.size() - at));
  }
  static void send_bytes(const void* bytes, std::size_t size) {
    MPI_Request request;
    MPI_Isend(bytes, static_cast<int>(size), MPI_BYTE, 0, told, MPI_COMM_WORLD, &request);
    await(request);
  }
  // The sender waits in tell(), and does nothing else.
  static void hear_one(int source, const Hear& hear) {
    const auto receive = [&](void* bytes, std::size_t size) {
      MPI_Recv(bytes, static_cast<int>(size), MPI_BYTE, source, told, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    };
    std::uint64_t size = 0;
    receive(&size, sizeof size);
    Bytes bytes(size);
    for_each_message(bytes, receive);
    hear(bytes);
    MPI_Send(nullptr, 0, MPI_BYTE, source, heard, MPI_COMM_WORLD);
  }
  static void broadcast_bytes(void* bytes, std::size_t size) {
    MPI_Request request;
    MPI_Ibcast(bytes, static_cast<int>(size), MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    await(request);
  }
  static void barrier() {
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    await(request);
  }
  // Returns the number before the change.
  std::int64_t change(Number number, std::int64_t by, MPI_Op how) {
    std::int64_t before = 0;
    MPI_Fetch_and_op(&by, &before, MPI_INT64_T, 0, number, how, window_);
    MPI_Win_flush(0, window_);
    return before;
  }

  int rank_ = 0, count_ = 1, on_this_machine_ = 1;
  std::int64_t* numbers_ = nullptr;
  MPI_Win window_ = MPI_WIN_NULL;
};

}  // namespace

std::unique_ptr<Ranks> start_mpi() { return std::make_unique<MpiRanks>(); }

void abort_mpi(int code) {
  int started = 0, ended = 0;
  MPI_Initialized(&started);
  MPI_Finalized(&ended);
  if (started && !ended) MPI_Abort(MPI_COMM_WORLD, code);
  std::_Exit(code);
}

}  // namespace tagrid
