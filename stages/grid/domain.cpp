#include "stages/grid/domain.h"

#include "stages/grid/lattice.h"

namespace tagrid {

std::vector<std::uint64_t> points_up_to_level(const Domain& domain) {
  std::uint64_t m[3];  // cubes along each axis, of the edge of this cycle
  for (int axis = 0; axis < 3; ++axis) m[axis] = static_cast<std::uint64_t>(domain.cubes(axis));
  std::vector<std::uint64_t> points{(m[0] + 1) * (m[1] + 1) * (m[2] + 1)};
  for (int level = 1; level <= max_level(domain.cube_size); level += 3) {
    const std::uint64_t cube_centres = m[0] * m[1] * m[2];
    const std::uint64_t face_centres =
        (m[0] + 1) * m[1] * m[2] + m[0] * (m[1] + 1) * m[2] + m[0] * m[1] * (m[2] + 1);
    points.push_back(points.back() + cube_centres);
    points.push_back(points.back() + face_centres);
    for (std::uint64_t& cubes : m) cubes *= 2;
    points.push_back((m[0] + 1) * (m[1] + 1) * (m[2] + 1));
  }
  return points;
}

}  // namespace tagrid
