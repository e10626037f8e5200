// tagrid-mpi: the same files with any number of processes, and an end of the whole job if one of them fails.
#include <cmath>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/files/output_file.h"
#include "io/tag/file.h"
#include "pipeline/parts/part_work.h"
#include "tests/support/forged_index.h"
#include "tests/support/mpi_runs.h"

namespace tagrid {
namespace {

class Mpi : public MpiRuns {
 protected:
  /// volume.nhdr, and new.tag of it.
  void make_new(const std::string& dims) {
    make_volume(dims);
    file("new.tag", plain_);
  }
};

TEST_F(Mpi, AnyNumberOfProcessesWritesTheSameFile) {
  make_volume("50,41,45");
  for (const int processes : {1, 2, 3, 4, 7})
    for (const char* threads : {"-T1", "-T3"}) {
      SCOPED_TRACE(std::to_string(processes) + threads);
      expect_result(by(processes, with({"encode", "volume.nhdr", "-fo", "new.tag", threads},
                                       {"--cube=8", "--brick=1", "--max-error=2"})));
      expect_names({"new.tag", "volume.nhdr", "volume.raw"});
      if (HasFailure()) return;
    }
}

TEST_F(Mpi, AnyNumberOfProcessesWritesTheSameParity) {
  make_volume("50,41,45");
  const Arguments encode = {"encode", "volume.nhdr", "--cube=8", "--brick=1", "--parity=5%", "-fo"};
  expect_ok(tagrid(with(encode, {"a.tag"})));
  for (const int processes : {1, 2, 3}) {
    expect_ok(by(processes, with(encode, {"b.tag"})));
    EXPECT_TRUE(content("b.tag") == content("a.tag")) << processes;
  }
  works("verify b.tag -q");
}

// One process sums and encodes what many have read, each with its rows, also after one was killed.
TEST_F(Mpi, AnyNumberOfProcessesWritesTheSameOverviews) {
  for (const char* type : {"int16", "float32"}) {
    SCOPED_TRACE(type);
    phantom("volume.nhdr", {"--dims", "50,41,45", "--type", type});
    const Arguments encode = {"encode",        "volume.nhdr",      "--cube=8", "--brick=1",
                              "--max-error=2", "--overviews=4,16", "-fo"};
    expect_ok(tagrid(with(encode, {"a.tag", "-T1"})));
    for (const int processes : {1, 2, 3, 7})
      for (const Arguments& more : {Arguments{"-T2"}, {"-T1", "--resume"}}) {
        expect_ok(by(processes, with(with(encode, {"b.tag"}), more)));
        EXPECT_TRUE(content("b.tag") == content("a.tag")) << processes << more.back();
      }
    std::filesystem::remove(path("b.tag"));
    with_fault(3, "30", "SIGKILL", with(encode, {"b.tag", "--resume"}));
    expect_ok(by(2, with(encode, {"b.tag", "--resume"})));
    EXPECT_TRUE(content("b.tag") == content("a.tag"));
    expect_ok(by(3, {"verify", "b.tag", "--against", "volume.nhdr", "-q"}));
    for (const std::string& name : names()) std::filesystem::remove_all(path(name));
  }
}

TEST_F(Mpi, AlsoOverTcp) {
  make_volume("23,19,21");
  expect_result(
      by(4, with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_), {"--mca", "btl", "tcp,self"}));
  expect_ok(by(3, {"decode", "new.tag", "-o", "back.raw", "-q"}, {"--mca", "btl", "tcp,self"}));
}

TEST_F(Mpi, DecodesAsOneProcess) {
  make_new("50,41,45");
  file("scaled.nhdr", content("volume.nhdr") + "rescale_slope:=1\nrescale_intercept:=-100\n");
  expect_ok(tagrid(with({"encode", "scaled.nhdr", "-o", "scaled.tag"}, settings_)));
  std::vector<Arguments> calls;
  for (const char* name : {"x.nrrd", "x.nhdr", "x.raw"}) calls.push_back({"decode", "new.tag", "-fo", name});
  for (const char* name : {"x.nrrd", "x.mha", "x.nii", "x.tif"})
    for (const char* numbers : {"--values", "--samples"})
      calls.push_back({"decode", "scaled.tag", numbers, "-fo", name});
  for (const Arguments& call : calls) {
    EXPECT_EQ(tagrid(call).code, 0);
    const std::string expected = content(call.back()), samples = content("x.raw");
    for (const int processes : {2, 3, 7}) {
      const Ending ending = by(processes, call);
      EXPECT_EQ(ending.code, 0) << ending.err;
      EXPECT_TRUE(content(call.back()) == expected && content("x.raw") == samples)
          << call.back() << " by " << processes;
    }
  }
}

TEST_F(Mpi, OtherCommandsAreDoneByOneProcess) {
  make_new("23,19,21");
  EXPECT_EQ(by(3, {"info", "new.tag", "--json"}).out, out("info new.tag --json"));
  EXPECT_EQ(by(3, {"mesh", "new.tag", "-o", "mesh.vtu", "-q"}).code, 0);
  EXPECT_EQ(by(2, {"--help"}).out, out("--help"));
}

TEST_F(Mpi, AFailureEndsTheJobWithItsCodeAndOneMessageAndLeavesNothing) {
  make_volume("23,19,21");
  expect_one_error(by(3, {"encode", "volume.nhdr", "-o", "new.tag", "--nonsense"}), usage, "unknown option");
  expect_one_error(by(3, {"encode", "nothing.nhdr", "-o", "new.tag"}), world, "nothing.nhdr");
  expect_one_error(by(3, {"encode", "volume.nhdr", "-o", "no/new.tag"}), world, "no/");
  expect_names({"volume.nhdr", "volume.raw"});
  // A damaged file; the rank that decodes that part finds the damage.
  std::string bytes = plain_;
  bytes[bytes.size() / 2] ^= 1;
  file("new.tag", bytes);
  expect_one_error(by(3, {"decode", "new.tag", "-o", "back.nrrd"}), broken_input, "brick");
  expect_names({"new.tag", "volume.nhdr", "volume.raw"});
}

class MpiFaults : public MpiRuns {
 protected:
  Arguments without_resume() const { return with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_); }
};

