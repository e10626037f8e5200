#include "io/files/compressed_bytes.h"

#include <bzlib.h>
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <new>
#include <string_view>

#include "io/errors/errors.h"

namespace tagrid {

/// The part that a library does.
class CompressedBytes::Decoder {
 public:
  virtual ~Decoder() = default;
  /// Begins a new stream.
  virtual void restart() = 0;
  /// Decompresses some of `in`, and removes from both spans what was read and written. Returns true at the
  /// end of a stream. Throws BrokenInput.
  virtual bool decode(std::span<const std::byte>& in, std::span<std::byte>& out) = 0;
};

namespace {

struct Method {
  const char* name;
  char first;  ///< the first byte of a stream that follows another one
  std::uint64_t max_ratio;
};

// Deflate expands one byte to at most 1032.
constexpr Method gzip = {"gzip", '\x1f', 1040};
// A block of 900000 bytes is what is left of runs of up to 259 equal bytes, each of which takes 5. An empty
// block has more than 20 bytes.
constexpr Method bzip2 = {"bzip2", 'B', 900'000 / 5 * 259 / 20};

const Method& method_of(Compression compression) { return compression == Compression::gzip ? gzip : bzip2; }

constexpr int gzip_or_zlib = 15 + 32;

class GzipDecoder final : public CompressedBytes::Decoder {
 public:
  explicit GzipDecoder(const std::string& name) : name_(name) {
    if (inflateInit2(&z_, gzip_or_zlib) != Z_OK) throw std::bad_alloc();
  }
  ~GzipDecoder() override { inflateEnd(&z_); }

  void restart() override { inflateReset(&z_); }

  bool decode(std::span<const std::byte>& in, std::span<std::byte>& out) override {
    z_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(in.data()));  // zlib does not write there
    z_.avail_in = static_cast<uInt>(in.size());
    z_.next_out = reinterpret_cast<Bytef*>(out.data());
    z_.avail_out = static_cast<uInt>(out.size());
    const int result = inflate(&z_, Z_NO_FLUSH);
    in = in.last(z_.avail_in);
    out = out.last(z_.avail_out);
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    if (result != Z_OK && result != Z_BUF_ERROR && result != Z_STREAM_END)
      throw BrokenInput(
          fmt::format("{}: the gzip stream is damaged{}{}", name_, z_.msg ? ": " : "", z_.msg ? z_.msg : ""));
    return result == Z_STREAM_END;
  }

 private:
  const std::string& name_;
  z_stream z_ = {};
};

/// libbz2 allocates the tables of a stream when it has read the size of its blocks.
class Bzip2Decoder final : public CompressedBytes::Decoder {
 public:
  explicit Bzip2Decoder(const std::string& name) : name_(name) { begin(); }
  ~Bzip2Decoder() override { BZ2_bzDecompressEnd(&z_); }

  void restart() override {
    BZ2_bzDecompressEnd(&z_);
    begin();
  }

  bool decode(std::span<const std::byte>& in, std::span<std::byte>& out) override {
    z_.next_in = reinterpret_cast<char*>(const_cast<std::byte*>(in.data()));  // libbz2 does not write there
    z_.avail_in = static_cast<unsigned>(in.size());
    z_.next_out = reinterpret_cast<char*>(out.data());
    z_.avail_out = static_cast<unsigned>(out.size());
    const int result = BZ2_bzDecompress(&z_);
    in = in.last(z_.avail_in);
    out = out.last(z_.avail_out);
    if (result == BZ_MEM_ERROR) throw std::bad_alloc();
    if (result != BZ_OK && result != BZ_STREAM_END)
      throw BrokenInput(name_ + (result == BZ_DATA_ERROR_MAGIC ? ": is not a bzip2 stream"
                                                               : ": the bzip2 stream is damaged"));
    return result == BZ_STREAM_END;
  }

 private:
  void begin() {
    if (BZ2_bzDecompressInit(&z_, 0, 0) != BZ_OK) throw std::bad_alloc();
  }

  const std::string& name_;
  bz_stream z_ = {};
};

}  // namespace

CompressedBytes::CompressedBytes(FileBytes& file, Compression compression)
    : file_(file), compression_(compression), input_(std::size_t{1} << 16) {
  if (compression == Compression::bzip2)
    decoder_ = std::make_unique<Bzip2Decoder>(file.name());
  else
    decoder_ = std::make_unique<GzipDecoder>(file.name());
}

CompressedBytes::~CompressedBytes() = default;

std::uint64_t CompressedBytes::max_ratio() const { return method_of(compression_).max_ratio; }
const char* CompressedBytes::method() const { return method_of(compression_).name; }

void CompressedBytes::restart() {
  decoder_->restart();
  waiting_ = {};
  at_end_ = false;
}

/// At the end of a stream, starts the next one, if there is one: pbzip2 writes many.
bool CompressedBytes::next_stream() {
  const std::string_view next =
      waiting_.empty() ? file_.peek(1) : std::string_view(reinterpret_cast<const char*>(waiting_.data()), 1);
  if (next.empty()) return false;
  if (next[0] != method_of(compression_).first)
    throw BrokenInput(
        fmt::format("{}: there are bytes after the end of the {} stream", file_.name(), method()));
  decoder_->restart();
  return true;
}

std::size_t CompressedBytes::read(std::byte* out, std::size_t size) {
  std::size_t done = 0;
  while (done < size && !at_end_) {
    if (waiting_.empty()) {
      waiting_ = std::span(input_).first(file_.read(input_.data(), input_.size()));
      if (waiting_.empty())
        throw BrokenInput(fmt::format("{}: the {} stream ends too soon", file_.name(), method()));
    }
    const std::size_t most = std::min(size - done, std::size_t{1} << 30);
    std::span<std::byte> room(out + done, most);
    const bool has_ended = decoder_->decode(waiting_, room);
    done += most - room.size();
    if (has_ended) at_end_ = !next_stream();
  }
  return done;
}

bool begins_gzip(FileBytes& file) { return file.peek(3) == "\x1f\x8b\x08"; }
bool begins_bzip2(FileBytes& file) { return file.peek(3) == "BZh"; }

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
