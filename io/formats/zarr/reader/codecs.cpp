#include "io/formats/zarr/reader/codecs.h"

#include <blosc.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/formats/zarr/crc32c.h"

namespace tagrid {
namespace {

constexpr std::size_t crc_bytes = 4;

BrokenInput damaged(const std::string& name, const char* codec) {
  return BrokenInput("{}: is damaged: its {} data cannot be decompressed", name, codec);
}

BrokenInput of_other_size(const std::string& name, std::uint64_t size) {
  return BrokenInput("{}: has not the {} bytes that its array says; it may be truncated", name, size);
}

std::vector<std::byte> from_blosc(std::span<const std::byte> in, std::uint64_t size,
                                  const std::string& name) {
  std::size_t has = 0;
  if (in.size() < BLOSC_MIN_HEADER_LENGTH || blosc_cbuffer_validate(in.data(), in.size(), &has) < 0)
    throw damaged(name, "Blosc");
  if (has != size) throw of_other_size(name, size);
  std::vector<std::byte> out(memory_size(size));
  if (size > 0 && blosc_decompress_ctx(in.data(), out.data(), out.size(), 1) != static_cast<int>(size))
    throw damaged(name, "Blosc");
  return out;
}

std::vector<std::byte> from_zstd(std::span<const std::byte> in, std::uint64_t size, const std::string& name) {
  std::vector<std::byte> out(memory_size(size));
  const std::size_t has = ZSTD_decompress(out.data(), out.size(), in.data(), in.size());
  if (ZSTD_isError(has) != 0) throw damaged(name, "zstd");
  if (has != size) throw of_other_size(name, size);
  return out;
}

std::vector<std::byte> from_zlib(std::span<const std::byte> in, std::uint64_t size, const std::string& name) {
  SourceStream stored(std::make_shared<BytesInMemory>(in, name));
  CompressedBytes stream(stored, Compression::gzip);
  std::vector<std::byte> out(memory_size(size));
  std::byte beyond{};
  if (stream.read(out.data(), out.size()) != size || stream.read(&beyond, 1) > 0)
    throw of_other_size(name, size);
  return out;
}

void take_crc(std::vector<std::byte>& bytes, const std::string& name) {
  if (bytes.size() < crc_bytes) throw BrokenInput(name + ": is truncated");
  const std::size_t size = bytes.size() - crc_bytes;
  if (load_little_endian<std::uint32_t>(&bytes[size]) != crc32c(std::span(bytes).first(size)))
    throw BrokenInput(name + ": is damaged: its checksum is another one");
  bytes.resize(size);
}

}  // namespace

std::vector<std::byte> decompressed(std::vector<std::byte> stored, std::span<const ZarrCodec> codecs,
                                    std::uint64_t size, const std::string& name) {
  for (std::size_t i = codecs.size(); i-- > 0;) {
    if (codecs[i] == ZarrCodec::crc32c) {
      take_crc(stored, name);
      continue;
    }
    const std::uint64_t before =
        size + crc_bytes * static_cast<std::uint64_t>(std::ranges::count(codecs.first(i), ZarrCodec::crc32c));
    stored = codecs[i] == ZarrCodec::blosc  ? from_blosc(stored, before, name)
             : codecs[i] == ZarrCodec::zstd ? from_zstd(stored, before, name)
                                            : from_zlib(stored, before, name);
  }
  if (stored.size() != size) throw of_other_size(name, size);
  return stored;
}

}  // namespace tagrid
