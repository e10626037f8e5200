#include "tools/formats/vdb/writer/grid_archive.h"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/programs/serve.h"

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

}  // namespace

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

}  // namespace tagrid
