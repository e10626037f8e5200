// OpenVDB's own library, without tagrid: it writes files for tests, and reads files that tagrid wrote.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid::oracle {

enum class Type { floats, halves, doubles, ints, bools };

/// A cuboid of one value, stored as tiles if they fit.
struct Fill {
  Box box;
  double value = 0;
  bool active = true;
};

struct Grid {
  std::string name = "density", grid_class = "unknown";
  Type type = Type::floats;
  double background = 0;
  std::vector<Fill> fills;
  /// Active voxels, one by one, in this box.
  Box noise = {{0, 0, 0}, {-1, -1, -1}};
  std::function<double(const Index3&)> value = {};
  /// Rows for x, y, z and the translation.
  std::array<std::array<double, 3>, 4> transform = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
  bool uniform = false;      ///< a uniform scale, of transform[0][0], instead
  bool perspective = false;  ///< a frustum instead
  std::vector<std::pair<std::string, std::string>> metadata = {};
};

/// Compression, as bits: 1 zip, 2 active values only, 4 blosc.
void write_file(const std::string& path, const std::vector<Grid>& grids, std::uint32_t compression = 6,
                const std::vector<std::pair<std::string, std::string>>& metadata = {});
/// The same as a stream, which has no positions.
void write_stream(const std::string& path, const std::vector<Grid>& grids);
/// Two grids that share the tree of the first one.
void write_instances(const std::string& path, const Grid& grid, const std::string& second_name);

/// The content that the library reads from a file.
struct Read {
  std::string type, grid_class;
  double background = 0;
  Box active;
  std::uint64_t active_voxels = 0, leaves = 0, active_tiles = 0;
  std::vector<double> values;  ///< in the requested box, x fastest
  std::vector<bool> is_active;
  std::array<std::array<double, 3>, 4> transform = {};
  bool uniform = false;
};
Read read_file(const std::string& path, const std::string& grid, const Box& box);

}  // namespace tagrid::oracle
