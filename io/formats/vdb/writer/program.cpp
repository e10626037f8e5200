// tagrid-write-vdb: writes volumes as grids of OpenVDB files.

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/vdb/openvdb_library.h"
#include "io/formats/vdb/placement.h"
#include "io/formats/vdb/writer/grid_builder.h"
#include "io/metadata/text.h"
#include "io/programs/serve.h"
#include "io/programs/serve_writer.h"
#include "io/programs/words.h"
#include "io/text/text.h"
#include "stages/sample/value_rule.h"

namespace tagrid {
namespace {

/// A file that tells tagrid that this program still works, and keeps the reason of a failure.
class OutputBuffer final : public std::filebuf {
 public:
  int error() const { return error_; }

 private:
  int_type overflow(int_type c) override {
    say_working();
    const int_type result = std::filebuf::overflow(c);
    if (traits_type::eq_int_type(result, traits_type::eof())) error_ = errno;
    return result;
  }
  std::streamsize xsputn(const char* bytes, std::streamsize size) override {
    say_working();
    const std::streamsize count = std::filebuf::xsputn(bytes, size);
    if (count != size) error_ = errno;
    return count;
  }
  int sync() override {
    const int result = std::filebuf::sync();
    if (result != 0) error_ = errno;
    return result;
  }

