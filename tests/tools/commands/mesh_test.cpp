// Meshes and the bounds of their errors.
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

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

TEST_F(MeshCommand, APipeGivesTheBytesOfTheFile) {
  make_tag({"--cube", "8", "--brick", "2"});
  for (const Arguments& options : {Arguments{"-T3"},
                                   {"--level", "5"},
                                   {"--padded"},
                                   {"--coarsen=20", "-T2"},
                                   {"--coarsen=20", "-M40M"},
                                   {"--region", "3:9,:,20:", "--level", "5"},
                                   {"--region=3:9,:,20:", "--coarsen", "20"}}) {
    expect_ok(tagrid(with({"mesh", "volume.tag", "-fo", "x.vtu"}, options)));
    EXPECT_GT(number(content("x.vtu"), "NumberOfCells"), 0);
    EXPECT_TRUE(tagrid(with({"mesh", "-", "-o", "-"}, options), content("volume.tag")).out ==
                content("x.vtu"))
        << options[0];
  }
  expect_error(tagrid({"mesh", "volume.tag", "--coarsen=20", "-M", "1M"}), usage, "-M");
}

TEST_F(MeshCommand, OptionsSayHowFineAndHowLargeTheMeshIs) {
  make_tag();
  const auto cells = [&](const Arguments& options) {
    expect_ok(tagrid(with({"mesh", "volume.tag", "-fo", "x.vtu"}, options)));
    return number(content("x.vtu"), "NumberOfCells");
  };
  const long all = cells({}), some = cells({"--level", "6"});
  EXPECT_LT(some, all);
  for (const char* whole : {"--level=15", "--region=:,:,:"}) EXPECT_EQ(cells({whole}), all);
  EXPECT_GT(cells({"--padded"}), all);
  for (const char* coarse : {"--level=0", "--coarsen=1e9"}) {
    EXPECT_LT(cells({coarse}), some);
    EXPECT_EQ(cells({coarse, "--padded"}), 2 * 2 * 2 * 6) << "six tetrahedra a root cube";
  }
  const long coarsened = cells({"--coarsen=20"});
  EXPECT_LT(cells({"--coarsen", "100"}), coarsened);
  EXPECT_GT(cells({"--coarsen", "2"}), coarsened);
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

// --mesh-error.

TEST_F(MeshCommand, ABoundOfTheMeshIsRecordedAndOneThatCannotBeKeptIsRefusedWithAdviceThatWorks) {
  phantom("volume.nrrd");
  const auto encode = [&](const Arguments& options) {
    return tagrid(with({"encode", "volume.nrrd", "-f", "--cube", "8", "--json", "run.json"}, options));
  };
  const auto info = [&] { return nlohmann::json::parse(tagrid({"info", "volume.tag", "--json"}).out); };
  expect_ok(encode({"--max-error", "5"}));
  EXPECT_TRUE(info()["mesh_error"].is_null() && info()["achieved"]["mesh_error"].is_null());
  const Ending refused = encode({"--max-error", "10", "--mesh-error", "3"});
  expect_error(refused, usage, "--mesh-error 3 cannot be kept with --max-error 10");
  EXPECT_TRUE(
      has(refused.err, "--mesh-error 10 or more, or --max-error 3 or less, or add --surface-error 3"));
  for (const Arguments& options : {Arguments{"--max-error", "10", "--mesh-error", "10"},
                                   {"--max-error", "3", "--mesh-error", "3"},
                                   {"--max-error", "10", "--surface-error", "3", "--mesh-error", "3"},
                                   {"--grid-only", "--mesh-error", "30"}}) {
    expect_ok(encode(options));
    const nlohmann::json file = info(), reached = file["achieved"]["mesh_error"];
    EXPECT_EQ(file["mesh_error"], std::stoi(options.back()));
    EXPECT_LE(reached, file["mesh_error"]);
    EXPECT_GT(reached, 0);
    EXPECT_EQ(json_of("run.json")["achieved"]["mesh_error"], reached);
    expect_ok(tagrid({"verify", "volume.tag", "-q", "--against", "volume.nrrd"}));
  }
  // Separate parts and strips need values of the bricks around them.
  const Arguments small = {"--max-error", "6", "--mesh-error", "30", "--brick", "1"};
  expect_ok(encode(with(small, {"-T1"})));
  const std::string file = content("volume.tag");
  for (const Arguments& more : {Arguments{"-T5"}, {"--resume", "-T3"}, {"-M", "14M", "-T1"}}) {
    expect_ok(encode(with(small, more)));
    EXPECT_TRUE(content("volume.tag") == file) << more[0];
  }
}

}  // namespace
}  // namespace tagrid
