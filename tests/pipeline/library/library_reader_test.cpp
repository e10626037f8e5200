// Reading with the library: from files and callbacks, by several threads, and with damage.
#include <sys/stat.h>

#include <set>
#include <thread>

#include "stages/phantom/phantom.h"
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr Index3 dims = {27, 22, 19};

/// The file of a volume, an open reader of it, and room for its samples.
struct LibraryReader : TemporaryFolder {
  tagrid_status read_all(const tagrid_call* call) {
    return tagrid_reader_read(reader_.get(), &all_, nullptr, TAGRID_UINT16, out_.data(), nullptr, call);
  }

  const std::vector<std::uint16_t> samples_ = awkward_volume<std::uint16_t>(Awkward::noise, dims, 1);
  MemoryFile file_ = encoded_file(dims, samples_);
  const ReaderHandle reader_ = open_reader(file_);
  std::vector<std::uint16_t> out_ = std::vector<std::uint16_t>(samples_.size());
  const tagrid_box all_ = whole_box(dims);
};

template <class T>
void expect_boxes(Awkward kind, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto samples = awkward_volume<T>(kind, dims, seed);
  MemoryFile file = encoded_file(dims, samples);
  const ReaderHandle reader = open_reader(file);
  const tagrid_type type = info_of(reader.get()).type;
  for (int i = 0; i < 25; ++i) {
    const tagrid_box box = any_box(dims, random);
    std::int64_t step[3], count[3], strides[3], length = static_cast<std::int64_t>(sizeof(T)), first = 0;
    for (int axis = 0; axis < 3; ++axis) {
      step[axis] = random() % 2 ? 1 : static_cast<std::int64_t>(random() % 9 + 1);
      count[axis] = (box.high[axis] - box.low[axis] + step[axis] - 1) / step[axis];
    }
    // Axes in any order, with gaps, forwards or backwards.
    int order[3] = {0, 1, 2};
    const bool dense = i % 3 == 0;
    if (!dense) std::shuffle(order, order + 3, random);
    for (const int axis : order) {
      strides[axis] = length;
      length *= count[axis];
      if (!dense) length += static_cast<std::int64_t>(random() % 3 * sizeof(T));
      if (!dense && random() % 2) {
        first += strides[axis] * (count[axis] - 1);
        strides[axis] = -strides[axis];
      }
    }
    std::string out(static_cast<std::size_t>(length + first), '\x5a'), expected = out;
    for (const auto [x, y, z] : points_of(Index3{count[0], count[1], count[2]})) {
      const Index3 p = {box.low[0] + x * step[0], box.low[1] + y * step[1], box.low[2] + z * step[2]};
      std::memcpy(expected.data() + first + x * strides[0] + y * strides[1] + z * strides[2],
                  &samples[static_cast<std::size_t>(Box::of_size(dims).offset(p))], sizeof(T));
    }
    const tagrid_call call = call_of(1 + i % 4);
    ASSERT_EQ(tagrid_reader_read(reader.get(), &box, step, type, out.data() + first,
                                 dense ? nullptr : strides, &call),
              TAGRID_OK)
        << tagrid_reader_message(reader.get());
    ASSERT_EQ(out, expected) << name_of(kind);
  }
}

TEST_F(LibraryReader, AnyBoxWithAnyStepsAndStridesHasTheSamplesOfTheVolumeAndNothingElseIsWritten) {
  void (*const of_types[])(Awkward, unsigned) = {expect_boxes<std::int16_t>, expect_boxes<std::uint8_t>,
                                                 expect_boxes<float>, expect_boxes<double>};
  for (unsigned kind = 0; kind < static_cast<unsigned>(Awkward::count); ++kind)
    of_types[kind % 4](static_cast<Awkward>(kind), kind);
}

