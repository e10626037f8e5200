// -M is a promise about the resident memory of the process, whatever the shape of the volume.
#include <random>

#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

constexpr std::size_t mebibyte = std::size_t{1} << 20;
/// The default scale of int16. If it is given explicitly, there is no warning about noise far beyond the
/// range.
const std::string usual_scale = "0.001953125";

class MemoryLimit : public CommandLine {
 protected:
  void SetUp() override {
    if (program_is_sanitized()) GTEST_SKIP() << "a sanitizer takes memory of its own";
  }
  /// The limit, in MiB, that a refusal names as the smallest.
  std::size_t smallest(const std::string& line) const {
    const Ending ending = tagrid(words(line + " -M 1"));
    expect_error(ending, usage, "give -M ");
    const std::size_t at = ending.err.find("give -M ");
    return at == std::string::npos ? 0 : std::stoul(ending.err.substr(at + 8));
  }
  static std::string option(std::size_t limit) { return " -M " + std::to_string(limit) + "M"; }
  /// Runs with the smallest limit; expects that it is kept, and that a smaller one is refused.
  std::size_t run_with_smallest(const std::string& line) const {
    const std::size_t limit = smallest(line);
    fails(line + option(limit - 1), usage, "give -M ");
    // The system's figure also counts the process that started this one; the program's own figure is exact.
    works(line + option(limit) + " --json report.json");
    EXPECT_LE(json_of("report.json")["peak_memory"].get<std::size_t>(), limit * mebibyte * 11 / 10);
    std::filesystem::remove(path("report.json"));
    return limit;
  }
  /// A file of zeros, except for its ends, that takes no disk space.
  void make_sparse(const std::string& name, std::size_t bytes) const {
    write("x", name);
    std::filesystem::resize_file(path(name), bytes - 1);
    std::ofstream(path(name), std::ios::binary | std::ios::app) << 'y';
  }
  void write(const std::string& bytes, const std::string& name) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
  }
  static std::string noise(std::size_t size) {
    std::mt19937 random(1);
    std::string bytes(size, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    return bytes;
  }
};

struct Shape {
  const char* name;
  const char* dims;
  std::size_t samples;
  const char* brick;
};

class MemoryLimitOfShapes : public MemoryLimit, public testing::WithParamInterface<Shape> {};

TEST_P(MemoryLimitOfShapes, IsKept) {
  const Shape& shape = GetParam();
  make_sparse("a.raw", shape.samples * 2);
  const std::string encode = "encode a.raw --type int16 -fo a.tag --field-scale " + usual_scale + " --dims " +
                             shape.dims + " --brick " + shape.brick,
                    decode = "decode a.tag -fo b.raw";
  EXPECT_GE(shape.samples * 2, 8 * run_with_smallest(encode) * mebibyte) << "eight times the limit";
  EXPECT_GE(shape.samples * 2, 8 * run_with_smallest(decode) * mebibyte);
  EXPECT_EQ(script("cmp a.raw b.raw").code, 0);
}

INSTANTIATE_TEST_SUITE_P(, MemoryLimitOfShapes,
                         testing::Values(Shape{"tall", "64,64,18000", std::size_t{64} * 64 * 18000, "1"},
                                         Shape{"wide", "2800,2700,15", std::size_t{2800} * 2700 * 15, "1"},
                                         Shape{"flat", "14000,10000,1", std::size_t{14000} * 10000, "2"},
                                         Shape{"narrow", "1,10000,14000", std::size_t{14000} * 10000, "2"}),
                         [](const auto& test) { return test.param.name; });

