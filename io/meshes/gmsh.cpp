// The format: "MSH file format" of the manual of Gmsh, version 4.1, https://gmsh.info/doc/texinfo/gmsh.html
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/meshes/mesh_files.h"
#include "io/meshes/mesh_writers.h"

namespace tagrid {
namespace {

constexpr int of_surfaces = 2, of_volumes = 3;  // the dimension of entities

// A kind of element: its number, and where its nodes are among those of a MaterialMesh. Gmsh has the middles of the
// edges 13 and 23 of a tetrahedron the other way round.
struct ElementKind {
  int number;
  std::vector<std::size_t> nodes;
};
ElementKind tetrahedron_of(std::size_t nodes) {
  return nodes == 4 ? ElementKind{4, {0, 1, 2, 3}} : ElementKind{11, {0, 1, 2, 3, 4, 5, 6, 7, 9, 8}};
}
ElementKind triangle_of(std::size_t nodes) {
  return nodes == 4 ? ElementKind{2, {0, 1, 2}} : ElementKind{9, {0, 1, 2, 3, 4, 5}};
}

// Writes numbers to a file, through a buffer.
class Fields {
 public:
  explicit Fields(OutputFile& output) : output_(output), buffer_(std::size_t{1} << 16) {}

  template <class T>
  void put(T number) {
    if (size_ + sizeof(T) > buffer_.size()) flush();
    store_little_endian(buffer_.data() + size_, number);
    size_ += sizeof(T);
  }
  void flush() {
    output_.write(std::span<const std::byte>(buffer_).first(size_));
    size_ = 0;
  }

 private:
  OutputFile& output_;
  std::vector<std::byte> buffer_;
  std::size_t size_ = 0;
};

// The lowest and the highest coordinates of points.
std::array<double, 6> bounds_of(SpoolFile& coordinates) {
  constexpr double far = std::numeric_limits<double>::infinity();
  std::array<double, 6> bounds = {far, far, far, -far, -far, -far};
  for_each_piece(coordinates, 3 * sizeof(double), [&](std::int64_t, std::span<const std::byte> piece) {
    for (std::size_t i = 0; i < piece.size() / sizeof(double); ++i) {
      const auto x = load_little_endian<double>(piece.data() + i * sizeof(double));
      double &low = bounds[i % 3], &high = bounds[3 + i % 3];
      low = std::min(low, x);
      high = std::max(high, x);
    }
  });
  if (coordinates.size() == 0) bounds.fill(0);
  return bounds;
}

// Sections of nodes and of elements begin alike: how many blocks, how many entries, and their first and last numbers.
void put_counts(Fields& fields, std::size_t blocks, std::int64_t count) {
  const auto n = static_cast<std::uint64_t>(count);
  fields.put(static_cast<std::uint64_t>(blocks));
  fields.put(n);
  fields.put(std::uint64_t{1});
  fields.put(n);
}

void put_block(Fields& fields, int dimension, std::size_t entity, int kind, std::int64_t count) {
  fields.put(dimension);
  fields.put(static_cast<int>(entity + 1));
  fields.put(kind);
  fields.put(static_cast<std::uint64_t>(count));
}

class GmshOutput {
 public:
  GmshOutput(OutputFile& output, const MeshContents& mesh, const GmshGroups& groups)
      : output_(output), fields_(output), mesh_(mesh), groups_(groups) {}

  void write_format() {
    constexpr int binary = 1, bytes_of_size = 8;
    output_.write(fmt::format("$MeshFormat\n4.1 {} {}\n", binary, bytes_of_size));
    fields_.put(1);  // tells the order of bytes
    end("MeshFormat");
    if (!mesh_.notes.space.empty())
      output_.write(fmt::format("$Comments\n{}\n$EndComments\n", space_comment(mesh_.notes)));
    std::string names;
    for (const GmshGroup& group : groups_.surfaces)
      names += fmt::format("{} {} \"{}\"\n", of_surfaces, group.tag, group.name);
    for (const GmshGroup& group : groups_.volumes)
      names += fmt::format("{} {} \"{}\"\n", of_volumes, group.tag, group.name);
    output_.write(fmt::format("$PhysicalNames\n{}\n{}$EndPhysicalNames\n",
                              groups_.volumes.size() + groups_.surfaces.size(), names));
  }

  void write_entities() {
    output_.write("$Entities\n");
    // Points, curves, surfaces, volumes.
    for (const std::uint64_t count :
         {std::size_t{0}, std::size_t{0}, groups_.surfaces.size(), groups_.volumes.size()})
      fields_.put(count);
    const std::array<double, 6> bounds = bounds_of(*mesh_.coordinates);
    for (const auto* groups : {&groups_.surfaces, &groups_.volumes})
      for (const GmshGroup& group : *groups) {
        fields_.put(static_cast<int>(&group - groups->data() + 1));
        for (const double bound : bounds) fields_.put(bound);
        fields_.put(std::uint64_t{1});
        fields_.put(group.tag);
        fields_.put(static_cast<std::uint64_t>(group.surfaces.size()));
        for (const int surface : group.surfaces) fields_.put(surface);
      }
    end("Entities");
  }