TEST_F(MpiFaults, ARankWhoseDiskFailsEndsTheJob) {
  make_volume("50,41,45");
  int failures = 0;
  for (const int at : {6, 20, 33, 60}) {
    SCOPED_TRACE(at);
    const Ending ending = with_fault(3, std::to_string(at), std::to_string(EIO), without_resume());
    if (ending.code == 0) {  // the other ranks were faster
      expect_result(ending);
      begin_anew();
      continue;
    }
    EXPECT_EQ(ending.code, world) << ending.err;
    EXPECT_TRUE(has(ending.err, "rank 1: "));
    expect_names({"volume.nhdr", "volume.raw"});
    ++failures;
  }
  EXPECT_GT(failures, 0);
}

TEST_F(MpiFaults, ARankThatIsKilledEndsTheJobAndTheNextOneGoesOn) {
  make_volume("50,41,45");
  for (const int victim : {0, 1, 3})
    for (const int at : {8, 30, 70}) {
      SCOPED_TRACE(std::to_string(victim) + " at " + std::to_string(at));
      Ending ending = with_fault(4, std::to_string(at), "SIGKILL", command(), victim);
      if (ending.code != 0) {
        expect_no_half_file();
        expect_result(by(2, command()));
      }
      begin_anew();
      // Without --resume it leaves nothing but what SIGKILL leaves.
      ending = with_fault(4, std::to_string(at), "SIGKILL", without_resume(), victim);
      if (ending.code != 0 && victim != 0) {
        EXPECT_FALSE(std::filesystem::exists(path("new.tag")));
      }
      expect_no_half_file();
      begin_anew();
      if (HasFailure()) return;
    }
}

TEST_F(Mpi, GoesOnAfterSignalsAtAnyMoment) {
  make_volume("64,60,56");
  const unsigned long count = number_in_environment("TAGRID_KILLS", stride > 1 ? 1 : 3),
                      seed = number_in_environment("TAGRID_SEED", std::random_device()());
  std::mt19937_64 random(seed);
  const Ending good = by(4, command());
  expect_result(good);
  std::uniform_real_distribution<double> moment(0, good.seconds);
  for (unsigned long i = 0; i < count && !HasFailure(); ++i)
    for (const int signal : {SIGKILL, SIGTERM, SIGINT}) {
      SCOPED_TRACE("TAGRID_SEED=" + std::to_string(seed));
      begin_anew();
      Process process(with(mpirun(4), command()), folder_.string());
      usleep(static_cast<useconds_t>(moment(random) * 1e6));
      process.send(signal);
      const Ending ending = process.finish();
      EXPECT_NE(ending.code == 0, ending.signal != 0 || ending.code > 0);
      wait_for_all_processes();
      expect_no_half_file();
      if (!std::filesystem::exists(path("new.tag")) || std::filesystem::exists(path(".new.tag.parts/run")))
        expect_result(by(3, command()));
    }
}

