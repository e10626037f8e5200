#include "io/files/compressed_bytes.h"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
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
  char first;  ///< the first byte of a stream that follows another one; 0: what follows does not count
  std::uint64_t max_ratio;
  int window_bits = 0;  ///< of zlib, which also say which heads a stream may have
};

// Deflate expands one byte to at most 1032.
constexpr std::uint64_t ratio_of_deflate = 1040;
// A block of 900000 bytes is what is left of runs of up to 259 equal bytes, each of which takes 5. An empty
// block has more than 20 bytes.
constexpr std::uint64_t ratio_of_bzip2 = 900'000 / 5 * 259 / 20;
constexpr int either_head = 32;
// In the order of Compression.
constexpr std::array methods = {
    Method{"gzip", '\x1f', ratio_of_deflate, MAX_WBITS + either_head}, Method{"bzip2", 'B', ratio_of_bzip2},
    Method{"zlib", 0, ratio_of_deflate, MAX_WBITS}, Method{"deflate", 0, ratio_of_deflate, -MAX_WBITS}};

const Method& method_of(Compression compression) { return methods[static_cast<std::size_t>(compression)]; }

class DeflateDecoder final : public CompressedBytes::Decoder {
 public:
  DeflateDecoder(const std::string& name, const Method& method) : name_(name), method_(method) {
    if (inflateInit2(&z_, method.window_bits) != Z_OK) throw std::bad_alloc();
  }
  ~DeflateDecoder() override { inflateEnd(&z_); }

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
      throw BrokenInput("{}: the {} stream is damaged{}{}", name_, method_.name, z_.msg ? ": " : "",
                        z_.msg ? z_.msg : "");
    return result == Z_STREAM_END;
  }

 private:
  const std::string& name_;
  const Method& method_;
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

CompressedBytes::CompressedBytes(ByteStream& file, Compression compression)
    : file_(file), compression_(compression), input_(std::size_t{1} << 16) {
  if (compression == Compression::bzip2)
    decoder_ = std::make_unique<Bzip2Decoder>(file.name());
  else
    decoder_ = std::make_unique<DeflateDecoder>(file.name(), method_of(compression));
}

CompressedBytes::~CompressedBytes() = default;

std::uint64_t CompressedBytes::max_ratio() const { return method_of(compression_).max_ratio; }
const char* CompressedBytes::method() const { return method_of(compression_).name; }

void CompressedBytes::restart() {
  decoder_->restart();
  waiting_ = {};
  at_end_ = false;
}

/// Reads compressed bytes if none wait. False at the end of the file.
bool CompressedBytes::has_waiting() {
  if (waiting_.empty()) waiting_ = std::span(input_).first(file_.read(input_.data(), input_.size()));
  return !waiting_.empty();
}

/// At the end of a stream, starts the next one, if there is one: pbzip2 writes many.
bool CompressedBytes::next_stream() {
  const char first = method_of(compression_).first;
  if (first == 0 || !has_waiting()) return false;
  if (static_cast<char>(waiting_[0]) != first)
    throw BrokenInput("{}: there are bytes after the end of the {} stream", file_.name(), method());
  decoder_->restart();
  return true;
}

std::size_t CompressedBytes::read(std::byte* out, std::size_t size) {
  std::size_t done = 0;
  while (done < size && !at_end_) {
    if (!has_waiting()) throw BrokenInput("{}: the {} stream ends too soon", file_.name(), method());
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
  std::span<const std::byte> compressed = std::as_bytes(std::span(file.peek(FileBytes::peek_limit)));
  std::string beginning(size, '\0');
  std::span<std::byte> room = std::as_writable_bytes(std::span(beginning));
  try {
    DeflateDecoder(file.name(), method_of(Compression::gzip)).decode(compressed, room);
  } catch (const BrokenInput&) {
    // What was decoded before is good.
  }
  beginning.resize(size - room.size());
  return beginning;
}

}  // namespace tagrid
