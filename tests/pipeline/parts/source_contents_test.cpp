// The content of source files, looked at by several ranks: the same envelope as from one process.
#include "pipeline/parts/work_orders.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "tests/support/fake_ranks.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class SourceContents : public TemporaryFolder {
 protected:
  /// A directory of files that have 5 bytes and a slice each.
  void write_slices(const Index3& dims) {
    std::filesystem::create_directory(path("slices"));
    raw_.dims = dims;
    raw_.type = SampleType::int16;
    raw_.offset = 5;
    const auto samples = blobs<std::int16_t>(dims, 1);
    const auto slice = static_cast<std::size_t>(dims.x * dims.y);
    for (std::size_t z = 0; z < static_cast<std::size_t>(dims.z); ++z) {
      const std::string number = std::to_string(10000 + z);
      write_content(path("slices/s" + number + ".raw"),
                    number + std::string(reinterpret_cast<const char*>(&samples[z * slice]), 2 * slice));
    }
  }
  SourceFiles files() const {
    return source_files(open_volume(path("slices"), SourceDescription(raw_))->facts());
  }
  /// Rank 0 does `work`; the others serve.
  static void by(int count, const std::function<void(Ranks&)>& work) {
    std::exception_ptr thrown;
    FakeRanks(count).run([&](Ranks& ranks) {
      if (ranks.rank() > 0) {
        serve(
            ranks, [](std::uint64_t) {}, [](const Bytes&) {});
        return;
      }
      try {
        work(ranks);
      } catch (...) {
        thrown = std::current_exception();
      }
      dismiss(ranks, 0);
    });
    if (thrown) std::rethrow_exception(thrown);
  }

  RawDescription raw_;
};

TEST_F(SourceContents, AreTheSameForAnyRanksAndThreads) {
  write_slices({2, 1, 4500});  // more than are looked at at once
  SourceFiles expected = files();
  look_at_contents(expected, true, 1);
  EXPECT_TRUE(expected.files.front().checksum && expected.files.back().checksum);
  for (const int count : {1, 2, 3})
    for (const int threads : {1, 2}) {
      SourceFiles source = files();
      by(count, [&](Ranks& ranks) { share_contents(ranks, source, true, Resources(threads)); });
      EXPECT_TRUE(source.files == expected.files) << count << " ranks, " << threads << " threads";
    }
}

TEST_F(SourceContents, MakeTheSameFileForAnyRanksAndThreads) {
  write_slices({21, 19, 40});
  std::string expected;
  for (const int count : {1, 2, 3})
    for (const int threads : {1, 2}) {
      by(count, [&](Ranks& ranks) {
        EncodeRun run = {.input = path("slices"),
                         .source = SourceDescription(raw_),
                         .output = path("a.tag"),
                         .overwrite = true,
                         .resources = Resources(threads),
                         .keep_files = true};
        run.options.cube_size = 8;
        EXPECT_EQ(committed(encode_volume(ranks, run)).why_not_restorable, "");
      });
      if (expected.empty()) expected = content("a.tag");
      EXPECT_TRUE(content("a.tag") == expected) << count << " ranks, " << threads << " threads";
    }
}

TEST_F(SourceContents, AFileThatIsGoneEndsAllRanks) {
  write_slices({2, 1, 30});
  SourceFiles source = files();
  std::filesystem::remove(path("slices/s10029.raw"));
  EXPECT_THROW(by(3, [&](Ranks& ranks) { share_contents(ranks, source, true, Resources(1)); }), WorldError);
}

}  // namespace
}  // namespace tagrid
