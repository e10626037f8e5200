// The surface through callbacks: the same as that of the program, whole or in part.
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/ply_reader.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct TakenSurface {
  std::vector<double> points;
  std::vector<std::array<std::int64_t, 3>> triangles;
  int calls = 0, fails_at = -1;
  bool came_too_late = false;

  tagrid_surface_sink sink() {
    tagrid_surface_sink sink;
    tagrid_surface_sink_init(&sink);
    sink.user = this;
    sink.points = [](void* user, size_t count, const double* xyz) {
      auto& taken = *static_cast<TakenSurface*>(user);
      for (size_t i = 0; i < 3 * count; ++i) taken.points.push_back(xyz[i]);
      return taken.calls++ == taken.fails_at ? 1 : 0;
    };
    sink.triangles = [](void* user, size_t count, const int64_t* ids) {
      auto& taken = *static_cast<TakenSurface*>(user);
      for (size_t i = 0; i < 3 * count; ++i)
        taken.came_too_late |= ids[i] < 0 || 3 * static_cast<size_t>(ids[i]) >= taken.points.size();
      for (size_t i = 0; i < count; ++i)
        taken.triangles.push_back({ids[3 * i], ids[3 * i + 1], ids[3 * i + 2]});
      return taken.calls++ == taken.fails_at ? 1 : 0;
    };
    return sink;
  }
};

struct LibrarySurface : TemporaryFolder {
  MemoryFile with_geometry(Index3 dims, const std::string& lines = "") {
    tagrid_encode_options options = encode_options(dims, SampleType::int16);
    tagrid_geometry geometry = {};
    geometry.has_origin = geometry.has_directions = 1;
    const double origin[] = {3, -4, 5.5}, directions[3][3] = {{0, 0.5, 0}, {0.25, 0, 0}, {0, 0, 2}};
    std::copy_n(origin, 3, geometry.origin);
    for (int axis = 0; axis < 3; ++axis) std::copy_n(directions[axis], 3, geometry.directions[axis]);
    options.geometry = &geometry;
    options.metadata = lines.c_str();
    const Encoded encoded = encode(options, blobs<std::int16_t>(dims, 1).data());
    EXPECT_EQ(encoded.status, TAGRID_OK) << encoded.message;
    return {encoded.bytes};
  }

  // The options in both forms.
  void expect_that_of_the_program(MemoryFile& memory, const SurfaceOptions& same,
                                  const tagrid_surface_options& options) {
    file("v.tag", memory.bytes);
    SurfaceOptions with = same;
    with.overwrite = true;
    write_surface(path("v.tag"), path("v.ply"), with, Resources(2));
    const PlySurface ply = read_ply(content("v.ply"));
    TakenSurface taken;
    const tagrid_surface_sink sink = taken.sink();
    const ReaderHandle reader = open_reader(memory);
    const tagrid_call call = call_of(3);
    ASSERT_EQ(tagrid_reader_surface(reader.get(), same.iso, &options, &sink, &call), TAGRID_OK)
        << tagrid_reader_message(reader.get());
    EXPECT_FALSE(taken.came_too_late);
    EXPECT_EQ(taken.triangles, ply.triangles);
    ASSERT_EQ(taken.points.size(), 3 * ply.vertices.size());
    for (std::size_t i = 0; i < taken.points.size(); ++i)
      ASSERT_EQ(taken.points[i], ply.vertices[i / 3][i % 3]);
  }
};

tagrid_surface_options surface_options() {
  tagrid_surface_options options;
  tagrid_surface_options_init(&options);
  return options;
}

TEST_F(LibrarySurface, TheSurfaceIsThatOfTheProgramWholeAndInPart) {
  MemoryFile memory = with_geometry({21, 18, 19});
  const tagrid_box box = {{3, 2, 5}, {14, 17, 12}};
  for (const bool is_part : {false, true})
    for (const bool close : {false, true})
      for (const int level : {-1, 3}) {
        SurfaceOptions same;
        same.iso = 120.5;
        same.close = close;
        if (level >= 0) same.level = level;
        if (is_part) same.region.low = {3, 2, 5}, same.region.high = {14, 17, 12};
        tagrid_surface_options options = surface_options();
        options.level = level;
        options.close = close;
        if (is_part) options.box = &box;
        expect_that_of_the_program(memory, same, options);
      }
}

