// mesh_check FILE.vtu [DX DY DZ [--cut]]: checks that a mesh of `tagrid mesh` is conforming and fills a box.
//
// The volume must have spacing 1 and origin 0. DX DY DZ: the edges of the box that the mesh must fill
// exactly, in steps between samples. For a mesh with --padded these are whole root cubes; for any other mesh
// they are the number of samples - 1 along each axis, and it may be --cut there. Takes about 70 bytes per
// tetrahedron. The exit code is 1 if a law is broken.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string_view>

#include "stages/mesh/tetrahedra.h"
#include "tests/support/mesh_laws.h"

namespace tagrid {
namespace {

int check(const char* path, const std::optional<Index3>& edges, bool cut) {
  Vtu vtu(path);
  // A padded mesh may begin one step before the first sample.
  const LatticeMesh mesh = read_lattice_mesh(vtu, {1, 1, 1});
  Index3 low = mesh.points.empty() ? Index3{} : mesh.points[0];
  for (const Index3& p : mesh.points)
    for (int axis = 0; axis < 3; ++axis) low[axis] = std::min(low[axis], p[axis]);
  const std::optional<Box> box = edges ? std::optional(Box{low, low + *edges}) : std::nullopt;
  std::int64_t holes = 0;
  const auto open_face = [&](const std::array<std::size_t, 3>& ids) {
    if (box) holes += !is_on_border({mesh.points[ids[0]], mesh.points[ids[1]], mesh.points[ids[2]]}, *box);
  };
  const MeshFindings found = check_mesh(mesh, open_face, cut ? box : std::nullopt);
  std::printf("%zu points, %zu tetrahedra, volume %.9g, %lld open faces\n", mesh.points.size(), mesh.size(),
              static_cast<double>(found.six_volumes) / 6, static_cast<long long>(found.open_faces));
  std::string faults = found.text();
  if (holes > 0) faults += std::to_string(holes) + " faces border a hole; ";
  const std::int64_t expected = edges ? 6 * edges->x * edges->y * edges->z : 0;
  if (box && found.six_volumes != expected) faults += "the volumes do not sum to the box; ";
  std::printf("%s\n", faults.empty() ? "conforming" : faults.c_str());
  return faults.empty() ? 0 : 1;
}

}  // namespace
}  // namespace tagrid

int main(int argc, char** argv) {
  const bool cut = argc == 6 && std::string_view(argv[5]) == "--cut";
  if (argc != 2 && argc != 5 && !cut) {
    std::fprintf(stderr, "usage: mesh_check FILE.vtu [DX DY DZ [--cut]]\n");
    return 64;
  }
  try {
    tagrid::Index3 box;
    for (int axis = 0; argc > 2 && axis < 3; ++axis) box[axis] = std::atoll(argv[2 + axis]);
    return tagrid::check(argv[1], argc > 2 ? std::optional(box) : std::nullopt, cut);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mesh_check: %s\n", error.what());
    return 65;
  }
}
