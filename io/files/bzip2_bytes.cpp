#include "io/files/bzip2_bytes.h"

#include <bzlib.h>

#include <algorithm>
#include <new>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"

namespace tagrid {

/// libbz2 allocates the tables of a stream when it has read the size of its blocks.
struct Bzip2Bytes::Stream {
  Stream() { begin(); }
  ~Stream() { BZ2_bzDecompressEnd(&z); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void begin() {
    if (BZ2_bzDecompressInit(&z, 0, 0) != BZ_OK) throw std::bad_alloc();
  }
  void begin_again() {
    BZ2_bzDecompressEnd(&z);
    begin();
  }

  bz_stream z = {};
  std::vector<char> input = std::vector<char>(std::size_t{1} << 16);
  bool at_end = false;
};

Bzip2Bytes::Bzip2Bytes(FileBytes& file) : file_(file), stream_(std::make_unique<Stream>()) {}

Bzip2Bytes::~Bzip2Bytes() = default;

void Bzip2Bytes::restart() {
  stream_->begin_again();
  stream_->z.avail_in = 0;
  stream_->at_end = false;
}

/// At the end of a stream, starts the next one, if there is one: pbzip2 writes many.
bool Bzip2Bytes::next_stream() {
  bz_stream& z = stream_->z;
  const std::string_view next = z.avail_in > 0 ? std::string_view(z.next_in, 1) : file_.peek(1);
  if (next.empty()) return false;
  if (next[0] != 'B') throw BrokenInput(file_.name() + ": there are bytes after the end of the bzip2 stream");
  stream_->begin_again();
  return true;
}

std::size_t Bzip2Bytes::read(std::byte* out, std::size_t size) {
  bz_stream& z = stream_->z;
  std::size_t done = 0;
  while (done < size && !stream_->at_end) {
    if (z.avail_in == 0) {
      const std::size_t count =
          file_.read(reinterpret_cast<std::byte*>(stream_->input.data()), stream_->input.size());
      if (count == 0) throw BrokenInput(file_.name() + ": the bzip2 stream ends too soon");
      z.next_in = stream_->input.data();
      z.avail_in = static_cast<unsigned>(count);
    }
    const auto room = static_cast<unsigned>(std::min(size - done, std::size_t{1} << 30));
    z.next_out = reinterpret_cast<char*>(out + done);
    z.avail_out = room;
    const int result = BZ2_bzDecompress(&z);
    done += room - z.avail_out;
    if (result == BZ_MEM_ERROR) throw std::bad_alloc();
    if (result == BZ_STREAM_END)
      stream_->at_end = !next_stream();
    else if (result != BZ_OK)
      throw BrokenInput(file_.name() + (result == BZ_DATA_ERROR_MAGIC ? ": is not a bzip2 stream"
                                                                      : ": the bzip2 stream is damaged"));
  }
  return done;
}

bool begins_bzip2(FileBytes& file) { return file.peek(3) == "BZh"; }

}  // namespace tagrid
