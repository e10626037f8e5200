// Meshes with materials through callbacks: the same as that of the program, and ends of sinks that fail.
#include <cmath>
#include <limits>
#include <map>

#include "io/files/open_source.h"
#include "pipeline/materials/material_mesh.h"
#include "pipeline/materials/settings.h"
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <class Number>
std::vector<Number> numbers_of(SpoolFile& file) {
  std::vector<Number> numbers(file.size() / sizeof(Number));
  file.read_at(0, std::as_writable_bytes(std::span(numbers)));
  return numbers;
}

// Takes a mesh with nodes of this order.
struct TakenMaterials {
  std::vector<double> points;
  std::map<std::string, std::pair<std::int64_t, std::vector<std::int64_t>>> materials;
  std::map<std::string, std::vector<std::int64_t>> surfaces;
  int order = 1;

  tagrid_material_mesh_sink sink() {
    tagrid_material_mesh_sink sink;
    tagrid_material_mesh_sink_init(&sink);
    sink.user = this;
    sink.points = [](void* user, size_t count, const double* xyz) {
      auto& taken = *static_cast<TakenMaterials*>(user);
      taken.points.insert(taken.points.end(), xyz, xyz + 3 * count);
      return 0;
    };
    sink.tetrahedra = [](void* user, const char* name, int64_t label, size_t count, const int64_t* points) {
      auto& taken = *static_cast<TakenMaterials*>(user);
      auto& of_material = taken.materials[name];
      of_material.first = label;
      of_material.second.insert(of_material.second.end(), points,
                                points + (taken.order == 1 ? 4 : 10) * count);
      return 0;
    };
    sink.triangles = [](void* user, const char* name, size_t count, const int64_t* points) {
      auto& taken = *static_cast<TakenMaterials*>(user);
      auto& of_surface = taken.surfaces[name];
      of_surface.insert(of_surface.end(), points, points + (taken.order == 1 ? 3 : 6) * count);
      return 0;
    };
    return sink;
  }
};

struct LibraryMaterialMesh : TemporaryFolder {
  LibraryMaterialMesh() : memory(encoded_file({33, 30, 28}, blobs<std::int16_t>({33, 30, 28}, 4))) {
    file("volume.tag", memory.bytes);
    tagrid_material_mesh_options_init(&options);
    options.materials = materials.data();
    options.material_count = materials.size();
    options.fine = 2;
  }
  MemoryFile memory;
  std::vector<tagrid_material> materials = {{"low", -infinity, 100, 0}, {"high", 100, infinity, 0}};
  tagrid_material_mesh_options options;
};