TEST_F(Mpi, WhatManyBeganOneProcessCompletes) {
  make_volume("50,41,45");
  make_record();
  expect_result(by(3, command()));
  begin_anew();
  make_record();
  expect_error(tagrid(command({"--max-error=3"})), usage, "--max-error was 2, now 3");
  EXPECT_EQ(by(2, command({"--max-error=3"})).code, usage);
  expect_result(tagrid(command()));
}

// verify with many processes reports the same as one process: for good files, for each kind of damage, and if
// only two parts together show that something is wrong.

// All of a .tag file, to be modified.
struct Contents {
  TagHeader header;
  std::vector<BrickBytes> bricks;
  std::vector<IndexEntry> entries;
  TagIndex index;
};

class MpiVerify : public MpiRuns {
 protected:
  Contents contents_of(const std::string& name) const {
    TagReader reader(path(name));
    Contents contents{reader.header(), {}, {}, {}};
    reader.look_at_pages([&](std::span<const IndexEntry> page) {
      contents.entries.insert(contents.entries.end(), page.begin(), page.end());
    });
    for (BrickBytes brick; reader.read_brick(brick);) contents.bricks.push_back(brick);
    contents.index = reader.index();
    return contents;
  }
  /// With right checksums.
  void write(const std::string& name, Contents contents) const {
    const CodingParameters& parameters = contents.header.parameters;
    OutputFile out(path(name), true);
    const std::vector<std::byte> header = serialize_header(contents.header);
    out.write(header);
    const auto header_checksum = load_little_endian<std::uint64_t>(header.data() + header.size() - 8);
    std::uint64_t checksum = header_checksum;
    for (std::size_t i = 0; i < contents.bricks.size(); ++i) {
      const BrickBytes& brick = contents.bricks[i];
      checksum = write_block(out, parameters, brick, checksum);
      contents.entries[i].activity_bytes = static_cast<std::uint32_t>(brick.activity.size());
      contents.entries[i].value_bytes = static_cast<std::uint32_t>(brick.values.size());
    }
    ASSERT_LE(contents.entries.size(), std::size_t{PageLayout::least_bricks});
    add_only_page(contents.entries, checksum, contents.index,
                  [&](const std::vector<std::byte>& block) { out.write(block); });
    out.write(file_end(parameters, contents.index, out.position(), checksum, header_checksum));
    out.commit();
  }
  void encode(const std::string& volume, const std::string& tag, const Arguments& more = {}) const {
    expect_ok(tagrid(with({"encode", volume, "-qfo", tag, "--cube=8", "--brick=1", "--strip"}, more)));
  }
  static Arguments verify(const Arguments& more = {}) { return with({"verify", "new.tag"}, more); }

  /// One process, and several (two numbers of them per call, in turn), accept the file with the same report.
  void expect_accepted(const Arguments& more, const Arguments& of_mpirun = {}) const {
    const Ending alone = tagrid(verify(more));
    expect_ok(alone);
    for (int i = 0; i < 2; ++i) {
      const int processes = next_number();
      const Ending ending = by(processes, verify(more), of_mpirun);
      EXPECT_EQ(ending.code, 0) << ending.err << " by " << processes;
      EXPECT_EQ(ending.out, alone.out) << processes;
    }
  }
  /// One process, and several (another number of them in each call), refuse the file with one message.
  /// It is the same, except that a rank other than the first names itself.
  void expect_refused(const std::string& what, const Arguments& more = {}) const {
    const Ending alone = tagrid(verify(more));
    expect_error(alone, broken_input, what);
    const int processes = next_number();
    SCOPED_TRACE(processes);
    const Ending ending = by(processes, verify(more));
    expect_error(ending, broken_input, "tagrid: ");
    std::string message = ending.err;
    if (message.starts_with("tagrid: rank ")) message.erase(8, message.find(": ", 8) + 2 - 8);
    EXPECT_EQ(message, alone.err);
    EXPECT_EQ(ending.out, alone.out);
  }
  /// The first bricks of all parts except the first part.
  static std::vector<std::int64_t> cuts(const Contents& contents) {
    const BrickGrid bricks = contents.header.parameters.bricks();
    std::vector<std::int64_t> cuts;
    for (const BrickRows& part : parts_of(bricks)) cuts.push_back(part.first_brick(bricks));
    cuts.erase(cuts.begin());
    return cuts;
  }

