// Orders of rank 0, obeyed by ranks that are threads: the same files as from one process, and one failure for
// all.
#include <set>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "tests/support/fake_ranks.h"
#include "tests/support/runs.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class WorkOrders : public TemporaryFolder {
 protected:
  WorkOrders() {
    write_nrrd(path("a.nrrd"), dims_, blobs<std::int16_t>(dims_, 1));
    options_.cube_size = 8;
    options_.brick_edge = 2;
    options_.max_error = 3;
    encode_volume(path("a.nrrd"), {}, path("one.tag"), true, options_, Resources(1));
    decode_volume(path("one.tag"), path("one.raw"), format_named("raw"), true, Resources(1));
  }

  EncodeRun run_to(const std::string& output) const {
    return {.input = path("a.nrrd"),
            .output = path(output),
            .overwrite = true,
            .options = options_,
            .resources = Resources(1)};
  }
  void decode(Ranks& ranks, const std::string& input) const {
    committed(decode_volume(ranks, {.input = path(input),
                                    .output = path("a.raw"),
                                    .format = format_named("raw"),
                                    .overwrite = true,
                                    .resources = Resources(1)}));
  }
  VerifyResult verify(Ranks& ranks, const std::string& input, const std::string& original,
                      const Resources& resources = Resources(1)) const {
    return verify_file(ranks, {.input = path(input),
                               .original = original.empty() ? std::nullopt : std::optional(path(original)),
                               .resources = resources});
  }

  static constexpr Index3 dims_{50, 41, 60};
  EncodeOptions options_;
};

TEST_F(WorkOrders, AnyNumberOfRanksMakesTheFilesOfOneProcess) {
  for (const int count : {1, 2, 3, 8}) {
    by(count, [&](Ranks& ranks) {
      committed(encode_volume(ranks, run_to("a.tag")));
      EXPECT_TRUE(content("a.tag") == content("one.tag")) << count;
      decode(ranks, "a.tag");
      EXPECT_TRUE(content("a.raw") == content("one.raw")) << count;
      EXPECT_EQ(verify(ranks, "a.tag", "a.nrrd").header.parameters.dims, dims_);
    });
    EXPECT_EQ(names(), (std::vector<std::string>{"a.nrrd", "a.raw", "a.tag", "one.raw", "one.tag"}));
  }
}

TEST_F(WorkOrders, ProgressOfOneProcessIsToldWhileItWorksAndNeverFallsOrPassesTheEnd) {
  std::vector<std::uint64_t> seen;
  by(1, [&](Ranks& ranks) {
    EncodeRun run = run_to("a.tag");
    run.progress = [&](std::uint64_t done, std::uint64_t total) {
      EXPECT_EQ(total, static_cast<std::uint64_t>(Box::of_size(dims_).count()) * 2);
      EXPECT_LE(done, total);
      seen.push_back(done);
    };
    committed(encode_in_parts(ranks, run));
  });
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_GT(std::set<std::uint64_t>(seen.begin(), seen.end()).size(), 10U);
  EXPECT_EQ(seen.back(), static_cast<std::uint64_t>(Box::of_size(dims_).count()) * 2);
}

TEST_F(WorkOrders, ADamagedFileAndAnotherOriginalAreToldOnceAndTheOthersServeOn) {
  file("bad.tag", flipped(content("one.tag"), content("one.tag").size() / 2));
  auto samples = blobs<std::int16_t>(dims_, 1);
  samples[12345] = static_cast<std::int16_t>(samples[12345] + 9);
  write_nrrd(path("other.nrrd"), dims_, samples);
  by(3, [&](Ranks& ranks) {
    EXPECT_THROW(decode(ranks, "bad.tag"), BrokenInput);
    EXPECT_THROW(verify(ranks, "bad.tag", ""), BrokenInput);
    EXPECT_THROW(verify(ranks, "one.tag", "other.nrrd"), BrokenInput);
    // Work after a failure is done as if nothing had failed.
    committed(encode_volume(ranks, run_to("a.tag")));
    EXPECT_TRUE(content("a.tag") == content("one.tag"));
  });
  EXPECT_EQ(names(),
            (std::vector<std::string>{"a.nrrd", "a.tag", "bad.tag", "one.raw", "one.tag", "other.nrrd"}));
}

TEST_F(WorkOrders, WhatIsNotCommittedLeavesNothing) {
  for (const int count : {1, 3})
    by(count, [&](Ranks& ranks) {
      const auto before = names();
      for (const bool resume : {false, true}) {
        EncodeRun run = run_to("a.tag");
        run.resume = resume;
        {
          const FinishedEncode encoded = encode_volume(ranks, run);
          // All of it is there, but not under its name.
          EXPECT_EQ(file_content(encoded.result.temporary), content("one.tag"));
          EXPECT_FALSE(std::filesystem::exists(path("a.tag")));
        }
        // A run that can be continued leaves its record alone.
        std::filesystem::remove_all(path(".a.tag.parts"));
        EXPECT_EQ(names(), before) << count << resume;
      }
      {
        const FinishedDecode decoded = decode_volume(
            ranks, {.input = path("one.tag"), .output = path("b.nrrd"), .resources = Resources(1)});
        EXPECT_FALSE(std::filesystem::exists(path("b.nrrd")));
      }
      EXPECT_EQ(names(), before) << count;
    });
}

TEST_F(WorkOrders, ALimitOnMemoryReachesTheOthersAndSoDoOrdersOfTheProgram) {
  std::atomic<std::uint64_t> limits{0}, obeyed{0};
  FakeRanks(3).run([&](Ranks& ranks) {
    if (ranks.rank() > 0) {
      serve(
          ranks, [&](std::uint64_t limit) { limits += limit; },
          [&](const Bytes& order) { obeyed += order.size(); });
      return;
    }
    Resources resources(1);
    resources.memory = std::uint64_t{1} << 30;
    verify(ranks, "one.tag", "", resources);
    send_order(ranks, Bytes(21));
    dismiss(ranks, 0);
  });
  EXPECT_EQ(limits, std::uint64_t{2} << 30);
  EXPECT_EQ(obeyed, 42U);
}

// The content of source files, looked at by several ranks: the same envelope as from one process.

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
