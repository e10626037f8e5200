// Meshes and the bounds of their errors.
#include "tests/support/command_line.h"
#include "tests/support/ply_reader.h"

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

TEST_F(MeshCommand, APipeGivesTheBytesOfTheFile) {
  make_tag({"--cube", "8", "--brick", "2"});
  for (const char* options :
       {"-T3 --padded", "--level 5", "--coarsen=20 -T2 -M40M", "--region=3:9,:,20: --coarsen 20"}) {
    works(std::string("mesh volume.tag -fo x.vtu ") + options);
    EXPECT_GT(number(content("x.vtu"), "NumberOfCells"), 0);
    EXPECT_TRUE(tagrid(words(std::string("mesh - -o - ") + options), content("volume.tag")).out ==
                content("x.vtu"))
        << options;
  }
}

TEST_F(MeshCommand, AnErrorIsInUnitsOfValues) {
  phantom("plain.nrrd");
  std::string nrrd = content("plain.nrrd");
  nrrd.insert(nrrd.find("\n\n") + 1, "rescale_slope:=0.25\nrescale_intercept:=-7\n");
  file("scaled.nrrd", nrrd);
  for (const char* name : {"plain", "scaled"})
    expect_ok(tagrid({"encode", std::string(name) + ".nrrd", "-qo", std::string(name) + ".tag"}));
  works("mesh plain.tag --coarsen=20");
  works("mesh scaled.tag --coarsen=5 -q");
  // The other one has the values in their units, too.
  for (const char* count : {"NumberOfPoints", "NumberOfCells"})
    EXPECT_EQ(number(content("plain.vtu"), count), number(content("scaled.vtu"), count));
}

TEST_F(MeshCommand, TakesItsNameFromTheInputAndEveryFormatHasTheSameFigures) {
  make_tag();
  works("mesh volume.tag --json x.json");
  const auto json = json_of("x.json");
  EXPECT_EQ(json["command"], "mesh");
  EXPECT_EQ(json["settings"]["tetrahedra"], number(content("volume.vtu"), "NumberOfCells"));
  EXPECT_EQ(json["settings"]["points"], number(content("volume.vtu"), "NumberOfPoints"));
  EXPECT_FALSE(json["settings"].contains("coarsen"));
  for (const std::string name : {"volume.vtu", "a.vtkhdf", "a.hdf", "a.msh"}) {
    works("mesh volume.tag -fo " + name + " --json y.json");
    EXPECT_EQ(json_of("y.json")["settings"], json["settings"]) << name;
    EXPECT_EQ(json_of("y.json")["bytes_out"], std::filesystem::file_size(path(name)));
  }
  works("mesh volume.tag --level=0 --padded -f --json x.json");
  EXPECT_EQ(json_of("x.json")["settings"]["tetrahedra"], 2 * 2 * 2 * 6) << "six a root cube";
  works("mesh volume.tag --coarsen=20 -f --json x.json");
  EXPECT_EQ(json_of("x.json")["settings"]["coarsen"], 20);
}

TEST_F(MeshCommand, WrongRequestsAreRefused) {
  make_tag();
  for (const char* region : {"0:999,:,:", "-1:2,:,:", "3:3,:,:", "5:4,:,:", ":,:", "x", "1:2,3:4,5:6,7:8"})
    fails(std::string("mesh volume.tag -o x.msh --region=") + region, usage, "");
  for (const char* level : {"-1", "16", "x"})
    fails(std::string("mesh volume.tag --level=") + level, usage, "--level");
  for (const char* error : {"nan", "inf", "x"})
    fails(std::string("mesh volume.tag --coarsen=") + error, usage, "--coarsen");
  fails("mesh volume.tag --coarsen=-1", usage, "--coarsen -1 must be at least 0");
  fails("mesh volume.tag --coarsen=5 --level=6", usage, "--level");
  fails("mesh volume.tag --coarsen=20 -M 1M", usage, "-M");
  fails("mesh volume.tag -o x.stl", usage, "use tagrid surface --iso V");
  fails("mesh volume.tag --region :,:,:5", usage, "needs -o FILE");
  fails("mesh", usage, "INPUT is required");
  fails("mesh missing.tag", world, "missing.tag");
  fails("mesh volume.nrrd -o x.vtu", broken_input, "not a .tag file");
  fails("mesh volume.tag -o no/x.vtu", world, "no/x.vtu");
  fails("mesh volume.tag -o /dev/full", usage, ".vtu");
  file("volume.vtu", "precious");
  fails("mesh volume.tag", usage, "volume.vtu: already exists");
  EXPECT_EQ(content("volume.vtu"), "precious");
  expect_ok(script("cp volume.tag same.vtu"));
  fails("mesh same.vtu -f", usage, "is the input itself");
  EXPECT_EQ(names(), (std::vector<std::string>{"same.vtu", "volume.nrrd", "volume.tag", "volume.vtu"}));
}

