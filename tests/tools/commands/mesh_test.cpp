// Meshes and the bounds of their errors.
#include <cstring>

#include "tests/support/command_line.h"
#include "tests/support/mesh_field.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

// tagrid mesh.

class MeshCommand : public CommandLine {
 protected:
  /// The number after `name="` in the XML head of a mesh.
  static long number(const std::string& mesh, const std::string& name) {
    const std::size_t at = mesh.find(name + "=\"");
    return at == mesh.npos ? -1 : std::stol(mesh.substr(at + name.size() + 2, 20));
  }
};

TEST_F(MeshCommand, TakesItsNameFromTheInput) {
  make_tag({"--grid-only"});
  expect_ok(tagrid({"mesh", "volume.tag"}));
  const std::string mesh = content("volume.vtu");
  EXPECT_EQ(mesh.find("<?xml"), 0U);
  EXPECT_TRUE(has(mesh, "header_type=\"UInt64\""));
  EXPECT_GT(number(mesh, "NumberOfCells"), 1000);
}

TEST_F(MeshCommand, SameBytesFromPipesAndForAnyThreadCount) {
  make_tag({"--cube", "8", "--brick", "2"});
  expect_ok(tagrid({"mesh", "volume.tag", "-T1", "-o", "one.vtu"}));
  const std::string mesh = content("one.vtu");
  for (const char* threads : {"2", "3", "7"})
    EXPECT_TRUE(tagrid({"mesh", "-", "-T", threads}, content("volume.tag")).out == mesh) << threads;
}

TEST_F(MeshCommand, ALowerLevelHasFewerTetrahedraAndPaddingMore) {
  make_tag();
  const auto cells = [&](const Arguments& options) {
    expect_ok(tagrid(with({"mesh", "volume.tag", "-fo", "x.vtu"}, options)));
    return number(content("x.vtu"), "NumberOfCells");
  };
  const long all = cells({}), some = cells({"--level", "6"}), none = cells({"--level=0"});
  EXPECT_LT(none, some);
  EXPECT_LT(some, all);
  EXPECT_EQ(cells({"--level", "15"}), all);
  EXPECT_GT(cells({"--padded"}), all);
  EXPECT_EQ(cells({"--padded", "--level=0"}), 2 * 2 * 2 * 6) << "six tetrahedra a root cube";
}

TEST_F(MeshCommand, ALargerErrorGivesFewerTetrahedra) {
  make_tag();
  const auto cells = [&](const Arguments& options) {
    expect_ok(tagrid(with({"mesh", "volume.tag", "-fo", "x.vtu"}, options)));
    return number(content("x.vtu"), "NumberOfCells");
  };
  const long some = cells({"--coarsen=20"});
  EXPECT_LT(cells({"--coarsen", "100"}), some);
  EXPECT_GT(cells({"--coarsen", "2"}), some);
  EXPECT_EQ(cells({"--coarsen=1e9"}), cells({"--level=0"}));
  EXPECT_EQ(cells({"--coarsen=1e9", "--padded"}), 2 * 2 * 2 * 6);
}

TEST_F(MeshCommand, ACoarsenedMeshIsTheSameFromPipesAndForAnyThreadsAndMemory) {
  make_tag({"--cube", "8", "--brick", "2"});
  expect_ok(tagrid({"mesh", "volume.tag", "--coarsen=20", "-T1", "-o", "one.vtu"}));
  const std::string mesh = content("one.vtu");
  for (const char* threads : {"2", "7"})
    EXPECT_TRUE(tagrid({"mesh", "-", "--coarsen=20", "-T", threads}, content("volume.tag")).out == mesh)
        << threads;
  EXPECT_TRUE(tagrid({"mesh", "-", "--coarsen=20", "-M40M"}, content("volume.tag")).out == mesh);
  expect_error(tagrid({"mesh", "volume.tag", "--coarsen=20", "-M", "1M"}), usage, "-M");
}

