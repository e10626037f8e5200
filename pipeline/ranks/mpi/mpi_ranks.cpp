#include "pipeline/ranks/mpi/mpi_ranks.h"

#include <mpi.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <thread>

namespace tagrid {
namespace {

// Far below 1 GiB, which is the limit for messages in some networks.
constexpr std::size_t largest_message = std::size_t{1} << 26;

// Messages to rank 0, and its answers. A rank that has sent a message does nothing else until it is answered.
// So no message is left when all ranks meet, and rank 0 can receive the rest of a message without a deadlock.
enum Tag : int {
  told,   // bytes, preceded by their size
  heard,  // nothing: the bytes were heard
  more,   // what is added to the shared numbers
  sums    // the shared numbers after that
};

class MpiRanks : public Ranks {
 public:
  MpiRanks() {
    int given = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    if (given < MPI_THREAD_FUNNELED)
      throw std::runtime_error("this MPI library does not support programs with threads");
    MPI_Comm neighbors;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &neighbors);
    MPI_Comm_size(neighbors, &on_this_machine_);
    MPI_Comm_free(&neighbors);
  }
  ~MpiRanks() override { MPI_Finalize(); }
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  int rank() const override { return rank_; }
  int count() const override { return count_; }
  int on_this_machine() const override { return on_this_machine_; }
  std::string machine() const override {
    if (on_this_machine_ == count_) return {};
    std::array<char, MPI_MAX_PROCESSOR_NAME> name = {};
    int size = 0;
    MPI_Get_processor_name(name.data(), &size);
    return {name.data(), static_cast<std::size_t>(size)};
  }

  void broadcast(Bytes& bytes) override {
    std::uint64_t size = bytes.size();
    const auto broadcast_bytes = [&](void* some, std::size_t count) {
      MPI_Request request;
      MPI_Ibcast(some, static_cast<int>(count), MPI_BYTE, 0, MPI_COMM_WORLD, &request);
      await(request);
    };
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
    const auto send = [&](const void* some, std::size_t count) { await(sent(some, count, told)); };
    send(&size, sizeof size);
    for_each_message(bytes, send);
    await(received(nullptr, 0, heard));
  }
  void listen(const Hear& hear) override {
    for (int source; (source = sender_of(told)) >= 0;) hear_one(source, hear);
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
    Ranks::begin_counting();
    barrier();
  }
  SharedNumbers add(const SharedNumbers& numbers) override {
    if (rank_ == 0) return Ranks::add(numbers);
    SharedNumbers result;
    const MPI_Request answer = received(&result, sizeof result, sums);
    await(sent(&numbers, sizeof numbers, more));
    await(answer);
    return result;
  }

 protected:
  // The shared numbers are those of rank 0: other ranks wait for its answers.
  std::chrono::milliseconds patience() const override {
    return rank_ == 0 ? std::chrono::milliseconds(2) : look_interval;
  }
  bool pass_messages() override {
    // A rank that has asked for one thing often asks for the next at once.
    const bool has_asked = answer_others();
    for (int naps = 0; has_asked && naps < 10 && sender_of(told) < 0; ++naps) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      answer_others();
    }
    return sender_of(told) >= 0;
  }

 private:
  template <class ByteVector, class Send>
  static void for_each_message(ByteVector& bytes, Send send) {
    for (std::size_t at = 0; at < bytes.size(); at += largest_message)
      send(bytes.data() + at, std::min(largest_message, bytes.size() - at));
  }
  // Waits without taking a core from working threads. Rank 0 answers others, and `meanwhile` is called.
  template <class Meanwhile>
  void await(MPI_Request request, Meanwhile meanwhile) {
    for (int looks = 0;; ++looks) {
      int complete = 0;
      MPI_Test(&request, &complete, MPI_STATUS_IGNORE);
      if (complete) return;
      if (answer_others()) looks = 0;
      meanwhile();
      if (looks > 200) std::this_thread::sleep_for(std::chrono::microseconds(looks > 2000 ? 2000 : 100));
    }
  }
  void await(MPI_Request request) {
    await(request, [] {});
  }
  static MPI_Request sent(const void* bytes, std::size_t size, Tag tag) {
    MPI_Request request;
    MPI_Isend(bytes, static_cast<int>(size), MPI_BYTE, 0, tag, MPI_COMM_WORLD, &request);
    return request;
  }
  static MPI_Request received(void* bytes, std::size_t size, Tag tag) {
    MPI_Request request;
    MPI_Irecv(bytes, static_cast<int>(size), MPI_BYTE, 0, tag, MPI_COMM_WORLD, &request);
    return request;
  }
  // A rank whose message has arrived, or -1. Only rank 0 gets any.
  static int sender_of(Tag tag) {
    int has_arrived = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, tag, MPI_COMM_WORLD, &has_arrived, &status);
    return has_arrived ? status.MPI_SOURCE : -1;
  }
  // Returns whether a rank has asked.
  bool answer_others() {
    int answers = 0;
    for (int source; (source = sender_of(more)) >= 0; ++answers) {
      SharedNumbers numbers;
      MPI_Recv(&numbers, sizeof numbers, MPI_BYTE, source, more, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      numbers = Ranks::add(numbers);
      MPI_Send(&numbers, sizeof numbers, MPI_BYTE, source, sums, MPI_COMM_WORLD);
    }
    return answers > 0;
  }
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
  void barrier() {
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    await(request);
  }

  int rank_ = 0, count_ = 1, on_this_machine_ = 1;
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