TEST_F(LibraryMaterialMesh, IsThatOfTheProgram) {
  for (const int order : {1, 2}) {
    options.order = order;
    const TagBricks file(open_source(path("volume.tag")));
    MaterialMeshOptions same;
    same.ranges = {{"low", -INFINITY, 100}, {"high", 100, INFINITY}};
    same.fine = {2, ""};
    same.order = order;
    const Geometry geometry = file.header().metadata.geometry();
    MadeMaterialMesh wanted = make_material_mesh(file, settle_material_mesh(file, geometry, same), geometry,
                                                 same, {path(""), "the mesh"}, Resources(2));

    const ReaderHandle reader = open_reader(memory);
    TakenMaterials found;
    found.order = order;
    const tagrid_material_mesh_sink sink = found.sink();
    ASSERT_EQ(tagrid_reader_material_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
    EXPECT_EQ(found.points, numbers_of<double>(wanted.mesh.points));
    std::vector<std::int64_t> nodes, face_nodes;
    ASSERT_EQ(found.materials.size(), wanted.mesh.materials.size());
    for (const MaterialElements& material : wanted.mesh.materials) {
      const auto& [label, tetrahedra] = found.materials[material.name];
      EXPECT_EQ(label, material.label);
      EXPECT_EQ(static_cast<std::int64_t>(tetrahedra.size()), material.count * (order == 1 ? 4 : 10));
      nodes.insert(nodes.end(), tetrahedra.begin(), tetrahedra.end());
    }
    EXPECT_EQ(nodes, numbers_of<std::int64_t>(wanted.mesh.nodes));
    ASSERT_EQ(found.surfaces.size(), wanted.mesh.surfaces.size());
    for (const MaterialSurface& surface : wanted.mesh.surfaces) {
      const auto& triangles = found.surfaces[surface.name];
      face_nodes.insert(face_nodes.end(), triangles.begin(), triangles.end());
    }
    EXPECT_EQ(face_nodes, numbers_of<std::int64_t>(wanted.mesh.face_nodes));
    EXPECT_FALSE(face_nodes.empty());
  }
}

// Counts calls, and fails at one of them.
struct Counted {
  int calls = 0, fails_at = -1;

  int call() { return calls++ == fails_at ? 1 : 0; }
  tagrid_material_mesh_sink sink() {
    tagrid_material_mesh_sink sink;
    tagrid_material_mesh_sink_init(&sink);
    sink.user = this;
    sink.points = [](void* user, size_t, const double*) { return static_cast<Counted*>(user)->call(); };
    sink.tetrahedra = [](void* user, const char*, int64_t, size_t, const int64_t*) {
      return static_cast<Counted*>(user)->call();
    };
    sink.triangles = [](void* user, const char*, size_t, const int64_t*) {
      return static_cast<Counted*>(user)->call();
    };
    return sink;
  }
};

TEST_F(LibraryMaterialMesh, ASinkThatFailsEndsIt) {
  const ReaderHandle reader = open_reader(memory);
  Counted whole;
  tagrid_material_mesh_sink sink = whole.sink();
  ASSERT_EQ(tagrid_reader_material_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
  ASSERT_GT(whole.calls, 3);
  for (int n = 0; n < whole.calls; ++n) {
    Counted counted;
    counted.fails_at = n;
    sink = counted.sink();
    EXPECT_EQ(tagrid_reader_material_mesh(reader.get(), &options, &sink, nullptr), TAGRID_CANCELLED);
    EXPECT_EQ(counted.calls, n + 1);
  }
}

TEST_F(LibraryMaterialMesh, RefusesWrongArguments) {
  const ReaderHandle reader = open_reader(memory);
  Counted counted;
  const tagrid_material_mesh_sink sink = counted.sink();
  const auto is_refused = [&](const tagrid_material_mesh_options* given,
                              const tagrid_material_mesh_sink* to) {
    return tagrid_reader_material_mesh(reader.get(), given, to, nullptr) == TAGRID_INVALID_ARGUMENT;
  };
  EXPECT_TRUE(is_refused(nullptr, &sink));
  EXPECT_TRUE(is_refused(&options, nullptr));
  tagrid_material_mesh_sink half = sink;
  half.triangles = nullptr;
  EXPECT_TRUE(is_refused(&options, &half));
  options.material_count = 0;
  EXPECT_TRUE(is_refused(&options, &sink)) << "no materials";
  options.material_count = 2;
  options.materials = nullptr;
  EXPECT_TRUE(is_refused(&options, &sink)) << "no list";
  options.materials = materials.data();
  materials[0].name = nullptr;
  EXPECT_TRUE(is_refused(&options, &sink)) << "no name";
  materials[0].name = "high";
  EXPECT_TRUE(is_refused(&options, &sink)) << "two names";
  materials[0].name = "low";
  const tagrid_box box = {{5, 5, 5}, {60, 6, 6}};
  options.box = &box;
  EXPECT_TRUE(is_refused(&options, &sink)) << "a box beyond the volume";
  options.box = nullptr;
  options.labels = 1;
  EXPECT_TRUE(is_refused(&options, &sink)) << "two labels alike";
  EXPECT_EQ(counted.calls, 0);
  options.labels = 0;
  EXPECT_EQ(tagrid_reader_material_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
}

}  // namespace
}  // namespace tagrid