TEST_F(MeshCommand, AnErrorIsInUnitsOfValues) {
  phantom("plain.nrrd");
  std::string nrrd = content("plain.nrrd");
  nrrd.insert(nrrd.find("\n\n") + 1, "rescale_slope:=0.25\nrescale_intercept:=-7\n");
  file("scaled.nrrd", nrrd);
  for (const char* name : {"plain", "scaled"})
    expect_ok(tagrid({"encode", std::string(name) + ".nrrd", "-qo", std::string(name) + ".tag"}));
  expect_ok(tagrid({"mesh", "plain.tag", "--coarsen=20"}));
  expect_ok(tagrid({"mesh", "scaled.tag", "--coarsen=5", "-q"}));
  // The other one has the values in their units, too.
  for (const char* count : {"NumberOfPoints", "NumberOfCells"})
    EXPECT_EQ(number(content("plain.vtu"), count), number(content("scaled.vtu"), count));
}

TEST_F(MeshCommand, AnErrorThatMakesNoSenseIsRefused) {
  make_tag();
  expect_error(tagrid({"mesh", "volume.tag", "--coarsen=5", "--level=6"}), usage, "--level");
  expect_error(tagrid({"mesh", "volume.tag", "--coarsen=-1"}), usage, "--coarsen -1 must be at least 0");
  for (const char* error : {"nan", "inf", "x"})
    expect_error(tagrid({"mesh", "volume.tag", "--coarsen", error}), usage, "--coarsen");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.tag"}));
}

TEST_F(MeshCommand, ARegionHasFewerTetrahedraAndIsTheSameFromAPipe) {
  make_tag({"--cube", "8", "--brick", "2"});
  expect_ok(tagrid({"mesh", "volume.tag"}));
  for (const Arguments& more : {Arguments{}, {"--level", "5"}, {"--padded"}, {"--coarsen", "20"}}) {
    const Arguments options = with({"--region", "3:9,:,20:"}, more);
    expect_ok(tagrid(with({"mesh", "volume.tag", "-fo", "x.vtu"}, options)));
    const std::string mesh = content("x.vtu");
    EXPECT_LT(number(mesh, "NumberOfCells"), number(content("volume.vtu"), "NumberOfCells"));
    EXPECT_GT(number(mesh, "NumberOfCells"), 0);
    EXPECT_TRUE(tagrid(with({"mesh", "-", "-o", "-"}, options), content("volume.tag")).out == mesh);
  }
  expect_ok(tagrid({"mesh", "volume.tag", "-fo", "x.vtu", "--region=:,:,:"}));
  EXPECT_TRUE(content("x.vtu") == content("volume.vtu"));
}

TEST_F(MeshCommand, EveryFormatHasTheSameFigures) {
  make_tag({"--cube", "8"});
  const auto figures = [&](const std::string& name) {
    expect_ok(tagrid({"mesh", "volume.tag", "-T2", "-fo", name, "--json=x.json"}));
    const auto json = json_of("x.json");
    std::filesystem::remove(path("x.json"));
    EXPECT_EQ(json["bytes_out"], std::filesystem::file_size(path(name)));
    return std::pair(json["settings"]["points"], json["settings"]["tetrahedra"]);
  };
  const auto expected = figures("a.vtu");
  for (const char* name : {"a.vtkhdf", "a.hdf", "a.msh"}) EXPECT_EQ(figures(name), expected) << name;
}

TEST_F(MeshCommand, ReportsItsFigures) {
  make_tag();
  expect_ok(tagrid({"mesh", "volume.tag", "--json", "x.json"}));
  const auto json = json_of("x.json");
  EXPECT_EQ(json["command"], "mesh");
  EXPECT_EQ(json["bytes_out"], content("volume.vtu").size());
  EXPECT_EQ(json["settings"]["tetrahedra"], number(content("volume.vtu"), "NumberOfCells"));
  EXPECT_EQ(json["settings"]["points"], number(content("volume.vtu"), "NumberOfPoints"));
  EXPECT_FALSE(json["settings"].contains("coarsen"));
  expect_ok(tagrid({"mesh", "volume.tag", "--coarsen=20", "-f", "--json", "x.json"}));
  EXPECT_EQ(json_of("x.json")["settings"]["coarsen"], 20);
}

