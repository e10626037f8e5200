#include "tests/readers/vdb/openvdb_oracle.h"

#include <fstream>

// The library's headers cause warnings that we do not fix.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#pragma GCC diagnostic pop

namespace tagrid::oracle {
namespace {

openvdb::Coord coord(const Index3& p) {
  return {static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
}
Index3 index(const openvdb::Coord& p) { return {p.x(), p.y(), p.z()}; }

template <class Use>
void for_each_point(const Box& box, Use use) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) use(Index3{x, y, z});
}

openvdb::math::Transform::Ptr transform_of(const Grid& grid) {
  using openvdb::math::Transform;
  if (grid.uniform) return Transform::createLinearTransform(grid.transform[0][0]);
  if (grid.perspective) return Transform::createFrustumTransform({{0, 0, 0}, {100, 100, 100}}, 0.5, 10);
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column)
      matrix[row][column] = grid.transform[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  return Transform::createLinearTransform(matrix);
}

template <class G>
openvdb::GridBase::Ptr made(const Grid& grid) {
  using Value = typename G::ValueType;
  const auto result = G::create(static_cast<Value>(grid.background));
  for (const Fill& fill : grid.fills)
    result->tree().sparseFill({coord(fill.box.low), coord(fill.box.high)}, static_cast<Value>(fill.value),
                              fill.active);
  auto accessor = result->getAccessor();
  for_each_point(grid.noise,
                 [&](const Index3& p) { accessor.setValue(coord(p), static_cast<Value>(grid.value(p))); });
  result->setName(grid.name);
  result->setGridClass(G::stringToGridClass(grid.grid_class));
  result->setTransform(transform_of(grid));
  result->setSaveFloatAsHalf(grid.type == Type::halves);
  for (const auto& [name, text] : grid.metadata) result->insertMeta(name, openvdb::StringMetadata(text));
  return result;
}

openvdb::GridBase::Ptr made(const Grid& grid) {
  openvdb::initialize();
  if (grid.type == Type::doubles) return made<openvdb::DoubleGrid>(grid);
  if (grid.type == Type::ints) return made<openvdb::Int32Grid>(grid);
  if (grid.type == Type::bools) return made<openvdb::BoolGrid>(grid);
  return made<openvdb::FloatGrid>(grid);
}

openvdb::GridPtrVec made(const std::vector<Grid>& grids) {
  openvdb::GridPtrVec result;
  for (const Grid& grid : grids) result.push_back(made(grid));
  return result;
}

template <class G>
void read_values(const openvdb::GridBase::Ptr& base, const Box& box, Read& read) {
  const auto grid = openvdb::gridPtrCast<G>(base);
  if (!grid) return;
  read.background = static_cast<double>(grid->background());
  auto accessor = grid->getConstAccessor();
  for_each_point(box, [&](const Index3& p) {
    read.values.push_back(static_cast<double>(accessor.getValue(coord(p))));
    read.is_active.push_back(accessor.isValueOn(coord(p)));
  });
  read.leaves = grid->tree().leafCount();
  read.active_tiles = grid->tree().activeTileCount();
}

}  // namespace

void write_file(const std::string& path, const std::vector<Grid>& grids, std::uint32_t compression,
                const std::vector<std::pair<std::string, std::string>>& metadata) {
  openvdb::initialize();
  openvdb::MetaMap of_file;
  for (const auto& [name, text] : metadata) of_file.insertMeta(name, openvdb::StringMetadata(text));
  openvdb::io::File file(path);
  file.setCompression(compression);
  file.write(made(grids), of_file);
}

void write_stream(const std::string& path, const std::vector<Grid>& grids) {
  openvdb::initialize();
  std::ofstream out(path, std::ios::binary);
  openvdb::io::Stream(out).write(made(grids));
}

void write_instances(const std::string& path, const Grid& grid, const std::string& second_name) {
  const auto first = made(grid);
  const auto second = first->copyGrid();
  second->setName(second_name);
  openvdb::io::File(path).write(openvdb::GridPtrVec{first, second});
}

Read read_file(const std::string& path, const std::string& name, const Box& box) {
  openvdb::initialize();
  openvdb::io::File file(path);
  file.open();
  const auto grid = file.readGrid(name);
  Read read;
  read.type = grid->valueType();
  read.grid_class = openvdb::GridBase::gridClassToString(grid->getGridClass());
  read.active_voxels = grid->activeVoxelCount();
  const auto active = grid->evalActiveVoxelBoundingBox();
  read.active = {index(active.min()), index(active.max())};
  read_values<openvdb::FloatGrid>(grid, box, read);
  read_values<openvdb::DoubleGrid>(grid, box, read);
  read_values<openvdb::Int32Grid>(grid, box, read);
  const auto matrix = grid->transform().baseMap()->getAffineMap()->getMat4();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column)
      read.transform[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = matrix[row][column];
  read.uniform = grid->hasUniformVoxels();
  return read;
}

}  // namespace tagrid::oracle