// --mesh-error.

TEST_F(MeshCommand, ABoundOfTheMeshIsRecordedAndOneThatCannotBeKeptIsRefusedWithAdviceThatWorks) {
  phantom("volume.nrrd");
  const std::string encode = "encode volume.nrrd -f --cube 8 --json run.json ";
  works(encode + "--max-error 5");
  EXPECT_TRUE(info("volume.tag")["mesh_error"].is_null());
  EXPECT_TRUE(info("volume.tag")["achieved"]["mesh_error"].is_null());
  const Ending refused = tagrid(words(encode + "--max-error 10 --mesh-error 3"));
  expect_error(refused, usage, "--mesh-error 3 cannot be kept with --max-error 10");
  EXPECT_TRUE(
      has(refused.err, "--mesh-error 10 or more, or --max-error 3 or less, or add --surface-error 3"));
  for (const std::string options : {"--max-error 10 --mesh-error 10", "--max-error 3 --mesh-error 3",
                                    "--max-error 10 --surface-error 3 --mesh-error 3"}) {
    works(encode + options);
    const nlohmann::json file = info("volume.tag"), reached = file["achieved"]["mesh_error"];
    EXPECT_EQ(file["mesh_error"], std::stoi(words(options).back()));
    EXPECT_LE(reached, file["mesh_error"]);
    EXPECT_GT(reached, 0);
    EXPECT_EQ(json_of("run.json")["achieved"]["mesh_error"], reached);
    works("verify volume.tag -q --against volume.nrrd");
  }
}

// tagrid surface.

class SurfaceCommand : public CommandLine {};

TEST_F(SurfaceCommand, SameBytesFromPipesAndForAnyThreadCount) {
  make_tag({"--cube", "8", "--brick", "2"});
  for (const std::string options : {"--iso=40.5 --region 3:20,:,5:", "--iso=40.5 --close"}) {
    works("surface volume.tag -T1 -fo one.ply " + options);
    const std::string surface = content("one.ply");
    EXPECT_GT(read_ply(surface).triangles.size(), 50U);
    EXPECT_TRUE(tagrid(words("surface - -o - -T7 " + options), content("volume.tag")).out == surface);
  }
}

TEST_F(SurfaceCommand, WritesEveryFormatUnderALimitOnMemory) {
  make_tag({"--cube", "8", "--brick", "2"});
  for (const char* name : {"x.ply", "x.stl", "x.obj", "x.vtp"})
    works(std::string("surface volume.tag --iso 40 -M 64M -o ") + name);
  fails("surface volume.tag --iso 40 -o y.ply -M 1M", usage, "-M");
  EXPECT_EQ(names(),
            (std::vector<std::string>{"volume.nrrd", "volume.tag", "x.obj", "x.ply", "x.stl", "x.vtp"}));
}

TEST_F(SurfaceCommand, ReportsItsFigures) {
  make_tag();
  works("surface volume.tag --iso 40 --json x.json");
  auto json = json_of("x.json");
  const PlySurface surface = read_ply(content("volume.ply"));
  const SurfaceFindings found = check_surface(surface.vertices.size(), surface.triangles);
  EXPECT_EQ(json["command"], "surface");
  EXPECT_EQ(json["bytes_out"], content("volume.ply").size());
  EXPECT_EQ(json["settings"]["iso"], 40);
  EXPECT_EQ(json["settings"]["vertices"], surface.vertices.size());
  EXPECT_EQ(json["settings"]["triangles"], surface.triangles.size());
  EXPECT_EQ(json["settings"]["boundary_edges"], found.border_edges);
  EXPECT_GT(json["settings"]["area"], 0);
  works("surface volume.tag --iso 40 -fo a.ply --json=x.json --region=:,:,3:9");
  json = json_of("x.json");
  EXPECT_TRUE(json["settings"]["boundary_edges"].is_null());
}

/// The triangles without area of a binary STL file.
int flat_triangles(const std::string& stl) {
  int flat = 0;
  for (std::size_t at = 84; at + 50 <= stl.size(); at += 50) {
    std::array<std::array<float, 3>, 3> corners;
    std::memcpy(corners.data(), stl.data() + at + 12, sizeof corners);
    flat += corners[0] == corners[1] || corners[1] == corners[2] || corners[0] == corners[2];
  }
  return flat;
}