TEST_F(MemoryLimit, ChangesNoByte) {
  phantom("a.raw", {"--dims", "150,230,100"});
  const std::string volume = " --dims 150,230,100 --type int16 --cube 16 --brick 2";
  works("encode a.raw -o a.tag" + volume);
  const std::size_t limit = run_with_smallest("encode a.raw -fo b.tag -T 2" + volume);
  EXPECT_TRUE(content("b.tag") == content("a.tag"));
  const std::string encode = "cat a.raw | $TAGRID encode - -o c.tag" + volume + option(limit);
  expect_error(script(encode), usage, "--spool DIR");
  expect_ok(script(encode + " --spool ."));
  EXPECT_TRUE(header_and_bricks(content("c.tag")) == header_and_bricks(content("a.tag")));

  run_with_smallest("decode a.tag -fo b.raw -T 2");
  EXPECT_TRUE(content("b.raw") == content("a.raw"));
  const std::string refusal = tagrid({"decode", "a.tag", "-o", "-", "-M", "1"}).err;
  const std::string enough = refusal.substr(refusal.rfind("-M "));
  const std::string decode = "$TAGRID decode a.tag -o - " + enough.substr(0, enough.find('M', 2) + 1);
  expect_error(script(decode + " | cat > d.raw"), usage, "--spool DIR");
  expect_ok(script(decode + " --spool . | cat > d.raw"));
  EXPECT_TRUE(content("d.raw") == content("a.raw"));
  works("verify a.tag --against a.raw --dims 150,230,100 --type int16 -q -M 20M");
}

TEST_F(MemoryLimit, IsKeptByParity) {
  // Small bricks of noise: the file is larger than its samples, and parity takes all that the limit leaves.
  write(noise(std::size_t{16} << 20), "a.raw");
  const std::string encode =
      "encode a.raw --dims 64,64,4096 --type uint8 --range 0:255 --cube 8 --brick 2 --grid derived --parity "
      "5% -fo ";
  works(encode + "a.tag");
  run_with_smallest(encode + "b.tag -T 2");
  EXPECT_TRUE(content("b.tag") == content("a.tag"));
  works("verify a.tag -M 40M --json report.json");
  EXPECT_LE(json_of("report.json")["peak_memory"].get<std::size_t>(), 40 * mebibyte);
  std::string bytes = content("a.tag");
  std::fill_n(bytes.begin() + (1 << 20), 1 << 19, '\0');
  write(bytes, "bad.tag");
  works("repair bad.tag -o good.tag -M 40M -q");
  EXPECT_TRUE(content("good.tag") == content("a.tag"));
  fails("repair bad.tag -o more.tag -M 4M", usage, "give -M ");
}

// What is allocated for each brick must not leave holes in the heap that the next brick cannot use.
TEST_F(MemoryLimit, IsKeptWithManySmallBricks) {
  phantom("a.nrrd", {"--dims", "20000,3,3"});
  run_with_smallest("encode a.nrrd -f -o a.tag --cube 4 --brick 1");
  run_with_smallest("decode a.tag -f -o b.nrrd");
  run_with_smallest("verify a.tag -q");
}

TEST_F(MemoryLimit, IsKeptByNoise) {
  write(noise(std::size_t{70} * 70 * 70 * 2), "a.raw");
  for (const char* more : {"", " --effort best", " --grid-only"}) {
    run_with_smallest("encode a.raw -fo a.tag --dims 70,70,70 --type int16 --field-scale " + usual_scale +
                      more);
    run_with_smallest("decode a.tag -fo b.raw");
  }
}

// Values are wider than the samples that they are made of.
TEST_F(MemoryLimit, IsKeptByValues) {
  write(
      "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 700 500 90\nspace: LPS\n"
      "space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: "
      "raw\nrescale_slope:=0.5\nrescale_intercept:=-9\n\n" +
          noise(std::size_t{700} * 500 * 90),
      "a.nrrd");
  works("encode a.nrrd -qo a.tag --max-error 100 --effort fast --grid derived");
  for (const std::string more : {"", " --region 3:690,:,5:80"})
    for (const std::string decode : {"decode a.tag -fo b.nrrd", "decode a.tag -fo b.nii.gz"})
      EXPECT_LT(smallest(decode + " --samples" + more), run_with_smallest(decode + " --values" + more));
}

