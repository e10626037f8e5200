// --mesh-error on the command line: refusals, and the error of the written mesh.

#include <cstring>

#include "tests/support/command_line.h"
#include "tests/support/mesh_field.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

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
  EXPECT_NE(refused.err.find("--mesh-error 10 or more, or --max-error 3 or less, or add --surface-error 3"),
            std::string::npos)
      << refused.err;
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
          mesh, [](const auto&) {}, last);
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_EQ(found.six_volumes, 6 * last.x * last.y * last.z);
    }
  }
}

}  // namespace
}  // namespace tagrid