// A stage at 2.5 m with steps of 0.5 um.
TEST_F(SurfaceCommand, FarFromTheOriginStlSaysWhatItsNumbersLoseAndTheAdviceHelps) {
  phantom("plain.nrrd");
  const std::string samples = samples_of(content("plain.nrrd"));
  for (const auto& [name, origin] :
       {std::pair("near", "(0,0,0)"), {"far", "(2500000.3,2500000.3,2500000.3)"}}) {
    file(name + std::string(".nrrd"),
         "NRRD0004\ntype: int16\ndimension: 3\nspace dimension: 3\nsizes: 52 40 36\nendian: little\n"
         "space directions: (0.5,0,0) (0,0.5,0) (0,0,0.5)\nspace origin: " +
             std::string(origin) + "\nencoding: raw\n\n" + samples);
    expect_ok(tagrid({"encode", name + std::string(".nrrd")}));
  }
  const auto surface = [&](const std::string& tag, const std::string& output) {
    return tagrid({"surface", tag, "--iso", "40.5", "-fo", output});
  };
  expect_ok(surface("near.tag", "near.stl"));
  const Ending far = surface("far.tag", "far.stl");
  EXPECT_EQ(far.code, 0);
  EXPECT_TRUE(has(far.err, "far.stl: STL has 32-bit numbers"));
  EXPECT_TRUE(has(far.err, "where samples are 0.5 apart"));
  EXPECT_GT(flat_triangles(content("far.stl")), flat_triangles(content("near.stl")));
  // The other formats, which it names, move nothing.
  for (const char* format : {".ply", ".vtp", ".obj"})
    expect_ok(surface("far.tag", std::string("far") + format));
  expect_ok(surface("near.tag", "near.ply"));
  const PlySurface here = read_ply(content("near.ply")), there = read_ply(content("far.ply"));
  ASSERT_EQ(here.vertices.size(), there.vertices.size());
  for (std::size_t i = 0; i < here.vertices.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(there.vertices[i][axis] - here.vertices[i][axis], 2500000.3, 1e-8);
  const std::string obj = content("far.obj"), first = obj.substr(obj.find("v ") + 2);
  EXPECT_EQ(std::stod(first), there.vertices[0][0]);
  // A volume of NIfTI has its place in 32 bits, too.
  const Ending nifti = tagrid({"decode", "far.tag", "-fo", "far.nii"});
  EXPECT_TRUE(has(nifti.err, "32-bit numbers"));
}

TEST_F(SurfaceCommand, AnEmptySurfaceIsWrittenAndSaid) {
  make_tag();
  const auto result = tagrid({"surface", "volume.tag", "--iso", "30000"});
  EXPECT_EQ(result.code, 0);
  EXPECT_TRUE(has(result.err, "the surface is empty"));
  EXPECT_TRUE(read_ply(content("volume.ply")).vertices.empty());
}

TEST_F(SurfaceCommand, ThatTheGridTookNoNoticeOfAMaskIsSaidAndTheAdviceHelps) {
  std::string samples(std::size_t{30 * 30 * 30}, '\0');
  for (std::size_t z = 10; z < 20; ++z)
    for (std::size_t y = 10; y < 20; ++y)
      for (std::size_t x = 10; x < 20; ++x) samples[(z * 30 + y) * 30 + x] = 1;
  file("mask.nrrd", "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 30 30 30\nencoding: raw\n\n" + samples);
  works("encode mask.nrrd");
  const auto result = tagrid({"surface", "mask.tag", "--iso", "0.5"});
  EXPECT_EQ(result.code, 0);
  EXPECT_TRUE(has(result.err, "--range auto"));
  works("encode mask.nrrd -f --range auto");
  works("surface mask.tag --iso 0.5 -f --json x.json");
  EXPECT_NEAR(json_of("x.json")["settings"]["area"].get<double>(), 600, 60);
}

TEST_F(SurfaceCommand, WrongRequestsAreRefused) {
  make_tag();
  for (const char* level : {"-1", "16", "x"})
    fails(std::string("surface volume.tag --iso=1 --level=") + level, usage, "--level");
  for (const char* iso : {"nan", "inf", "x", "1e999"})
    fails(std::string("surface volume.tag --iso=") + iso, usage, "--iso");
  fails("surface volume.tag", usage, "--iso is required");
  fails("surface volume.tag --iso=1 -o x.vtu", usage, "use tagrid mesh");
  fails("surface volume.tag --iso=1 --region :,:,:5", usage, "needs -o FILE");
  fails("surface volume.tag --iso=1 -o x.ply --region 0:999,:,:", usage, "volume");
  fails("surface missing.tag --iso=1", world, "missing.tag");
  fails("surface volume.nrrd --iso=1 -o x.ply", broken_input, "not a .tag file");
  fails("surface volume.tag --iso=1 -o no/x.ply", world, "no/x.ply");
  file("volume.ply", "precious");
  fails("surface volume.tag --iso=1", usage, "volume.ply: already exists");
  EXPECT_EQ(content("volume.ply"), "precious");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.ply", "volume.tag"}));
}

}  // namespace
}  // namespace tagrid