TEST_F(MeshCommand, WrongRequestsAreRefused) {
  make_tag();
  for (const char* level : {"-1", "16", "x"})
    expect_error(tagrid({"mesh", "volume.tag", "--level", level}), usage, "--level");
  expect_error(tagrid({"mesh", "volume.tag", "-o", "x.stl"}), usage, "use tagrid surface --iso V");
  for (const char* region : {"0:999,:,:", "-1:2,:,:", "3:3,:,:", "5:4,:,:", ":,:", "x", "1:2,3:4,5:6,7:8"})
    for (const Arguments& more : {Arguments{}, {"--padded"}})
      expect_error(
          tagrid(with({"mesh", "volume.tag", "-o", "x.msh", std::string("--region=") + region}, more)), usage,
          "");
  expect_error(tagrid({"mesh", "volume.tag", "--region", ":,:,:5"}), usage, "needs -o FILE");
  expect_error(tagrid({"mesh"}), usage, "INPUT is required");
  expect_error(tagrid({"mesh", "missing.tag"}), world, "missing.tag");
  expect_error(tagrid({"mesh", "volume.nrrd", "-o", "x.vtu"}), broken_input, "not a .tag file");
  expect_error(tagrid({"mesh", "volume.tag", "-o", "no/x.vtu"}), world, "no/x.vtu");
  expect_error(tagrid({"mesh", "volume.tag", "-o", "/dev/full"}), usage, ".vtu");
  file("volume.vtu", "precious");
  expect_error(tagrid({"mesh", "volume.tag"}), usage, "volume.vtu: already exists");
  EXPECT_EQ(content("volume.vtu"), "precious");
  expect_ok(script("cp volume.tag same.vtu"));
  expect_error(tagrid({"mesh", "same.vtu", "-f"}), usage, "is the input itself");
  EXPECT_EQ(names(), (std::vector<std::string>{"same.vtu", "volume.nrrd", "volume.tag", "volume.vtu"}));
}

TEST_F(MeshCommand, ADamagedFileLeavesNoMesh) {
  make_tag({"--cube", "8", "--brick", "1"});
  std::string bytes = content("volume.tag");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  file("bad.tag", bytes);
  expect_error(tagrid({"mesh", "bad.tag"}), broken_input, "bad.tag: ");
  expect_error(tagrid({"mesh", "bad.tag", "--coarsen=5"}), broken_input, "bad.tag: ");
  EXPECT_EQ(names(), (std::vector<std::string>{"bad.tag", "volume.nrrd", "volume.tag"}));
}

// --mesh-error on the command line: refusals, and the error of the written mesh.

class MeshErrorCommand : public CommandLine {
 protected:
  MeshErrorCommand() { phantom("volume.raw"); }

  Ending encode(const Arguments& options) const {
    return tagrid(with(with({"encode", "volume.raw", "-f", "--cube", "8", "--brick", "2"}, raw_), options));
  }

  // The largest error of the written mesh, found by searching for every sample in its tetrahedra.
  double error_of_mesh() const {
    expect_ok(tagrid({"mesh", "volume.tag", "-f"}));
    Vtu vtu(path("volume.vtu"));
    const LatticeMesh mesh = read_lattice_mesh(vtu);
    const std::vector<std::int16_t> values = vtu.array<std::int16_t>("Int16", "value");
    const std::string bytes = content("volume.raw");
    std::vector<std::int16_t> samples(bytes.size() / 2);
    std::memcpy(samples.data(), bytes.data(), bytes.size());
    const Box box = Box::of_size({52, 40, 36});
    std::int64_t disagree = 0;
    const std::vector<Fraction> field = field_of_mesh(mesh, values, box, disagree);
    EXPECT_EQ(disagree, 0);
    double worst = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      EXPECT_GT(field[i].whole, 0) << "a sample is in no tetrahedron";
      const std::int64_t difference = std::abs(field[i].sum - field[i].whole * samples[i]);
      worst = std::max(worst, static_cast<double>(difference) / static_cast<double>(field[i].whole));
    }
    return worst;
  }

  void expect_promise(const Arguments& options, double bound) const {
    SCOPED_TRACE(testing::PrintToString(options));
    expect_ok(encode(with(options, {"--json", "run.json"})));
    const double found = error_of_mesh();
    EXPECT_LE(found, bound);
    EXPECT_EQ(json_of("run.json")["achieved"]["mesh_error"].get<double>(), found);
    const auto info = nlohmann::json::parse(tagrid({"info", "volume.tag", "--json"}).out);
    EXPECT_EQ(info["achieved"]["mesh_error"].get<double>(), found);
    EXPECT_EQ(info["mesh_error"].get<double>(), bound);
    EXPECT_EQ(tagrid(with({"verify", "volume.tag", "--against", "volume.raw"}, raw_)).code, 0);
    EXPECT_EQ(std::remove(path("run.json").c_str()), 0);
  }
};