TEST_F(MemoryLimit, IsKeptWithOpenVdbFiles) {
  write(noise(std::size_t{800} * 600 * 9), "a.raw");
  works("encode a.raw --dims 800,600,9 --type uint8 -o a.tag");
  // Without -q it would warn that OpenVDB cannot record an unknown spacing.
  run_with_smallest("decode a.tag -q -f -o b.vdb");
  run_with_smallest("decode a.tag -q -f -o b.vdb --spool .");
  run_with_smallest("encode b.vdb -f -o b.tag");
  EXPECT_TRUE(header_and_bricks(content("b.tag")) == header_and_bricks(content("a.tag")));
  run_with_smallest("encode b.vdb -f -o b.tag --spool .");
  run_with_smallest("encode b.vdb -f -o b.tag --resume");
  run_with_smallest("verify b.tag --against b.vdb -q");
}

// What is found before the encoding must fit, too.
TEST_F(MemoryLimit, IsKeptByEstimatesAndBoundsThatFollowFromSamples) {
  write(noise(std::size_t{400} * 200 * 70 * 2), "a.raw");
  const std::string volume = " a.raw -q --dims 400,200,70 --type int16 -f --field-scale " + usual_scale;
  run_with_smallest("estimate --errors 0,100" + volume);
  for (const char* rule :
       {" --max-error noise:0.1", " --max-error noise:0.1 --cube 16 --brick 1", " --psnr 20"})
    run_with_smallest("encode -o a.tag" + volume + rule);
}

// A grid that is derived needs whole layers, with all that encoding keeps for a grid.
TEST_F(MemoryLimit, IsKeptWhereTheGridIsDerived) {
  const std::string samples = noise(std::size_t{250} * 230 * 90 * 2);
  write(samples, "a.raw");
  const std::string raw = " --dims 250,230,90 --type int16";
  for (const char* grid : {"", " --cube 16 --brick 1"}) {
    run_with_smallest("encode a.raw -fo a.tag --grid derived --field-scale " + usual_scale + raw + grid);
    run_with_smallest("decode a.tag -f -o b.raw");
    EXPECT_TRUE(content("b.raw") == samples);
    run_with_smallest("verify a.tag -q");
    run_with_smallest("verify a.tag -q -T 2 --against a.raw" + raw);
    run_with_smallest("mesh a.tag -f -o a.vtu --level 4");
    run_with_smallest("mesh a.tag -f -o a.vtu --coarsen 50000");
    out("info a.tag" + option(smallest("info a.tag")));
  }
}

// What a mesh needs is a layer of bricks, and the program that writes VTKHDF.
TEST_F(MemoryLimit, IsKeptByMeshesOfAnyDepth) {
  std::size_t shallow = 0;
  for (const char* dims : {"120,90,60", "120,90,600"}) {
    phantom("a.nrrd", {"--dims", dims, "-f"});
    works("encode a.nrrd -f -o a.tag --cube 16 --brick 2");
    const std::string mesh = "mesh a.tag -f --level 6 -o ";
    const std::size_t limit = run_with_smallest(mesh + "a.vtu");
    if (shallow == 0) shallow = limit;
    EXPECT_LE(limit, shallow + 1) << dims;
    EXPECT_EQ(run_with_smallest(mesh + "a.msh"), limit);
    const std::size_t with_program = run_with_smallest(mesh + "a.vtkhdf");
    EXPECT_GT(with_program, limit + 95);
    EXPECT_LT(with_program, limit + 102);
    EXPECT_LE(run_with_smallest(mesh + "a.vtu --region 30:50,:40,40:50"), limit);
    run_with_smallest(mesh + "a.vtkhdf --region 30:50,:40,40:50");
  }
}

