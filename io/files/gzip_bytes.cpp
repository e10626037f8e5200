#include "io/files/gzip_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <new>
#include <vector>

#include "io/errors/errors.h"

namespace tagrid {

struct GzipBytes::Stream {
  z_stream z = {};
  std::vector<std::byte> input = std::vector<std::byte>(std::size_t{1} << 16);
  bool at_end = false;
};

namespace {
constexpr int gzip_or_zlib = 15 + 32;
}

GzipBytes::GzipBytes(FileBytes& file) : file_(file), stream_(std::make_unique<Stream>()) {
  if (inflateInit2(&stream_->z, gzip_or_zlib) != Z_OK) throw std::bad_alloc();
}

GzipBytes::~GzipBytes() { inflateEnd(&stream_->z); }

void GzipBytes::restart() {
  inflateReset(&stream_->z);
  stream_->z.avail_in = 0;
  stream_->at_end = false;
}

/// At the end of a member, starts the next one, if there is one.
bool GzipBytes::next_member() {
  z_stream& z = stream_->z;
  const std::string_view next =
      z.avail_in > 0 ? std::string_view(reinterpret_cast<const char*>(z.next_in), 1) : file_.peek(1);
  if (next.empty()) return false;
  if (next[0] != '\x1f')
    throw BrokenInput(file_.name() + ": there are bytes after the end of the gzip stream");
  inflateReset(&z);
  return true;
}

std::size_t GzipBytes::read(std::byte* out, std::size_t size) {
  z_stream& z = stream_->z;
  std::size_t done = 0;
  while (done < size && !stream_->at_end) {
    if (z.avail_in == 0) {
      const std::size_t count = file_.read(stream_->input.data(), stream_->input.size());
      if (count == 0) throw BrokenInput(file_.name() + ": the gzip stream ends too soon");
      z.next_in = reinterpret_cast<Bytef*>(stream_->input.data());
      z.avail_in = static_cast<uInt>(count);
    }
    const auto room = static_cast<uInt>(std::min(size - done, std::size_t{1} << 30));
    z.next_out = reinterpret_cast<Bytef*>(out + done);
    z.avail_out = room;
    const int result = inflate(&z, Z_NO_FLUSH);
    done += room - z.avail_out;
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    if (result == Z_STREAM_END)
      stream_->at_end = !next_member();
    else if (result != Z_OK && result != Z_BUF_ERROR)
      throw BrokenInput(file_.name() + ": the gzip stream is damaged" +
                        (z.msg ? std::string(": ") + z.msg : ""));
  }
  return done;
}

bool begins_gzip(FileBytes& file) { return file.peek(3) == "\x1f\x8b\x08"; }

std::string beginning_of_gzip(FileBytes& file, std::size_t size) {
  // Enough for the tables of a deflate block, and for any name of a file in the header.
  const std::string_view compressed = file.peek(FileBytes::peek_limit);
  std::string beginning(size, '\0');
  z_stream z = {};
  if (inflateInit2(&z, gzip_or_zlib) != Z_OK) throw std::bad_alloc();
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(compressed.data()));  // zlib does not write there
  z.avail_in = static_cast<uInt>(compressed.size());
  z.next_out = reinterpret_cast<Bytef*>(beginning.data());
  z.avail_out = static_cast<uInt>(size);
  inflate(&z, Z_SYNC_FLUSH);
  beginning.resize(size - z.avail_out);
  inflateEnd(&z);
  return beginning;
}

}  // namespace tagrid
