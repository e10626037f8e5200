#include "io/programs/mesh_layout.h"

namespace tagrid {

std::vector<MeshArray> MeshLayout::arrays() const {
  std::vector<MeshArray> all = {{positions_array, points, 3 * sizeof(double)},
                                {connectivity_array, tetrahedra, 4 * sizeof(std::int64_t)}};
  for (const auto& [name, type] : point_data) all.push_back({name, points, size_of(type)});
  for (const auto& [name, type] : cell_data) all.push_back({name, tetrahedra, size_of(type)});
  return all;
}

}  // namespace tagrid
