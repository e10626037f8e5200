// mesh_check FILE.vtu [DX DY DZ [--covers]]: is a mesh of `tagrid mesh` conforming?
//
// The volume must have spacing 1 and origin 0. DX DY DZ: the edges of the box that the mesh fills exactly
// (whole root cubes, for --padded), or with --covers fills and may leave (samples - 1 an axis, without
// --padded). About 70 bytes a tetrahedron. Ends with 1 if a law is broken.

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string_view>

#include "stages/mesh/tetrahedra.h"
#include "tests/support/mesh_laws.h"

namespace tagrid {
namespace {

// A face that is in one tetrahedron only must not be seen from inside the box.
bool is_hole(const std::array<Index3, 3>& face, Index3 box, bool covers) {
  if (!covers) return !is_on_border(face, box);
  for (int axis = 0; axis < 3; ++axis)
    if (face[0][axis] == 0 && face[1][axis] == 0 && face[2][axis] == 0) return false;
  return !lies_outside_volume({face[0], face[1], face[2], face[2]}, box + Index3{1, 1, 1});
}

int check(const char* path, const Index3* box, bool covers) {
  Vtu vtu(path);
  const LatticeMesh mesh = read_lattice_mesh(vtu);
  std::int64_t holes = 0;
  const MeshFindings found = check_mesh(mesh, [&](const std::array<std::size_t, 3>& ids) {
    if (box) holes += is_hole({mesh.points[ids[0]], mesh.points[ids[1]], mesh.points[ids[2]]}, *box, covers);
  });
  std::printf("%zu points, %zu tetrahedra, volume %.9g, %lld open faces\n", mesh.points.size(), mesh.size(),
              static_cast<double>(found.six_volumes) / 6, static_cast<long long>(found.open_faces));
  std::string faults = found.text();
  if (holes > 0) faults += std::to_string(holes) + " faces border a hole; ";
  const std::int64_t expected = box ? 6 * box->x * box->y * box->z : 0;
  if (box && (covers ? found.six_volumes < expected : found.six_volumes != expected))
    faults += "the volumes do not sum to the box; ";
  std::printf("%s\n", faults.empty() ? "conforming" : faults.c_str());
  return faults.empty() ? 0 : 1;
}

}  // namespace
}  // namespace tagrid

int main(int argc, char** argv) {
  const bool covers = argc == 6 && std::string_view(argv[5]) == "--covers";
  if (argc != 2 && argc != 5 && !covers) {
    std::fprintf(stderr, "usage: mesh_check FILE.vtu [DX DY DZ [--covers]]\n");
    return 64;
  }
  try {
    tagrid::Index3 box;
    for (int axis = 0; argc > 2 && axis < 3; ++axis) box[axis] = std::atoll(argv[2 + axis]);
    return tagrid::check(argv[1], argc > 2 ? &box : nullptr, covers);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mesh_check: %s\n", error.what());
    return 65;
  }
}