TEST_F(LibraryReader, ABoxReadsItsBricksAndNothingElse) {
  const tagrid_info info = info_of(reader_.get());
  constexpr std::uint64_t of_header = 4096, of_end = 262144;
  for (const auto& [begin, end] : file_.reads)
    EXPECT_TRUE(end <= of_header || (end == info.file_bytes && end - begin <= of_end)) << begin << " " << end;

  std::mt19937_64 random(2);
  for (int i = 0; i < 60; ++i) {
    const tagrid_box box = any_box(dims, random);
    const std::int64_t step[3] = {1 + i % 3 * 6, 1 + i % 2 * 10, 1 + i % 5 * 3};
    std::set<std::pair<std::uint64_t, std::uint64_t>> allowed;
    for (std::int64_t n = 0; n < info.bricks[0] * info.bricks[1] * info.bricks[2]; ++n) {
      tagrid_brick brick;
      tagrid_brick_init(&brick);
      ASSERT_EQ(tagrid_reader_brick(reader_.get(), n, &brick), TAGRID_OK);
      bool met = true;
      for (int axis = 0; axis < 3; ++axis) {
        bool on_axis = false;
        for (std::int64_t c = box.low[axis]; c < box.high[axis]; c += step[axis])
          on_axis |= c >= brick.box.low[axis] && c < brick.box.high[axis];
        met &= on_axis;
      }
      // With the checksum before it.
      if (met) allowed.emplace(brick.offset - 8, brick.offset + brick.bytes);
    }
    file_.reads.clear();
    ASSERT_EQ(tagrid_reader_read(reader_.get(), &box, step, TAGRID_UINT16, out_.data(), nullptr, nullptr),
              TAGRID_OK);
    const std::set<std::pair<std::uint64_t, std::uint64_t>> read(file_.reads.begin(), file_.reads.end());
    EXPECT_EQ(read, allowed);
    EXPECT_EQ(file_.reads.size(), allowed.size()) << "a brick was read twice";
  }
}