 private:
  int next_number() const {
    constexpr int numbers[] = {3, 2, 7, 4, 1};
    return numbers[turn_++ % std::size(numbers)];
  }

  mutable std::size_t turn_ = 0;
};

TEST_F(MpiVerify, AGoodFileIsGood) {
  phantom("volume.nhdr", {"--dims", "50,41,45"});
  encode("volume.nhdr", "new.tag", {"--max-error=4", "--surface-error=1"});
  expect_accepted({});
  expect_accepted({"--against=volume.nhdr", "-T1"}, {"--mca", "btl", "tcp,self"});
  // Layers that are parts, and floats.
  phantom("volume.nrrd", {"--dims", "13,15,300", "--type=float32"});
  encode("volume.nrrd", "new.tag", {"--max-error=3"});
  expect_accepted({"--against=volume.nrrd"});
  encode("volume.nrrd", "new.tag", {"--grid-only"});
  expect_accepted({"--against=volume.nrrd", "-M30M"});
}

TEST_F(MpiVerify, PipesAndCompressedOriginalsAreOfOneProcess) {
  phantom("volume.nrrd", {"--dims", "23,19,21"});
  encode("volume.nrrd", "new.tag");
  const std::string bytes = content("new.tag");
  const Ending piped = Process(with(mpirun(3), {"verify", "-"}), folder_.string()).finish(bytes);
  EXPECT_EQ(piped.code, 0) << piped.err;
  std::string header = content("volume.nrrd"), samples = samples_of(header);
  header.resize(header.size() - samples.size());
  header.replace(header.find("encoding: raw"), 13, "encoding: gzip");
  file("samples", samples);
  file("header", header);
  expect_ok(script("gzip < samples | cat header - > gzipped.nrrd"));
  expect_accepted({"--against=gzipped.nrrd"});
}

TEST_F(MpiVerify, PartsThatDisagreeOnAFaceAreFound) {
  for (const char* dims : {"50,41,45", "13,15,300"})
    for (const bool grid_only : {true, false}) {
      SCOPED_TRACE(std::string(dims) + (grid_only ? ", points" : ", voxels"));
      // Other values on the same grid, or another grid.
      phantom("one.raw", {"--dims", dims, "-f"});
      std::string samples = content("one.raw");
      if (grid_only)
        for (std::size_t i = 0; i < samples.size(); i += 2) {
          auto* sample = reinterpret_cast<std::byte*>(samples.data() + i);
          store_little_endian<std::int16_t>(sample, load_little_endian<std::int16_t>(sample) + 1);
        }
      else
        std::reverse(samples.begin(), samples.end());
      file("other.raw", samples);
      Arguments more = {"--dims", dims, "--type=int16"};
      more.push_back(grid_only ? "--grid-only" : "--max-error=1");
      encode("one.raw", "one.tag", more);
      encode("other.raw", "other.tag", more);
      const Contents one = contents_of("one.tag"), other = contents_of("other.tag");
      if (grid_only) {
        EXPECT_TRUE(one.bricks[9].activity == other.bricks[9].activity);
      }
      const std::vector<std::int64_t> places = cuts(one);
      ASSERT_GE(places.size(), 8U);
      // A part of the other file among those of the first, followed by the rest of it.
      for (const auto& [part, all] :
           {std::pair(places.size() / 2, false), {places.size() / 3, true}, {places.size() - 1, true}}) {
        Contents mixed = one;
        const std::int64_t end = all || part + 1 == places.size()
                                     ? static_cast<std::int64_t>(one.bricks.size())
                                     : places[part + 1];
        for (std::int64_t i = places[part]; i < end; ++i) {
          const auto brick = static_cast<std::size_t>(i);
          mixed.bricks[brick] = other.bricks[brick];
          mixed.entries[brick] = other.entries[brick];
        }
        mixed.index.total.max_error = std::max(one.index.total.max_error, other.index.total.max_error);
        // Otherwise the index is wrong, too, and may be found first.
        mixed.index.total.low = std::ranges::min(mixed.entries, {}, &IndexEntry::low).low;
        mixed.index.total.high = std::ranges::max(mixed.entries, {}, &IndexEntry::high).high;
        write("new.tag", mixed);
        expect_refused("it disagrees with its neighbor at (");
        if (HasFailure()) return;
      }
    }
}

