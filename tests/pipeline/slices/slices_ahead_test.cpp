// Slices that are read ahead: the same slices, no more at once than may wait, and the same failures.
#include "pipeline/slices/slices_ahead.h"

#include <chrono>
#include <cstring>
#include <thread>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "pipeline/threads/threads.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

using namespace std::chrono_literals;

/// Slices of one sample, slice z with the number z, which count how many were read.
class CountedSlices final : public VolumeSource {
 public:
  explicit CountedSlices(std::int64_t slices, std::int64_t broken = -1)
      : VolumeSource({.info = {.dims = {1, 1, slices}, .type = SampleType::uint8},
                      .files = {"counted"},
                      .traits = {.again = true, .whole_slices = true}}),
        broken_(broken) {}

  std::uint64_t bytes_read() const override { return 0; }
  void stop_when(const std::atomic<bool>& stop) override { stop_ = &stop; }
  /// Waits until `count` slices were read.
  bool reaches(int count) const {
    for (int i = 0; i < 10000 && slices_read < count; ++i) std::this_thread::sleep_for(1ms);
    return slices_read == count;
  }

  std::atomic<int> slices_read{0};
  bool is_finished = false;
  std::atomic<bool> hangs = false;  ///< reads wait until they are stopped

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t) override {
    if (first == broken_) throw BrokenInput("a slice is broken");
    while (hangs) {
      if (stop_ != nullptr && *stop_) throw WorldError("stopped");
      std::this_thread::sleep_for(1ms);
    }
    *out = static_cast<std::byte>(first);
    ++slices_read;
  }
  void seek(std::int64_t) override {}
  void end() override { is_finished = true; }

  std::int64_t broken_;
  const std::atomic<bool>* stop_ = nullptr;
};

Box box_of_slice(std::int64_t z) { return {{0, 0, z}, {0, 0, z}}; }

class SlicesOnThreads : public TemporaryFolder {
 protected:
  // Slices that are worth several tasks.
  static constexpr Index3 dims{701, 650, 3};

  void SetUp() override {
    TemporaryFolder::SetUp();
    samples_ = blobs<std::uint16_t>(dims, 1);
    auto big_endian = samples_;
    for (std::uint16_t& v : big_endian) v = static_cast<std::uint16_t>(v >> 8 | v << 8);
    write_content(path("a.raw"),
                  std::string(reinterpret_cast<const char*>(big_endian.data()), 2 * big_endian.size()));
    write_content(path("a.nhdr"),
                  "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 701 650 3\nendian: big\nencoding: raw\n"
                  "data file: a.raw\n");
  }
  std::vector<std::uint16_t> samples_;
};

TEST_F(SlicesOnThreads, HaveTheSamplesOfTheFile) {
  const auto source = open_volume(path("a.nhdr"));
  ASSERT_TRUE(source->at_once());
  // Complete slices, and then rows of one before.
  for (const Box& rows :
       {Box{{0, 0, 0}, {700, 649, 0}}, Box{{0, 0, 1}, {700, 649, 1}}, Box{{0, 33, 0}, {700, 640, 0}},
        Box{{0, 5, 1}, {700, 5, 1}}, Box{{0, 0, 2}, {700, 649, 2}}}) {
    SliceSamples slice;
    Threads(3).run([&] { slice = read_slice_on_threads(*source, rows); });
    EXPECT_EQ(std::memcmp(slice.get(), samples_.data() + Box::of_size(dims).offset(rows.low),
                          static_cast<std::size_t>(rows.count()) * 2),
              0)
        << rows.low.z << " " << rows.low.y;
  }
  EXPECT_EQ(source->next_sample(), Box::of_size(dims).count());
  EXPECT_GE(source->bytes_read(), 2 * samples_.size());
}

TEST_F(SlicesOnThreads, OfAFileThatBecameShorterAreRefused) {
  const auto source = open_volume(path("a.nhdr"));
  std::filesystem::resize_file(path("a.raw"), 701 * 650 * 2 + 999);
  Threads(3).run([&] {
    EXPECT_NO_THROW(read_slice_on_threads(*source, {{0, 0, 0}, {700, 649, 0}}));
    const auto read = [&] { read_slice_on_threads(*source, {{0, 0, 1}, {700, 649, 1}}); };
    EXPECT_TRUE(has(message_of<BrokenInput>(read), "ends after"));
  });
}

TEST(SlicesAhead, AreTheSlicesOfTheSourceInTheirOrder) {
  for (const int count : {0, 1, 7, 100}) {
    CountedSlices source(50);
    SlicesAhead ahead(source, count);
    for (int z = 0; z < 50; ++z) EXPECT_EQ(ahead.read(box_of_slice(z))[0], static_cast<std::byte>(z));
    ahead.end();
    EXPECT_TRUE(source.is_finished) << count;
  }
}

TEST(SlicesAhead, AreReadWhileNobodyAsksAndNoMoreThanMayWait) {
  CountedSlices source(50);
  SlicesAhead ahead(source, 5);
  ahead.read(box_of_slice(0));
  EXPECT_TRUE(source.reaches(6));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(source.slices_read, 6);
  ahead.read(box_of_slice(1));
  EXPECT_TRUE(source.reaches(7));
}

TEST(SlicesAhead, FailAtTheSliceThatIsBroken) {
  for (const int count : {0, 3}) {
    CountedSlices source(50, 10);
    SlicesAhead ahead(source, count);
    for (int z = 0; z < 10; ++z) ahead.read(box_of_slice(z));
    EXPECT_THROW(ahead.read(box_of_slice(10)), BrokenInput);
  }
}

TEST(SlicesAhead, ASourceThatHangsIsStopped) {
  for (const int count : {0, 3}) {
    CountedSlices source(50);
    SlicesAhead ahead(source, count);
    ahead.read(box_of_slice(0));
    source.reaches(count + 1);
    source.hangs = true;
    std::jthread later([&] {
      std::this_thread::sleep_for(20ms);
      ahead.stop();
    });
    EXPECT_THROW(for (int z = 1; z < 50; ++z) ahead.read(box_of_slice(z)), WorldError);
  }
}

TEST(SlicesAhead, OnesThatNobodyWantsDoNotKeepTheRunAlive) {
  CountedSlices source(50);
  SlicesAhead ahead(source, 3);
  ahead.read(box_of_slice(0));
  source.hangs = true;
}

}  // namespace
}  // namespace tagrid