  void write_nodes() {
    output_.write("$Nodes\n");
    constexpr int not_parametric = 0;
    put_counts(fields_, 1, mesh_.points);
    put_block(fields_, of_volumes, 0, not_parametric, mesh_.points);
    for (std::int64_t i = 1; i <= mesh_.points; ++i) fields_.put(static_cast<std::uint64_t>(i));
    fields_.flush();
    mesh_.coordinates->read_back([&](std::span<const std::byte> part) { output_.write(part); });
    end("Nodes");
  }

  void write_elements() {
    output_.write("$Elements\n");
    std::int64_t count = mesh_.cells;
    std::size_t blocks = 0;
    for (const auto* groups : {&groups_.surfaces, &groups_.volumes})
      for (const GmshGroup& group : *groups) blocks += has_block(group);
    for (const GmshGroup& group : groups_.surfaces) count += group.count;
    put_counts(fields_, blocks, count);
    put_blocks(groups_.volumes, of_volumes, *mesh_.connectivity, tetrahedron_of(mesh_.nodes), 1);
    if (!groups_.surfaces.empty())
      put_blocks(groups_.surfaces, of_surfaces, *groups_.face_nodes, triangle_of(mesh_.nodes),
                 1 + mesh_.cells);
    end("Elements");
  }

  /// Point data as "NodeData", cell data as "ElementData".
  void write_data(const char* section, const MeshData& data, std::int64_t count) {
    // No real numbers but the time 0; step, components and count.
    output_.write(fmt::format("${}\n1\n\"{}\"\n1\n0\n3\n0\n1\n{}\n", section, data.name, count));
    std::int32_t entry = 0;
    with_sample_type(data.type, [&](auto type) {
      using T = decltype(type);
      for_each_piece(data, [&](std::int64_t, std::span<const std::byte> piece) {
        for (std::size_t i = 0; i < piece.size(); i += sizeof(T)) {
          fields_.put(++entry);
          fields_.put(static_cast<double>(load_little_endian<T>(piece.data() + i)));
        }
      });
    });
    end(section);
  }

 private:
  /// meshio reads no blocks without elements. A mesh without any has them all the same.
  bool has_block(const GmshGroup& group) const { return group.count > 0 || mesh_.cells == 0; }

  void put_blocks(const std::vector<GmshGroup>& groups, int dimension, SpoolFile& nodes,
                  const ElementKind& kind, std::int64_t first_number) {
    for (std::size_t i = 0; i < groups.size(); ++i) {
      if (!has_block(groups[i])) continue;
      put_block(fields_, dimension, i, kind.number, groups[i].count);
      put_elements(groups[i], nodes, kind, first_number);
    }
  }

  void put_elements(const GmshGroup& group, SpoolFile& nodes, const ElementKind& kind,
                    std::int64_t first_number) {
    constexpr std::size_t size = sizeof(std::int64_t);
    const std::size_t entry = kind.nodes.size() * size;
    const auto put = [&](std::int64_t first, std::span<const std::byte> piece) {
      for (std::size_t at = 0; at < piece.size(); at += entry) {
        fields_.put(static_cast<std::uint64_t>(first_number + first++));
        for (const std::size_t node : kind.nodes)
          fields_.put(1 + load_little_endian<std::uint64_t>(piece.data() + at + node * size));
      }
    };
    for_each_piece(nodes, entry, group.first, group.count, put);
  }

  void end(const char* section) {
    fields_.flush();
    output_.write(fmt::format("\n$End{}\n", section));
  }

  OutputFile& output_;
  Fields fields_;
  const MeshContents& mesh_;
  const GmshGroups& groups_;
};

}  // namespace

void check_gmsh_count(std::int64_t count, const char* what, const std::string& name) {
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  if (count > most)
    throw UsageError("{}: a Gmsh file has at most {} {}; choose another format, or a coarser mesh", name,
                     most, what);
}

void GmshFile::add_points(std::span<const double> xyz, std::span<const std::byte> values) {
  MeshFile::add_points(xyz, values);
  check_gmsh_count(mesh_.points, "points", output_.name());
}

void GmshFile::add_tetrahedra(std::span<const std::int64_t> connectivity,
                              std::span<const std::uint8_t> levels) {
  MeshFile::add_tetrahedra(connectivity, levels);
  check_gmsh_count(mesh_.tetrahedra, "tetrahedra", output_.name());
}

void write_gmsh(OutputFile& output, const MeshContents& mesh, const GmshGroups& groups) {
  GmshOutput file(output, mesh, groups);
  file.write_format();
  file.write_entities();
  file.write_nodes();
  file.write_elements();
  for (const MeshData& data : mesh.point_data) file.write_data("NodeData", data, mesh.points);
  for (const MeshData& data : mesh.cell_data) file.write_data("ElementData", data, mesh.cells);
}

void GmshFile::write_mesh() { write_gmsh(output_, contents(), {{{"volume", 1, 0, mesh_.tetrahedra}}, {}}); }

}  // namespace tagrid