// Input that can only be read from its beginning goes through a file, for encoding and for comparing.
TEST_F(MemoryLimit, IsKeptWithGzip) {
  phantom("a.raw", {"--dims", "700,700,20"});
  const std::string header =
      "printf 'NRRD0004\\ntype: int16\\ndimension: 3\\nsizes: 700 700 20\\nendian: "
      "little\\nencoding: gzip\\n\\n' > a.nrrd";
  expect_ok(script(header + " && gzip -c a.raw >> a.nrrd && echo a.nrrd > list.tsv"));
  run_with_smallest("encode a.nrrd -fo a.tag --brick 1 --spool .");
  const std::string verify = "verify a.tag --against a.nrrd";
  const std::size_t limit = run_with_smallest(verify + " -q --spool .");
  EXPECT_GT(smallest(verify), limit);
  fails(verify + option(limit), usage, "--spool DIR");
  const std::string convert = "convert --manifest list.tsv --output-dir out -f --brick 1 -M 21M";
  works(convert + " --spool .");
  EXPECT_TRUE(content("out/a.tag") == content("a.tag"));
  EXPECT_EQ(tagrid(words(convert)).code, broken_input);
}

// A limit that is too small for verifying is refused before anything is encoded.
TEST_F(MemoryLimit, ThatEncodingAcceptsIsEnoughToVerifyBeforeTheInputIsRemoved) {
  std::vector<std::string> all = {" --max-error 2", " --max-error 9 --surface-error 2 --mesh-error 20",
                                  " --grid-only --max-error 9 --mesh-error 6"};
  if (std::getenv("TAGRID_LONG") != nullptr) {
    all.push_back(" --max-error 2 --mesh-error 9");
    all.push_back(" --grid-only --max-error 5");
  }
  for (const std::string& bounds : all) {
    SCOPED_TRACE(bounds);
    const auto begin_anew = [&] {
      phantom("a.nrrd", {"--dims", "170,120,9"});
      std::filesystem::remove(path("a.tag"));
    };
    const std::string encode = "encode a.nrrd -fo a.tag --cube 4 --brick 1" + bounds;
    begin_anew();
    const std::size_t limit = smallest(encode + " --rm");
    EXPECT_GT(limit, smallest(encode)) << "verifying takes more here";
    works(encode + " --rm" + option(limit));
    EXPECT_FALSE(std::filesystem::exists(path("a.nrrd")));
    works("verify a.tag -q" + option(limit));

    begin_anew();
    fails(encode + " --rm" + option(limit - 1), usage, "encoding and verifying");
    EXPECT_FALSE(std::filesystem::exists(path("a.tag")));
    works(encode + " --rm --resume" + option(smallest(encode + " --rm --resume")));

    begin_anew();
    std::filesystem::remove_all(path("out"));
    file("list.tsv", "a.nrrd\n");
    const std::string convert = "convert --manifest list.tsv --output-dir out -q --cube 4 --brick 1" + bounds;
    works(convert + option(limit));
    works(convert + option(limit) + " --remove-verified");
    EXPECT_FALSE(std::filesystem::exists(path("a.nrrd")));
  }
}

TEST_F(MemoryLimit, ThatIsNoSizeIsRefused) {
  phantom("a.nrrd");
  for (const std::string size : {"0", "-1", "5X", "1.5", "1.5X", ""})
    expect_error(tagrid({"encode", "a.nrrd", "-M", size}), usage, size.empty() ? "" : size);
}

TEST_F(MemoryLimit, WhereBricksOfATransformAreTooLargeTheSmallerOnesOfTheRefusalAreEnough) {
  works("phantom --dims 300,280,130 -o volume.nrrd -q");
  std::string encode = "encode volume.nrrd -q -fo x.tag --psnr 40 -T 1";
  encode += option(smallest(encode) - 1);
  fails(encode, usage, ", or smaller bricks: --brick 2\n");
  works(encode + " --brick 2");
}

}  // namespace
}  // namespace tagrid