TEST_F(MeshErrorCommand, TheMeshIsWithinItsBoundWhateverElseIsAsked) {
  expect_promise({"--mesh-error", "5"}, 5);
  expect_promise({"--max-error", "2", "--mesh-error", "5"}, 5);
  expect_promise({"--surface-error", "1", "--max-error", "8", "--mesh-error", "4"}, 4);
  expect_promise({"--grid-only", "--max-error", "4", "--mesh-error", "3"}, 3);
  expect_promise({"--grid-only", "--mesh-error", "30"}, 30);
  expect_promise({"--max-error", "9", "--mesh-error", "40", "--effort", "best"}, 40);
}

TEST_F(MeshErrorCommand, ABoundBelowThatOfTheValuesIsRefusedAndTheAdviceWorks) {
  const Ending refused = encode({"--max-error", "10", "--mesh-error", "3"});
  expect_error(refused, usage, "--mesh-error 3 cannot be kept with --max-error 10");
  EXPECT_TRUE(
      has(refused.err, "--mesh-error 10 or more, or --max-error 3 or less, or add --surface-error 3"));
  EXPECT_EQ(names(), std::vector<std::string>{"volume.raw"});
  expect_promise({"--max-error", "10", "--mesh-error", "10"}, 10);
  expect_promise({"--max-error", "3", "--mesh-error", "3"}, 3);
  expect_promise({"--max-error", "10", "--mesh-error", "3", "--surface-error", "3"}, 3);
}

TEST_F(MeshErrorCommand, WithoutABoundNothingIsRecorded) {
  for (const Arguments& options : {Arguments{"--max-error", "5"}, {"--grid-only", "--max-error", "5"}}) {
    expect_ok(encode(options));
    const auto info = nlohmann::json::parse(tagrid({"info", "volume.tag", "--json"}).out);
    EXPECT_TRUE(info["achieved"]["mesh_error"].is_null());
    EXPECT_TRUE(info["mesh_error"].is_null());
  }
}

// A part that is encoded separately needs values of the bricks around it.
TEST_F(MeshErrorCommand, TheRecordIsTheSameInPartsInStripsAndForAnyThreads) {
  const Arguments options = {"--max-error", "6", "--mesh-error", "30", "--brick", "1"};
  const auto file_of = [&](const Arguments& more) {
    const Ending ending =
        tagrid(with(with(with({"encode", "volume.raw", "-f", "--cube", "8"}, raw_), options), more));
    EXPECT_EQ(ending.code, 0) << ending.err;
    return content("volume.tag");
  };
  const std::string file = file_of({"-T1"});
  for (const Arguments& more :
       {Arguments{"-T5"}, {"--resume"}, {"--resume", "-T", "3"}, {"-M", "14M", "-T1"}})
    EXPECT_TRUE(file_of(more) == file) << testing::PrintToString(more);
}

TEST_F(MeshErrorCommand, ACutMeshOfTheVolumeIsExactlyAsLargeAsTheVolume) {
  for (const Arguments& options : {Arguments{"--max-error", "4"}, {"--grid-only"}}) {
    expect_ok(encode(options));
    for (const char* level : {"0", "5", "9"}) {
      expect_ok(tagrid({"mesh", "volume.tag", "-f", "--level", level}));
      Vtu vtu(path("volume.vtu"));
      const Index3 last{51, 39, 35};
      const LatticeMesh mesh = read_lattice_mesh(vtu);
      const MeshFindings found = check_mesh(
          mesh, [](const auto&) {}, Box::of_size({52, 40, 36}));
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_EQ(found.six_volumes, 6 * last.x * last.y * last.z);
    }
  }
}

}  // namespace
}  // namespace tagrid
