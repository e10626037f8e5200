// tagrid surface.

#include "tests/support/command_line.h"
#include "tests/support/ply_reader.h"

namespace tagrid {
namespace {

class SurfaceCommand : public CommandLine {};

TEST_F(SurfaceCommand, TakesItsNameFromTheInput) {
  make_tag({"--grid-only"});
  expect_ok(tagrid({"surface", "volume.tag", "--iso", "40"}));
  EXPECT_GT(read_ply(content("volume.ply")).triangles.size(), 100U);
}

TEST_F(SurfaceCommand, SameBytesFromPipesAndForAnyThreadCount) {
  make_tag({"--cube", "8", "--brick", "2"});
  for (const Arguments& options : {Arguments{}, {"--region", "3:20,:,5:"}, {"--close"}}) {
    expect_ok(tagrid(with({"surface", "volume.tag", "--iso=40.5", "-T1", "-fo", "one.ply"}, options)));
    const std::string surface = content("one.ply");
    EXPECT_GT(read_ply(surface).triangles.size(), 50U);
    for (const char* threads : {"2", "7"})
      EXPECT_TRUE(tagrid(with({"surface", "-", "--iso=40.5", "-o", "-", "-T", threads}, options),
                         content("volume.tag"))
                      .out == surface)
          << threads;
  }
}

TEST_F(SurfaceCommand, WritesEveryFormatUnderALimitOnMemory) {
  make_tag({"--cube", "8", "--brick", "2"});
  for (const char* name : {"x.ply", "x.stl", "x.obj", "x.vtp"})
    expect_ok(tagrid({"surface", "volume.tag", "--iso", "40", "-o", name, "-M", "64M"}));
  expect_error(tagrid({"surface", "volume.tag", "--iso", "40", "-o", "y.ply", "-M", "1M"}), usage, "-M");
  EXPECT_EQ(names(),
            (std::vector<std::string>{"volume.nrrd", "volume.tag", "x.obj", "x.ply", "x.stl", "x.vtp"}));
}

TEST_F(SurfaceCommand, ReportsItsFigures) {
  make_tag();
  expect_ok(tagrid({"surface", "volume.tag", "--iso", "40", "--json", "x.json"}));
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
  expect_ok(
      tagrid({"surface", "volume.tag", "--iso", "40", "-fo", "a.ply", "--json=x.json", "--region=:,:,3:9"}));
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
         "NRRD0004\ntype: int16\ndimension: 3\nspace dimension: 3\nsizes: 52 40 36\nendian: "
         "little\nspace "
         "directions: "
         "(0.5,0,0) (0,0.5,0) (0,0,0.5)\nspace origin: " +
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
  expect_ok(tagrid({"encode", "mask.nrrd"}));
  const auto result = tagrid({"surface", "mask.tag", "--iso", "0.5"});
  EXPECT_EQ(result.code, 0);
  EXPECT_TRUE(has(result.err, "--range auto"));
  expect_ok(tagrid({"encode", "mask.nrrd", "-f", "--range", "auto"}));
  expect_ok(tagrid({"surface", "mask.tag", "--iso", "0.5", "-f", "--json", "x.json"}));
  EXPECT_NEAR(json_of("x.json")["settings"]["area"].get<double>(), 600, 60);
}

TEST_F(SurfaceCommand, WrongRequestsAreRefused) {
  make_tag();
  for (const char* level : {"-1", "16", "x"})
    expect_error(tagrid({"surface", "volume.tag", "--iso=1", "--level", level}), usage, "--level");
  for (const char* iso : {"nan", "inf", "x", "1e999"})
    expect_error(tagrid({"surface", "volume.tag", "--iso", iso}), usage, "--iso");
  expect_error(tagrid({"surface", "volume.tag"}), usage, "--iso is required");
  expect_error(tagrid({"surface", "volume.tag", "--iso=1", "-o", "x.vtu"}), usage, "use tagrid mesh");
  expect_error(tagrid({"surface", "volume.tag", "--iso=1", "--region", ":,:,:5"}), usage, "needs -o FILE");
  expect_error(tagrid({"surface", "volume.tag", "--iso=1", "-o", "x.ply", "--region", "0:999,:,:"}), usage,
               "volume");
  expect_error(tagrid({"surface", "missing.tag", "--iso=1"}), world, "missing.tag");
  expect_error(tagrid({"surface", "volume.nrrd", "--iso=1", "-o", "x.ply"}), broken_input, "not a .tag file");
  expect_error(tagrid({"surface", "volume.tag", "--iso=1", "-o", "no/x.ply"}), world, "no/x.ply");
  file("volume.ply", "precious");
  expect_error(tagrid({"surface", "volume.tag", "--iso=1"}), usage, "volume.ply: already exists");
  EXPECT_EQ(content("volume.ply"), "precious");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.ply", "volume.tag"}));
}

}  // namespace
}  // namespace tagrid