TEST_F(MpiVerify, WrongStatisticsAreFound) {
  phantom("volume.nhdr", {"--dims", "50,41,45"});
  encode("volume.nhdr", "good.tag", {"--max-error=2"});
  const Contents good = contents_of("good.tag");
  const auto expect_refused_with = [&](const std::string& what, auto change, const Arguments& more = {}) {
    Contents wrong = good;
    change(wrong);
    write("new.tag", wrong);
    expect_refused(what, more);
  };
  write("new.tag", good);
  EXPECT_TRUE(content("new.tag") == content("good.tag"));
  expect_refused_with("the value range of brick 77 does not match",
                      [](Contents& wrong) { wrong.entries[77].high += 9; });
  expect_refused_with("the number of active points", [](Contents& wrong) { ++wrong.index.total.active[5]; });
  expect_refused_with("the number of finite samples", [](Contents& wrong) { --wrong.index.total.finite; });
  expect_refused_with("above the bound", [](Contents& wrong) { wrong.index.total.max_error = 3; });
  expect_refused_with("the recorded error is not a number",
                      [](Contents& wrong) { wrong.index.total.max_error = NAN; });
  expect_refused_with("the recorded errors do not match",
                      [](Contents& wrong) { ++wrong.index.total.sum_squared_error; },
                      {"--against=volume.nhdr"});
}

TEST_F(MpiVerify, DamagedBytesAreFound) {
  phantom("volume.nhdr", {"--dims", "50,41,45"});
  encode("volume.nhdr", "new.tag", {"--max-error=2"});
  const std::string good = content("new.tag");
  for (const std::size_t at : {good.size() / 4, good.size() / 3, good.size() / 2}) {
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ 8);
    file("new.tag", damaged);
    expect_one_error(by(3, verify()), broken_input, ": checksum mismatch");
  }
  // The checksum between two parts: the message may name either of its bricks.
  file("new.tag", good);
  const Contents contents = contents_of("new.tag");
  std::uint64_t start = serialize_header(contents.header).size();
  for (std::int64_t i = 0; i < cuts(contents)[7]; ++i) {
    const IndexEntry& entry = contents.entries[static_cast<std::size_t>(i)];
    start += block_frame_size + entry.activity_bytes + entry.value_bytes;
  }
  std::string bytes = good;
  bytes[start - 1] = static_cast<char>(bytes[start - 1] ^ 8);
  file("new.tag", bytes);
  for (const int processes : {2, 3, 4})
    expect_one_error(by(processes, verify()), broken_input, ": checksum mismatch");
  for (const std::string& wrong : {good + "x", good.substr(0, good.size() - 100)}) {
    file("new.tag", wrong);
    EXPECT_EQ(by(3, verify()).code, broken_input);
  }
  file("new.tag", good.substr(0, 200));
  expect_refused("the file is too short");
}

TEST_F(MpiVerify, AnotherOriginalIsRefused) {
  phantom("volume.raw", {"--dims", "50,41,45"});
  const Arguments raw = {"--dims", "50,41,45", "--type=int16"};
  encode("volume.raw", "new.tag", with(raw, {"--max-error=2"}));
  const Arguments against = with({"--against=volume.raw"}, raw);
  expect_accepted(against);
  std::string samples = content("volume.raw");
  samples[2 * 31000] = static_cast<char>(samples[2 * 31000] + 64);
  file("volume.raw", samples);
  expect_refused("they differ by more than 2", against);
  file("volume.raw", samples + "xx");
  expect_refused("volume.raw", against);
  expect_one_error(by(3, verify({"--against=nothing.nrrd"})), world, "nothing.nrrd");
}

TEST_F(MpiVerify, ARankWhoseDiskFailsEndsTheJob) {
  phantom("volume.nhdr", {"--dims", "50,41,45"});
  encode("volume.nhdr", "new.tag");
  const std::string good = tagrid(verify()).out;
  int failures = 0, deaths = 0;
  for (const int at : {3, 8, 12, 20}) {
    // Where the other ranks were faster, the rank does not come to this call, and all is well.
    const Ending failed = with_fault(3, std::to_string(at), std::to_string(EIO), verify());
    if (failed.code == 0)
      EXPECT_EQ(failed.out, good);
    else
      expect_one_error(failed, world, "rank 1: "), ++failures;
    const Ending killed = with_fault(3, std::to_string(at), "SIGKILL", verify());
    if (killed.code == 0)
      EXPECT_EQ(killed.out, good);
    else
      ++deaths;
  }
  EXPECT_GT(failures, 0);
  EXPECT_GT(deaths, 0);
}

}  // namespace
}  // namespace tagrid
