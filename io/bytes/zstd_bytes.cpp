#include "io/bytes/zstd_bytes.h"

#include <zstd.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <stdexcept>
#include <string>

#include "io/bytes/little_endian.h"

namespace tagrid {
namespace {

// 2^10 is the smallest window that zstd knows; 2^27 is the largest that its own program reads by default.
constexpr int smallest_window_log = 10, largest_window_log = 27;

}  // namespace

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes) {
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 9);
  if (ZSTD_isError(size)) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

Status zstd_decompress(std::span<const std::byte> bytes, std::size_t size, std::vector<std::byte>& out) {
  out.clear();
  const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> stream(ZSTD_createDStream(),
                                                                             ZSTD_freeDStream);
  if (!stream) throw std::bad_alloc();
  if (bytes.size() < 4 || load_little_endian<std::uint32_t>(bytes.data()) != ZSTD_MAGICNUMBER)
    return Status::broken("this is not a zstd frame");
  // The window that a frame asks for is allocated at once: limit it to the size of the content.
  const auto window_log = std::clamp(static_cast<int>(std::bit_width(size > 0 ? size - 1 : 0)),
                                     smallest_window_log, largest_window_log);
  if (ZSTD_isError(ZSTD_DCtx_setParameter(stream.get(), ZSTD_d_windowLogMax, window_log)))
    throw std::logic_error("zstd does not know its own limits");
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  const std::size_t step = ZSTD_DStreamOutSize();
  for (;;) {
    // One more byte than expected would show.
    const std::size_t have = out.size(), room = have + std::min(step, size - have + 1);
    if (room > out.capacity()) out.reserve(std::min(2 * have + step, size + 1));
    out.resize(room);
    ZSTD_outBuffer target{out.data() + have, out.size() - have, 0};
    const std::size_t result = ZSTD_decompressStream(stream.get(), &target, &in);
    out.resize(have + target.pos);
    if (ZSTD_isError(result)) return Status::broken(std::string("zstd: ") + ZSTD_getErrorName(result));
    if (out.size() > size) return Status::broken("more bytes than announced");
    if (result == 0) break;
    if (target.pos == 0 && in.pos == in.size) return Status::broken("compressed bytes end too soon");
  }
  if (out.size() != size || in.pos != in.size) return Status::broken("not as many bytes as announced");
  return {};
}

}  // namespace tagrid
