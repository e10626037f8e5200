#include "io/formats/vdb/reader/grid_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <istream>
#include <streambuf>

#include "io/errors/errors.h"
#include "io/programs/serve.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

constexpr std::uint32_t oldest_version = 222, newest_version = openvdb::OPENVDB_FILE_VERSION;
/// Of a leaf whose voxels stay in the file: where they are, and the blocks of the heap for both.
constexpr std::uint64_t memory_beside_leaf = sizeof(openvdb::FloatTree::LeafNodeType::Buffer::FileInfo) + 32;

/// The bytes of a file, which is mapped, not read. A position outside the file is an error.
class MappedBytes final : public std::streambuf {
 public:
  /// Throws WorldError if the file cannot be opened.
  explicit MappedBytes(const std::string& path) : file_(path) {
    char* begin = file_.bytes().data();
    setg(begin, begin, begin + file_.bytes().size());
  }

 private:
  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode) override;
  pos_type seekpos(pos_type position, std::ios::openmode) override;

  MappedFile file_;
};

MappedBytes::pos_type MappedBytes::seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode) {
  const off_type begin = from == std::ios::beg   ? 0
                         : from == std::ios::cur ? gptr() - eback()
                                                 : egptr() - eback();
  const auto size = static_cast<off_type>(file_.bytes().size());
  if (offset < -begin || offset > size - begin) return pos_type(off_type(-1));
  setg(eback(), eback() + begin + offset, egptr());
  return {begin + offset};
}

MappedBytes::pos_type MappedBytes::seekpos(pos_type position, std::ios::openmode which) {
  return seekoff(position, std::ios::beg, which);
}

Index3 index(const openvdb::Coord& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

void throw_broken_vdb(const std::string& path, const std::string& why) {
  throw BrokenInput("{}: OpenVDB file: {}", path, why);
}

/// The library's own parser, on a stream that throws at the end of the file.
class GridFile::Archive final : public openvdb::io::Archive {
 public:
  explicit Archive(const std::string& path) : bytes_(path), stream_(&bytes_) {
    stream_.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    readHeader(stream_);
    meta_->setSeekable(true);
    openvdb::io::setStreamMetadataPtr(stream_, meta_, false);
    setFormatVersion(stream_);
    setLibraryVersion(stream_);
    setDataCompression(stream_);
  }

  bool has_positions() const { return inputHasGridOffsets(); }

  std::vector<openvdb::io::GridDescriptor> descriptors() {
    of_file_.readMeta(stream_);
    const std::int32_t count = readGridCount(stream_);
    std::vector<openvdb::io::GridDescriptor> all;
    for (std::int32_t i = 0; i < count; ++i) {
      openvdb::io::GridDescriptor grid;
      grid.read(stream_);
      if (!has_positions()) grid.setGridPos(stream_.tellg());
      if (has_positions() && (grid.getGridPos() != stream_.tellg() || grid.getEndPos() <= grid.getGridPos()))
        throw openvdb::IoError("the position of a grid is impossible");
      all.push_back(grid);
      if (!has_positions()) break;
      grid.seekToEnd(stream_);
    }
    grids_ = count;
    return all;
  }
  std::int32_t grids() const { return grids_; }

  /// Metadata, that of the file included, and transform.
  openvdb::GridBase::Ptr head_of(const openvdb::io::GridDescriptor& descriptor) {
    auto grid = openvdb::GridBase::createGrid(descriptor.gridType());
    grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());
    stream_.seekg(descriptor.getGridPos());
    readGridCompression(stream_);
    grid->readMeta(stream_);
    for (auto entry = of_file_.beginMeta(); entry != of_file_.endMeta(); ++entry)
      if (!(*grid)[entry->first]) grid->insertMeta(entry->first, *entry->second);
    grid->readTransform(stream_);
    return grid;
  }
  void read_topology(openvdb::GridBase& grid) { grid.readTopology(stream_); }
  std::istream& stream() { return stream_; }

 private:
  MappedBytes bytes_;
  std::istream stream_;
  openvdb::io::StreamMetadata::Ptr meta_ = std::make_shared<openvdb::io::StreamMetadata>();
  openvdb::MetaMap of_file_;
  std::int32_t grids_ = 0;
};

GridFile::GridFile(const std::string& path) : path_(path) {
  try {
    archive_ = std::make_unique<Archive>(path);
    if (archive_->fileVersion() < oldest_version)
      throw_broken_vdb(path,
                       fmt::format("its version is {}, which is older than {}, that of OpenVDB 2.2; load "
                                   "it with a newer program, and save it",
                                   archive_->fileVersion(), oldest_version));
    if (archive_->fileVersion() > newest_version)
      throw_broken_vdb(path, fmt::format("its version is {}, and this program knows versions up to {}",
                                         archive_->fileVersion(), newest_version));
    grids_ = archive_->descriptors();
  } catch (const std::ios::failure&) {
    throw_broken_vdb(path, "ends early, or is damaged");
  } catch (const openvdb::Exception& error) {
    throw_broken_vdb(path, error.what());
  }
  if (grids_.empty()) throw BrokenInput(path + ": this OpenVDB file has no grid");
  if (archive_->grids() > 1 && !archive_->has_positions())
    throw_broken_vdb(
        path,
        "it was written to a stream, so it does not say where its grids are; write it to a file instead");
}

GridFile::~GridFile() = default;

const openvdb::io::GridDescriptor& GridFile::tree_of(const openvdb::io::GridDescriptor& grid) const {
  if (!grid.isInstance()) return grid;
  const auto parent =
      std::ranges::find(grids_, grid.instanceParentName(), &openvdb::io::GridDescriptor::uniqueName);
  if (parent == grids_.end() || parent->isInstance() || parent->gridType() != grid.gridType())
    throw_broken_vdb(path_, "a grid shares the tree of a grid that does not exist");
  return *parent;
}

GridLook GridFile::look_at(const openvdb::io::GridDescriptor& grid, const GridKind& kind) try {
  GridLook look;
  const openvdb::io::GridDescriptor& tree = tree_of(grid);
  {
    const auto whole = archive_->head_of(tree);
    archive_->read_topology(*whole);
    say_working();
    const auto active = whole->evalActiveVoxelBoundingBox();
    if (!active.empty()) look.active = {index(active.min()), index(active.max())};
    look.background = kind.background(*whole);
    look.memory = whole->memUsage() + whole->baseTree().leafCount() * memory_beside_leaf;
    kind.pass_over_leaves(*whole, archive_->stream());
    say_working();
  }
  give_back_free_memory();  // what is declared next counts what this program has
  look.grid = archive_->head_of(grid);
  return look;
} catch (const std::ios::failure&) {
  throw_broken_vdb(path_, "ends early, or is damaged");
} catch (const openvdb::Exception& error) {
  throw_broken_vdb(path_, error.what());
} catch (const std::bad_alloc&) {
  throw WorldError(
      fmt::format("{}: OpenVDB file: it is damaged, or large (1 GiB is enough for about 8 "
                  "million leaves): to describe this grid, its reader needs more memory than its limit",
                  path_),
      Problem::program_memory);
}

}  // namespace tagrid
