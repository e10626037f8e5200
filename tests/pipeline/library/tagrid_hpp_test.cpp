// The library for C++, which sees none of the program's own headers: they have names in common.
#include <tagrid/tagrid.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "tests/pipeline/library/c_caller.h"

namespace {

constexpr std::int64_t nx = 17, ny = 12, nz = 14;

std::vector<std::int16_t> ramp() {
  std::vector<std::int16_t> samples;
  for (std::int64_t i = 0; i < nx * ny * nz; ++i) samples.push_back(static_cast<std::int16_t>(i * i % 997));
  return samples;
}

tagrid_encode_options options() {
  tagrid_encode_options options;
  tagrid_encode_options_init(&options);
  options.dims[0] = nx, options.dims[1] = ny, options.dims[2] = nz;
  options.type = TAGRID_INT16;
  options.cube = 4;
  return options;
}

class MemoryInput : public tagrid::Input {
 public:
  std::uint64_t size() override { return bytes.size(); }
  void read_at(std::uint64_t offset, std::span<std::byte> to) override {
    if (fails) throw std::runtime_error("no luck");
    std::memcpy(to.data(), bytes.data() + offset, to.size());
  }
  std::vector<std::byte> bytes;
  bool fails = false;
};

MemoryInput encoded() {
  MemoryInput file;
  tagrid::Encoder encoder(options(), [&](std::span<const std::byte> part) {
    file.bytes.insert(file.bytes.end(), part.begin(), part.end());
  });
  encoder.write(ramp());
  const std::uint64_t bytes = encoder.finish().file_bytes;
  EXPECT_EQ(bytes, file.bytes.size());
  return file;
}

tagrid_status status_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const tagrid::Error& error) {
    EXPECT_STRNE(error.what(), "");
    return error.status();
  }
  return TAGRID_OK;
}

TEST(TagridHpp, WhatIsWrittenIsRead) {
  MemoryInput file = encoded();
  tagrid::Reader opened(file);
  tagrid::Reader reader = std::move(opened);
  EXPECT_EQ(reader.read<std::int16_t>(reader.box()), ramp());
  const auto part = reader.read<std::int16_t>({{3, 2, 1}, {10, 9, 8}}, {3, 2, 7});
  EXPECT_EQ(part.size(), 3u * 4u * 1u);
  EXPECT_EQ(part[1], ramp()[1 * nx * ny + 2 * nx + 6]);
  EXPECT_EQ(reader.metadata(), "");
  EXPECT_EQ(reader.brick(0).box.low[0], 0);
  reader.verify();
  const auto mesh = reader.mesh<std::int16_t>();
  EXPECT_EQ(mesh.points.size(), 3 * mesh.values.size());
  EXPECT_EQ(mesh.tetrahedra.size(), 4 * mesh.levels.size());
  EXPECT_FALSE(mesh.levels.empty());
  const tagrid_material solid = {"solid", 500, std::numeric_limits<double>::infinity(), 0};
  tagrid_material_mesh_options of_materials;
  tagrid_material_mesh_options_init(&of_materials);
  of_materials.materials = &solid;
  of_materials.material_count = 1;
  for (const int order : {1, 2}) {
    of_materials.order = order;
    const auto solids = reader.material_mesh(of_materials);
    ASSERT_EQ(solids.materials.size(), 1u);
    EXPECT_EQ(solids.materials[0].name, "solid");
    EXPECT_EQ(solids.materials[0].tetrahedra.size() % (order == 1 ? 4 : 10), 0u);
    EXPECT_LT(static_cast<std::size_t>(*std::ranges::max_element(solids.materials[0].tetrahedra)),
              solids.points.size() / 3);
    EXPECT_FALSE(solids.surfaces.empty());
  }
  const tagrid::Surface surface = reader.surface(100);
  EXPECT_FALSE(surface.triangles.empty());
  EXPECT_EQ(surface.triangles.size() % 3, 0u);
  EXPECT_EQ(*std::max_element(surface.triangles.begin(), surface.triangles.end()) + 1,
            static_cast<std::int64_t>(surface.points.size() / 3));
}

TEST(TagridHpp, MistakesAreExceptionsWithAStatus) {
  MemoryInput file = encoded();
  tagrid::Reader reader(file);
  EXPECT_EQ(status_of([&] { reader.read<float>(reader.box()); }), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] { reader.mesh<float>(); }), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] {
              reader.read<std::int16_t>({{0, 0, 0}, {nx + 1, 1, 1}});
            }),
            TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] {
              reader.read<std::int16_t>({{0, 0, 0}, {1, 1, 1}}, {0, 1, 1});
            }),
            TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] { reader.brick(-1); }), TAGRID_INVALID_ARGUMENT);
  std::vector<std::int16_t> too_small(3);
  EXPECT_EQ(status_of([&] {
              reader.read_to<std::int16_t>(reader.box(), {1, 1, 1}, too_small);
            }),
            TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] { tagrid::Reader("no such file"); }), TAGRID_IO_ERROR);
  file.fails = true;
  EXPECT_EQ(status_of([&] { reader.read<std::int16_t>(reader.box()); }), TAGRID_IO_ERROR);
  file.fails = false;
  MemoryInput truncated;
  truncated.bytes.assign(file.bytes.begin(), file.bytes.end() - 5);
  EXPECT_EQ(status_of([&] { tagrid::Reader broken(truncated); }), TAGRID_BROKEN_INPUT);
  EXPECT_EQ(
      status_of([&] { reader.verify({.progress = [](std::uint64_t, std::uint64_t) { return false; }}); }),
      TAGRID_CANCELLED);
  tagrid::Encoder encoder(options(), [](std::span<const std::byte>) {});
  EXPECT_EQ(status_of([&] { encoder.write(std::vector<float>(nx * ny)); }), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] { encoder.write(std::vector<std::int16_t>(nx)); }), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([&] { encoder.finish(); }), TAGRID_INVALID_ARGUMENT);
}

struct Mine {};

TEST(TagridHpp, WhatCallbacksThrowIsThrownOn) {
  MemoryInput file = encoded();
  tagrid::Reader reader(file);
  const tagrid::Call call{.progress = [](std::uint64_t, std::uint64_t) -> bool { throw Mine(); }};
  EXPECT_THROW(reader.read<std::int16_t>(reader.box(), {1, 1, 1}, call), Mine);
  EXPECT_THROW(reader.verify(call), Mine);
  EXPECT_THROW(reader.mesh<std::int16_t>(nullptr, call), Mine);
  EXPECT_THROW(reader.surface(100, nullptr, call), Mine);
  EXPECT_THROW(
      {
        tagrid::Encoder encoder(options(), [](std::span<const std::byte>) { throw Mine(); });
        encoder.write(ramp());
        encoder.finish();
      },
      Mine);
  EXPECT_THROW(
      {
        tagrid::Encoder encoder(
            options(), [](std::span<const std::byte>) {}, call);
        encoder.write(ramp());
        encoder.finish();
      },
      Mine);
}

TEST(LibraryInC, WhatIsWrittenIsRead) { EXPECT_EQ(c_round_trip(), 1); }

}  // namespace