TEST_F(LibraryReader, SeveralThreadsReadOneReaderAtOnce) {
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      std::mt19937_64 random(t);
      std::vector<std::uint16_t> out(samples_.size());
      for (int i = 0; i < 8; ++i) {
        const tagrid_box box = any_box(dims, random);
        const tagrid_call call = call_of(1 + static_cast<int>(t));
        if (tagrid_reader_read(reader_.get(), &box, nullptr, TAGRID_UINT16, out.data(), nullptr, &call) !=
            TAGRID_OK)
          ++wrong;
        std::size_t n = 0;
        const Box points = {{box.low[0], box.low[1], box.low[2]},
                            {box.high[0] - 1, box.high[1] - 1, box.high[2] - 1}};
        for (const Index3 p : points_of(points))
          if (out[n++] != samples_[static_cast<std::size_t>(Box::of_size(dims).offset(p))]) ++wrong;
        // A failure of another thread is not this one's.
        const tagrid_box outside = {{0, 0, 0}, {dims.x + 1, 1, 1}};
        if (t % 2 == 0) {
          if (tagrid_reader_read(reader_.get(), &outside, nullptr, TAGRID_UINT16, out.data(), nullptr,
                                 nullptr) == TAGRID_OK)
            ++wrong;
        } else if (*tagrid_reader_message(reader_.get()) != '\0') {
          ++wrong;
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

int ignore_points(void*, size_t, const double*, const void*) { return 0; }
int ignore_tetrahedra(void*, size_t, const int64_t*, const uint8_t*) { return 0; }

tagrid_mesh_sink ignoring_sink() {
  tagrid_mesh_sink sink;
  tagrid_mesh_sink_init(&sink);
  sink.points = ignore_points;
  sink.tetrahedra = ignore_tetrahedra;
  return sink;
}

// Calls every function of a reader; returns the first status that is not TAGRID_OK.
tagrid_status do_everything(MemoryFile& file, void* out, const tagrid_call* call, std::string* message) {
  tagrid_status status;
  const ReaderHandle reader = open_reader(file, &status);
  const auto tell = [&] {
    *message = tagrid_reader_message(reader.get());
    return status;
  };
  if (status != TAGRID_OK) return tell();
  const tagrid_info info = info_of(reader.get());
  const tagrid_box all = whole_box({info.dims[0], info.dims[1], info.dims[2]});
  status = tagrid_reader_read(reader.get(), &all, nullptr, info.type, out, nullptr, call);
  if (status != TAGRID_OK) return tell();
  status = tagrid_reader_verify(reader.get(), call);
  if (status != TAGRID_OK) return tell();
  const tagrid_mesh_sink sink = ignoring_sink();
  status = tagrid_reader_mesh(reader.get(), nullptr, &sink, call);
  if (status != TAGRID_OK) return tell();
  const tagrid_mesh_options options = mesh_options(&all);
  status = tagrid_reader_mesh(reader.get(), &options, &sink, call);
  return tell();
}

TEST_F(LibraryReader, EveryReadThatFailsIsReportedWithItsPlace) {
  const Index3 small = {12, 11, 10};
  const auto samples = awkward_volume<std::uint16_t>(Awkward::smooth, small, 5);
  MemoryFile file = encoded_file(small, samples);
  std::vector<std::uint16_t> out(samples.size());
  const tagrid_call call = call_of(2);
  for (int n = 0;; ++n) {
    file.reads.clear();
    file.fails_at = n;
    std::string message;
    const tagrid_status status = do_everything(file, out.data(), &call, &message);
    if (static_cast<int>(file.reads.size()) < n) break;
    if (status == TAGRID_OK) {
      EXPECT_GT(n, 20);
      break;
    }
    ASSERT_EQ(status, TAGRID_IO_ERROR) << n << " " << message;
    EXPECT_TRUE(has(message, "memory: cannot read"));
    EXPECT_TRUE(has(message, "error 5"));
  }
}

TEST_F(LibraryReader, CallsStopWhereProgressSaysSo) {
  const tagrid_mesh_sink sink = ignoring_sink();
  const tagrid_mesh_options options = mesh_options(&all_);
  const std::function<tagrid_status(const tagrid_call*)> works[] = {
      [&](const tagrid_call* call) { return read_all(call); },
      [&](const tagrid_call* call) { return tagrid_reader_verify(reader_.get(), call); },
      [&](const tagrid_call* call) { return tagrid_reader_mesh(reader_.get(), nullptr, &sink, call); },
      [&](const tagrid_call* call) { return tagrid_reader_mesh(reader_.get(), &options, &sink, call); }};
  for (const auto& work : works) {
    CountedProgress whole;
    tagrid_call call = call_of(3, CountedProgress::report, &whole);
    ASSERT_EQ(work(&call), TAGRID_OK);
    EXPECT_GT(whole.calls, 0);
    EXPECT_EQ(whole.done, whole.total);
    for (int stop_at = 0; stop_at < whole.calls; ++stop_at) {
      CountedProgress stopped{.stop_at = stop_at};
      call.progress_user = &stopped;
      ASSERT_EQ(work(&call), TAGRID_CANCELLED);
      EXPECT_STREQ(tagrid_reader_message(reader_.get()), "cancelled by the caller");
    }
    // It still works as before.
    EXPECT_EQ(work(nullptr), TAGRID_OK);
  }
}

TEST_F(LibraryReader, DamagedFilesGiveAnErrorOrTheRightSamples) {
  const Index3 small = {10, 9, 11};
  const auto samples = awkward_volume<std::uint16_t>(Awkward::smooth, small, 7);
  const MemoryFile whole = encoded_file(small, samples);
  std::mt19937 random(8);
  const tagrid_call call = call_of(1);
  const auto expect_no_wrong_samples = [&](const std::string& bytes, const std::string& what) {
    MemoryFile file{bytes};
    tagrid_status status;
    const ReaderHandle reader = open_reader(file, &status);
    if (status == TAGRID_OK) {
      std::vector<std::uint16_t> out(samples.size());
      const tagrid_box all = whole_box(small);
      status = tagrid_reader_read(reader.get(), &all, nullptr, TAGRID_UINT16, out.data(), nullptr, &call);
      if (status == TAGRID_OK) {
        ASSERT_EQ(out, samples) << what;
      }
    }
    if (status != TAGRID_OK) {
      ASSERT_EQ(status, TAGRID_BROKEN_INPUT) << what << ": " << tagrid_reader_message(reader.get());
      ASSERT_STRNE(tagrid_reader_message(reader.get()), "") << what;
    }
    std::string message;
    std::vector<std::uint16_t> out(samples.size());
    EXPECT_EQ(do_everything(file, out.data(), &call, &message), TAGRID_BROKEN_INPUT) << what;
  };
  for (std::size_t size = 0; size < whole.bytes.size(); ++size)
    expect_no_wrong_samples(whole.bytes.substr(0, size), "the first " + std::to_string(size) + " bytes");
  for (std::size_t at = 0; at < whole.bytes.size(); ++at) {
    std::string bytes = whole.bytes;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    expect_no_wrong_samples(bytes, "byte " + std::to_string(at));
  }
}

TEST_F(LibraryReader, ALimitOfMemoryThatCannotBeKeptIsRefusedAndTheMessageSaysTheOneThatIsEnough) {
  const tagrid_mesh_sink sink = ignoring_sink();
  const tagrid_mesh_options options = mesh_options(&all_);
  tagrid_call call = call_of(2);
  for (const auto& [limit, status] : {std::pair<std::uint64_t, tagrid_status>{1, TAGRID_MEMORY_LIMIT},
                                      {std::uint64_t{1} << 30, TAGRID_OK},
                                      {UINT64_MAX, TAGRID_OK}}) {
    call.memory_limit = limit;
    EXPECT_EQ(read_all(&call), status) << limit;
    EXPECT_EQ(tagrid_reader_verify(reader_.get(), &call), status) << limit;
    EXPECT_EQ(tagrid_reader_mesh(reader_.get(), nullptr, &sink, &call), status) << limit;
    EXPECT_EQ(tagrid_reader_mesh(reader_.get(), &options, &sink, &call), status) << limit;
  }
  call = call_of(1);
  call.memory_limit = 17;
  ASSERT_EQ(read_all(&call), TAGRID_MEMORY_LIMIT);
  // Bricks of some hundred samples.
  EXPECT_STREQ(tagrid_reader_message(reader_.get()),
               "reading a part of the volume needs at least 1 MiB of memory, but the limit is 17 B");
  call.memory_limit = 1 << 20;
  EXPECT_EQ(read_all(&call), TAGRID_OK);
}

TEST_F(LibraryReader, AThreadReadsItsOwnMessageAlsoWhereItHasTheNumberOfOneThatIsGone) {
  const ReaderHandle other = open_reader(file_);
  for (int i = 0; i < 5; ++i) {
    std::thread([&] {
      EXPECT_NE(tagrid_reader_brick(reader_.get(), -1, nullptr), TAGRID_OK);
      EXPECT_STREQ(tagrid_reader_message(reader_.get()), "there is no brick with this number");
      EXPECT_STREQ(tagrid_reader_message(other.get()), "");
    }).join();
    std::thread([&] { EXPECT_STREQ(tagrid_reader_message(reader_.get()), ""); }).join();
  }
  EXPECT_STREQ(tagrid_reader_message(reader_.get()), "");
  // One message a thread: that of its last failure.
  EXPECT_NE(tagrid_reader_brick(reader_.get(), -1, nullptr), TAGRID_OK);
  EXPECT_NE(tagrid_reader_info(other.get(), nullptr), TAGRID_OK);
  EXPECT_STREQ(tagrid_reader_message(other.get()), "there is no struct to fill");
  EXPECT_STREQ(tagrid_reader_message(reader_.get()), "");
}

TEST_F(LibraryReader, WhyAReaderIsNotOpenIsKeptForEveryThread) {
  MemoryFile file{"no such file"};
  const ReaderHandle reader = open_reader(file), other = open_reader(file);
  const std::string why = tagrid_reader_message(reader.get());
  EXPECT_TRUE(has(why, "this is not a .tag file"));
  EXPECT_EQ(tagrid_reader_message(other.get()), why);
  std::thread([&] { EXPECT_EQ(tagrid_reader_message(reader.get()), why); }).join();
}

TEST_F(LibraryReader, StructsOfCallersWithOlderAndNewerHeadersAreTaken) {
  tagrid_info info;
  tagrid_info_init(&info);
  EXPECT_EQ(tagrid_reader_info(reader_.get(), &info), TAGRID_OK);
  EXPECT_EQ(info.dims[1], dims.y);
  tagrid_brick brick;
  tagrid_brick_init(&brick);
  EXPECT_EQ(tagrid_reader_brick(reader_.get(), 0, &brick), TAGRID_OK);
  EXPECT_GT(brick.bytes, 0u);
  tagrid_info_init(nullptr);
  tagrid_brick_init(nullptr);
  struct {
    tagrid_info info;
    char more[40];
  } newer;
  std::memset(&newer, 0x77, sizeof newer);
  newer.info.struct_size = sizeof newer;
  ASSERT_EQ(tagrid_reader_info(reader_.get(), &newer.info), TAGRID_OK);
  EXPECT_EQ(newer.info.struct_size, sizeof newer);
  EXPECT_EQ(newer.info.dims[0], dims.x);
  for (const char c : newer.more) EXPECT_EQ(c, 0x77);
  struct {
    tagrid_call call;
    char more[40];
  } call;
  std::memset(&call, 0x77, sizeof call);
  call.call = call_of(1);
  call.call.struct_size = sizeof call;
  EXPECT_EQ(tagrid_reader_verify(reader_.get(), &call.call), TAGRID_OK);
  // The older header has a struct without its last member, which is not overwritten.
  tagrid_call older;
  std::memset(&older, 0x77, sizeof older);
  tagrid_call_init_sized(&older, offsetof(tagrid_call, progress_user));
  EXPECT_EQ(older.struct_size, offsetof(tagrid_call, progress_user));
  EXPECT_EQ(older.progress, nullptr);
  void* untouched;
  std::memset(&untouched, 0x77, sizeof untouched);
  EXPECT_EQ(older.progress_user, untouched);
}

TEST_F(LibraryReader, APipeIsRefusedAndNotWaitedFor) {
  ASSERT_EQ(mkfifo(path("pipe.tag").c_str(), 0600), 0);
  for (const std::string& name : {path("pipe.tag"), std::string("/dev/null")}) {
    tagrid_reader* opened = nullptr;
    EXPECT_EQ(tagrid_reader_open_file(name.c_str(), &opened), TAGRID_IO_ERROR);
    EXPECT_EQ(std::string(tagrid_reader_message(opened)),
              name +
                  ": is not a regular file, and only regular files can be read in any order; copy it to a "
                  "file first");
    tagrid_reader_close(opened);
  }
}

TEST_F(LibraryReader, ArgumentsThatMakeNoSenseAreRefused) {
  const tagrid_reader* reader = reader_.get();
  const auto bad = [&](tagrid_status status, const char* what) {
    EXPECT_EQ(status, TAGRID_INVALID_ARGUMENT) << what;
    EXPECT_STRNE(tagrid_reader_message(reader), "") << what;
  };

  EXPECT_EQ(tagrid_reader_open_file("no such file", nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_reader_open(nullptr, nullptr), TAGRID_INVALID_ARGUMENT);
  tagrid_input unset = file_.input();
  unset.struct_size = 0;
  tagrid_input without = file_.input();
  without.read_at = nullptr;
  for (const tagrid_input* input : std::initializer_list<const tagrid_input*>{nullptr, &unset, &without}) {
    tagrid_reader* opened = nullptr;
    EXPECT_EQ(tagrid_reader_open(input, &opened), TAGRID_INVALID_ARGUMENT);
    EXPECT_STRNE(tagrid_reader_message(opened), "");
    // It is not open, and reports this.
    EXPECT_EQ(tagrid_reader_read(opened, &all_, nullptr, TAGRID_UINT16, out_.data(), nullptr, nullptr),
              TAGRID_INVALID_ARGUMENT);
    EXPECT_EQ(tagrid_reader_verify(opened, nullptr), TAGRID_INVALID_ARGUMENT);
    EXPECT_STREQ(tagrid_reader_metadata(opened), "");
    tagrid_reader_close(opened);
  }
  for (const char* path : {static_cast<const char*>(nullptr), "no such file"}) {
    tagrid_reader* opened = nullptr;
    EXPECT_EQ(tagrid_reader_open_file(path, &opened), path ? TAGRID_IO_ERROR : TAGRID_INVALID_ARGUMENT);
    EXPECT_STRNE(tagrid_reader_message(opened), "");
    tagrid_reader_close(opened);
  }
  tagrid_reader_close(nullptr);
  EXPECT_STRNE(tagrid_reader_message(nullptr), "");
  EXPECT_STREQ(tagrid_reader_metadata(nullptr), "");
  EXPECT_EQ(tagrid_reader_verify(nullptr, nullptr), TAGRID_INVALID_ARGUMENT);

  bad(tagrid_reader_info(reader, nullptr), "no info");
  tagrid_info info = {};
  bad(tagrid_reader_info(reader, &info), "size of info");
  tagrid_brick brick = {};
  bad(tagrid_reader_brick(reader, 0, &brick), "size of brick");
  brick.struct_size = sizeof brick;
  bad(tagrid_reader_brick(reader, -1, &brick), "brick -1");
  bad(tagrid_reader_brick(reader, 1000000, &brick), "brick 1000000");
  bad(tagrid_reader_brick(reader, 0, nullptr), "no brick");

  bad(tagrid_reader_read(reader, nullptr, nullptr, TAGRID_UINT16, out_.data(), nullptr, nullptr), "no box");
  bad(tagrid_reader_read(reader, &all_, nullptr, TAGRID_UINT16, nullptr, nullptr, nullptr), "buffer");
  for (const tagrid_type other : {TAGRID_INT16, TAGRID_FLOAT64, static_cast<tagrid_type>(0)})
    bad(tagrid_reader_read(reader, &all_, nullptr, other, out_.data(), nullptr, nullptr), "a type");
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<tagrid_box> boxes(4, all_);
    boxes[0].low[axis] = -1;
    boxes[1].high[axis] = dims[axis] + 1;
    boxes[2].high[axis] = 0;
    boxes[3].low[axis] = INT64_MIN, boxes[3].high[axis] = INT64_MAX;
    for (const tagrid_box& box : boxes)
      bad(tagrid_reader_read(reader, &box, nullptr, TAGRID_UINT16, out_.data(), nullptr, nullptr), "a box");
    for (const std::int64_t step : {std::int64_t{0}, std::int64_t{-1}, INT64_MIN}) {
      std::int64_t steps[3] = {1, 1, 1};
      steps[axis] = step;
      bad(tagrid_reader_read(reader, &all_, steps, TAGRID_UINT16, out_.data(), nullptr, nullptr), "a step");
    }
  }
  tagrid_call call = call_of(-1);
  bad(tagrid_reader_read(reader, &all_, nullptr, TAGRID_UINT16, out_.data(), nullptr, &call), "-1 threads");
  call = call_of(1);
  call.struct_size = sizeof call - 1;
  bad(tagrid_reader_verify(reader, &call), "size of call");
  tagrid_mesh_sink sink = ignoring_sink();
  bad(tagrid_reader_mesh(reader, nullptr, nullptr, nullptr), "no sink");
  sink.points = nullptr;
  bad(tagrid_reader_mesh(reader, nullptr, &sink, nullptr), "no points");
  sink = ignoring_sink();
  tagrid_mesh_options options = mesh_options();
  for (const int level : {-2, 7, 1000}) {
    options.level = level;
    bad(tagrid_reader_mesh(reader, &options, &sink, nullptr), "a level");
  }
  tagrid_call_init(nullptr);
  tagrid_input_init(nullptr);
  tagrid_mesh_sink_init(nullptr);
  tagrid_mesh_options_init(nullptr);
}

TEST_F(LibraryReader, AnOverviewIsAFileOfItsOwnThatNeedsNoOther) {
  MemoryFile file{file_content(TAGRID_SOURCE_DIR "/tests/golden/1.0/lead_voxels_overviews_int16.tag")};
  ReaderHandle reader = open_reader(file);
  std::int64_t factors[TAGRID_MOST_OVERVIEWS];
  ASSERT_EQ(tagrid_reader_overviews(reader.get(), factors), TAGRID_OK);
  EXPECT_EQ(factors[0], 4);
  EXPECT_EQ(factors[1], 16);
  EXPECT_EQ(factors[2], 0);
  tagrid_reader* opened = nullptr;
  EXPECT_EQ(tagrid_reader_overview(reader.get(), 8, &opened), TAGRID_INVALID_ARGUMENT);
  EXPECT_STRNE(tagrid_reader_message(opened), "");
  tagrid_reader_close(opened);
  ASSERT_EQ(tagrid_reader_overview(reader.get(), 4, &opened), TAGRID_OK);
  const ReaderHandle overview(opened);
  std::vector<std::int16_t> whole(41 * 35 * 38), means(11 * 9 * 10);
  const tagrid_box all = whole_box({41, 35, 38}), blocks = whole_box({11, 9, 10});
  ASSERT_EQ(tagrid_reader_read(reader.get(), &all, nullptr, TAGRID_INT16, whole.data(), nullptr, nullptr),
            TAGRID_OK);
  reader.reset();
  ASSERT_EQ(
      tagrid_reader_read(overview.get(), &blocks, nullptr, TAGRID_INT16, means.data(), nullptr, nullptr),
      TAGRID_OK);
  EXPECT_EQ(tagrid_reader_verify(overview.get(), nullptr), TAGRID_OK);
  for (const Index3 block : points_of(Index3{11, 9, 10})) {
    double sum = 0, count = 0;
    for (const Index3 in : points_of(Index3{4, 4, 4})) {
      const Index3 p = 4 * block + in;
      if (!Box::of_size({41, 35, 38}).contains(p)) continue;
      sum += whole[static_cast<std::size_t>(Box::of_size({41, 35, 38}).offset(p))];
      ++count;
    }
    // The bound of both is 8.
    EXPECT_NEAR(means[static_cast<std::size_t>(Box::of_size({11, 9, 10}).offset(block))], sum / count, 16.5);
  }
}

TEST_F(LibraryReader, AVolumeIsAFileOfItsOwnThatNeedsNoOther) {
  MemoryFile file{file_content(TAGRID_SOURCE_DIR "/tests/golden/1.0/volumes_bounded_int16.tag")};
  ReaderHandle reader = open_reader(file);
  std::int64_t count = 0;
  ASSERT_EQ(tagrid_reader_volumes(reader.get(), &count), TAGRID_OK);
  EXPECT_EQ(count, 3);
  EXPECT_EQ(tagrid_reader_verify(reader.get(), nullptr), TAGRID_OK);
  for (const std::int64_t wrong : {-1, 3}) {
    tagrid_reader* opened = nullptr;
    EXPECT_EQ(tagrid_reader_volume(reader.get(), wrong, &opened), TAGRID_INVALID_ARGUMENT);
    tagrid_reader_close(opened);
  }
  std::vector<ReaderHandle> volumes;
  for (std::int64_t number = 0; number < count; ++number) {
    tagrid_reader* opened = nullptr;
    ASSERT_EQ(tagrid_reader_volume(reader.get(), number, &opened), TAGRID_OK);
    volumes.emplace_back(opened);
  }
  reader.reset();
  const Index3 size{19, 18, 11};
  const tagrid_box all = whole_box(size);
  for (std::int64_t number = 0; number < count; ++number) {
    const tagrid_reader* volume = volumes[static_cast<std::size_t>(number)].get();
    std::vector<std::int16_t> decoded(static_cast<std::size_t>(Box::of_size(size).count()));
    ASSERT_EQ(tagrid_reader_read(volume, &all, nullptr, TAGRID_INT16, decoded.data(), nullptr, nullptr),
              TAGRID_OK);
    std::vector<std::int16_t> slice(static_cast<std::size_t>(size.x * size.y));
    for (std::int64_t z = 0; z < size.z; ++z) {
      phantom_slice<std::int16_t>(size, static_cast<std::uint64_t>(1 + number), z, slice);
      for (std::size_t i = 0; i < slice.size(); ++i)
        ASSERT_LE(std::abs(decoded[static_cast<std::size_t>(z) * slice.size() + i] - slice[i]), 8);
    }
    std::int64_t factors[TAGRID_MOST_OVERVIEWS];
    ASSERT_EQ(tagrid_reader_overviews(volume, factors), TAGRID_OK);
    EXPECT_EQ(factors[0], 4);
    // Volume 0 is the file itself.
    std::int64_t others = 0;
    ASSERT_EQ(tagrid_reader_volumes(volume, &others), TAGRID_OK);
    EXPECT_EQ(others, number == 0 ? 3 : 1);
  }
}

TEST_F(LibraryReader, AnEnormousNumberOfThreadsIsTakenAsALimitAndNothingIsSaid) {
  const tagrid_mesh_sink sink = ignoring_sink();
  const tagrid_call call = call_of(INT32_MAX);
  testing::internal::CaptureStderr();
  EXPECT_EQ(read_all(&call), TAGRID_OK);
  EXPECT_EQ(tagrid_reader_verify(reader_.get(), &call), TAGRID_OK);
  EXPECT_EQ(tagrid_reader_mesh(reader_.get(), nullptr, &sink, &call), TAGRID_OK);
  const Encoded encoded = encode(encode_options(dims, SampleType::uint16), samples_.data(), &call);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(encoded.bytes, file_.bytes);
}

}  // namespace
}  // namespace tagrid