TEST_F(LibrarySurface, AValueIsOneOfSamplesUnlessItIsRescaled) {
  MemoryFile memory = with_geometry({12, 13, 14}, "rescale_slope:=-0.5\nrescale_intercept:=7\n");
  SurfaceOptions same;
  same.iso = 7 - 0.5 * 120;
  tagrid_surface_options options = surface_options();
  options.rescaled = 1;
  expect_that_of_the_program(memory, same, options);
  TakenSurface rescaled, plain;
  const ReaderHandle reader = open_reader(memory);
  tagrid_surface_sink sink = rescaled.sink();
  ASSERT_EQ(tagrid_reader_surface(reader.get(), same.iso, &options, &sink, nullptr), TAGRID_OK);
  sink = plain.sink();
  ASSERT_EQ(tagrid_reader_surface(reader.get(), 120, nullptr, &sink, nullptr), TAGRID_OK);
  ASSERT_FALSE(plain.triangles.empty());
  // Inside is where samples are low, so triangles have the other side outside.
  EXPECT_NE(rescaled.triangles, plain.triangles);
}

TEST_F(LibrarySurface, ABoxReadsTheBricksAroundItAndNothingElse) {
  const Index3 dims = {45, 45, 45};
  MemoryFile memory = encoded_file(dims, blobs<std::int16_t>(dims, 4), false, 1);
  const ReaderHandle reader = open_reader(memory);
  TakenSurface taken;
  const tagrid_surface_sink sink = taken.sink();
  tagrid_surface_options options = surface_options();
  // Within one brick of 8 samples an edge: with those below it on three axes they are 8.
  const tagrid_box box = {{18, 18, 18}, {22, 22, 22}};
  options.box = &box;
  memory.reads.clear();
  ASSERT_EQ(tagrid_reader_surface(reader.get(), 100, &options, &sink, nullptr), TAGRID_OK);
  EXPECT_EQ(memory.reads.size(), 8u + 1) << "and the page of the index";
}

TEST_F(LibrarySurface, ASinkThatFailsEndsIt) {
  const Index3 dims = {19, 14, 17};
  MemoryFile memory = encoded_file(dims, blobs<std::int16_t>(dims, 5));
  const ReaderHandle reader = open_reader(memory);
  TakenSurface whole;
  tagrid_surface_sink sink = whole.sink();
  ASSERT_EQ(tagrid_reader_surface(reader.get(), 100, nullptr, &sink, nullptr), TAGRID_OK);
  ASSERT_GT(whole.calls, 2);
  for (int n = 0; n < whole.calls; ++n) {
    TakenSurface taken;
    taken.fails_at = n;
    sink = taken.sink();
    ASSERT_EQ(tagrid_reader_surface(reader.get(), 100, nullptr, &sink, nullptr), TAGRID_CANCELLED);
    EXPECT_EQ(taken.calls, n + 1);
  }
}

TEST_F(LibrarySurface, MistakesAreRefused) {
  MemoryFile memory = encoded_file({9, 9, 9}, blobs<std::int16_t>({9, 9, 9}, 6)),
             flat = encoded_file({9, 9, 1}, blobs<std::int16_t>({9, 9, 1}, 6));
  const ReaderHandle reader = open_reader(memory), of_flat = open_reader(flat);
  TakenSurface taken;
  const tagrid_surface_sink sink = taken.sink();
  tagrid_surface_sink without = sink;
  without.triangles = nullptr;
  const tagrid_box outside = {{0, 0, 0}, {10, 9, 9}};
  tagrid_surface_options good = surface_options(), level = good, box = good, size = good;
  level.level = 100;
  box.box = &outside;
  size.struct_size = 3;
  const std::tuple<const tagrid_reader*, double, const tagrid_surface_options*, const tagrid_surface_sink*>
      mistakes[] = {{reader.get(), NAN, &good, &sink},     {reader.get(), INFINITY, &good, &sink},
                    {reader.get(), 100, &level, &sink},    {reader.get(), 100, &box, &sink},
                    {reader.get(), 100, &size, &sink},     {reader.get(), 100, &good, &without},
                    {reader.get(), 100, nullptr, nullptr}, {nullptr, 100, nullptr, nullptr},
                    {of_flat.get(), 100, nullptr, &sink}};
  for (const auto& [of, iso, options, to] : mistakes)
    EXPECT_EQ(tagrid_reader_surface(of, iso, options, to, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(taken.calls, 0);
}

}  // namespace
}  // namespace tagrid