  int error_ = 0;
};

class GridArchive final : public openvdb::io::Archive {
 public:
  void write_to(std::ostream& out, const openvdb::GridBase::Ptr& grid) {
    setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    openvdb::io::Archive::write(out, openvdb::GridCPtrVec{grid}, true);
  }
};

std::string identifier_of(std::uint64_t content) {
  const std::uint64_t other = chained_checksum(content, 0);
  const std::string digits = fmt::format("{:016x}{:016x}", content, other);
  return fmt::format("{}-{}-{}-{}-{}", digits.substr(0, 8), digits.substr(8, 4), digits.substr(12, 4),
                     digits.substr(16, 4), digits.substr(20));
}

// After the magic number, the versions of the format and of the library, and a flag.
constexpr std::streamoff place_of_identifier = 21;

/// Writes the grid to the existing file at `path`, compressed by Blosc, without inactive values. The file's
/// identifier, which the library makes at random, follows from `content` instead. Throws WorldError, which
/// calls the file `name`.
void write_grid(const openvdb::GridBase::Ptr& grid, std::uint64_t content, const std::string& path,
                const std::string& name) {
  OutputBuffer buffer;
  std::vector<char> bytes(std::size_t{1} << 20);
  buffer.pubsetbuf(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (buffer.open(path, std::ios::out | std::ios::binary | std::ios::trunc) == nullptr)
    throw world_error("cannot open a temporary file for it", name, errno);
  std::ostream out(&buffer);
  try {
    out.exceptions(std::ios::failbit | std::ios::badbit);
    GridArchive().write_to(out, grid);
    out.seekp(place_of_identifier);
    out << identifier_of(content);
    out.flush();
  } catch (const std::ios::failure&) {
    throw world_error("cannot write", name, buffer.error() != 0 ? buffer.error() : EIO);
  }
  if (buffer.close() == nullptr) throw world_error("cannot write", name, errno);
}

std::optional<double> number_option(const WriterOptions& options, const char* name) {
  const std::string text = option(options, name);
  if (text.empty()) return std::nullopt;
  const auto number = number_of(text);
  if (!number) throw UsageError("{} {}: is not a number", name, text);
  return number;
}

/// The voxel of the first sample: the same as in the grid from which the volume came, if it fits.
Index3 low_of(const Index3& dims, const Index3& wanted) {
  for (int axis = 0; axis < 3; ++axis)
    if (wanted[axis] + dims[axis] - 1 > std::numeric_limits<std::int32_t>::max()) return {};
  return wanted;
}

template <class G>
class VdbOutput final : public ServedOutput {
 public:
  using Value = typename G::ValueType;

  explicit VdbOutput(const WriteRequest& request)
      : request_(request), place_(vdb_place_of(request.info.metadata)) {
    const VolumeInfo& info = request.info;
    tolerance_ = number_option(request.options, "tolerance").value_or(0);
    max_error_ = number_option(request.options, "max-error");
    if (max_error_) *max_error_ += tolerance_;
    if (const auto wanted = number_option(request.options, "background")) {
      if (!is_value_of(info.type, *wanted))
        throw UsageError("{}: the background {} is not a value of type {}", request.name, *wanted,
                         name_of(info.type));
      background_ = wanted;
    } else if (place_.background && is_value_of(info.type, *place_.background)) {
      background_ = place_.background;
    }
    const std::string name = option(request.options, "grid");
    grid_ = !name.empty() ? name : !place_.grid.empty() ? place_.grid : "density";
    place_.low = low_of(info.dims, place_.low);
    box_ = {place_.low, place_.low + info.dims - Index3{1, 1, 1}};
    memory = GridBuilder<G>::memory(box_) + slice_samples() * sizeof(Value);
    try {
      transform_ = transform_of(info.geometry(), box_.low);
    } catch (const openvdb::Exception& error) {
      throw UsageError(
          "{}: OpenVDB cannot have these spacings or directions ({}); choose another format, or give "
          "the volume larger units",
          request.name, error.what());
    }
  }

  void write_slice(std::int64_t, const std::byte* samples) override {
    const SampleType type = request_.info.type;
    slice_.resize(slice_samples());
    content_.add({samples, slice_.size() * size_of(type)});
    with_sample_type(type, [&](auto sample) {
      using S = decltype(sample);
      for (std::size_t i = 0; i < slice_.size(); ++i)
        slice_[i] = static_cast<Value>(load_little_endian<S>(samples + i * sizeof(S)));
    });
    if (!builder_) {
      const auto first = static_cast<double>(slice_[0]);
      builder_.emplace(box_, static_cast<Value>(background_.value_or(std::isfinite(first) ? first : 0)),
                       tolerance_);
    }
    builder_->add(slice_);
  }

  std::vector<std::pair<std::string, std::string>> finish() override {
    const VolumeInfo& info = request_.info;
    const auto grid = builder_->finish();
    grid->setName(grid_);
    grid->setGridClass(G::stringToGridClass(place_.grid_class));
    grid->setTransform(transform_);
    grid->insertMeta(vdb_dims_key, openvdb::Vec3IMetadata(openvdb::Vec3i(static_cast<int>(info.dims.x),
                                                                         static_cast<int>(info.dims.y),
                                                                         static_cast<int>(info.dims.z))));
    if (max_error_) grid->insertMeta(vdb_error_key, openvdb::DoubleMetadata(*max_error_));
    grid->insertMeta(vdb_fields_key, openvdb::StringMetadata(text_of(info.metadata)));
    grid->insertMeta(vdb_type_key, openvdb::StringMetadata(std::string(name_of(info.type))));
    const auto background = static_cast<double>(grid->background());
    const std::string known =
        fmt::format("{} {} {} {} {}", grid_, background, tolerance_, G::gridType(), text_of(info.metadata));
    content_.add(std::as_bytes(std::span(known)));
    write_grid(grid, content_.value(), request_.path, request_.name);
    return {{"grid", nlohmann::json(grid_).dump()},
            {"background", nlohmann::json(background).dump()},
            {"tolerance", nlohmann::json(tolerance_).dump()},
            {"max_error", max_error_ ? nlohmann::json(*max_error_).dump() : "null"},
            {"active_voxels", fmt::format("{}", grid->activeVoxelCount())},
            {"leaves", fmt::format("{}", grid->tree().leafCount())}};
  }

 private:
  std::size_t slice_samples() const {
    return static_cast<std::size_t>(request_.info.dims.x * request_.info.dims.y);
  }

  WriteRequest request_;
  VdbPlace place_;
  std::string grid_;
  std::optional<double> background_, max_error_;
  double tolerance_ = 0;
  Box box_;
  openvdb::math::Transform::Ptr transform_;
  std::vector<Value> slice_;
  std::optional<GridBuilder<G>> builder_;
  RunningChecksum content_;
};

/// Begins a grid. Options, all of them texts:
///   grid        its name; by default that of the grid from which the volume came, or "density"
///   background  the value of inactive voxels; by default that of the grid, or the value of the first sample,
///               which lies outside the body in most scans
///   tolerance   samples at most this far from the background become the background; 0 by default
///   type        float or int32: what samples of 8 and 16 bits are stored as; float by default
///   max-error   the largest error that the samples already have; absent if there is no bound
/// int32 and floats are stored unchanged, uint32 as double. The entire tree is in memory until the file is
/// written.
std::unique_ptr<ServedOutput> begin_vdb(const WriteRequest& request) {
  const SampleType type = request.info.type;
  const bool is_short = size_of(type) <= 2;
  const std::string wanted = option(request.options, "type");
  if (!wanted.empty() && wanted != "float" && wanted != "int32")
    throw UsageError("{}: the type of a grid is float or int32, not {}", request.name, wanted);
  const bool as_float = wanted == "float", as_int32 = wanted == "int32";
  if ((as_float && !is_short && type != SampleType::float32) ||
      (as_int32 && !is_short && type != SampleType::int32))
    throw UsageError("{}: samples of type {} cannot be stored exactly as {}", request.name, name_of(type),
                     wanted);
  if (as_int32 || type == SampleType::int32) return std::make_unique<VdbOutput<openvdb::Int32Grid>>(request);
  if (is_short || type == SampleType::float32)
    return std::make_unique<VdbOutput<openvdb::FloatGrid>>(request);
  return std::make_unique<VdbOutput<openvdb::DoubleGrid>>(request);
}

}  // namespace
}  // namespace tagrid

int main() {
  const tagrid::OpenVdbLibrary library;
  return tagrid::serve_writer("vdb", tagrid::begin_vdb);
}
