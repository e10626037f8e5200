#include "stages/values/wavefront/code.h"

#include "stages/entropy/adaptive_bit.h"
#include "stages/values/wavefront/buffers.h"
#include "stages/values/wavefront/words.h"

namespace tagrid {
namespace {

/// The first byte of the values. A brick with few symbols has one state for all lanes, which takes less room.
constexpr std::uint8_t one_state = 1, many_states = 2, one_that_carries = 4, many_that_carry = 5;

/// Codes which rows are quiet, in raster order, in the context of the row above, and of the same row and the
/// one below in the slice before.
template <class Coder>
void code_quiet_rows(Coder& coder, const Schedule& s, RowSet& quiet) {
  std::array<AdaptiveBit, 8> models{};
  const auto group = [&](std::int64_t y, std::int64_t z) -> std::uint16_t& {
    return quiet[static_cast<std::size_t>(z & 1)]
                [static_cast<std::size_t>(z / 2 * s.groups + y / wave_lanes)];
  };
  const auto is_quiet = [&](std::int64_t y, std::int64_t z) -> std::size_t {
    if (y < 0 || y >= s.size.y || z < 0) return 1;
    return group(y, z) >> (y % wave_lanes) & 1;
  };
  for (std::int64_t z = 0; z < s.size.z; ++z)
    for (std::int64_t y = 0; y < s.size.y; ++y) {
      const std::size_t context = is_quiet(y, z - 1) | is_quiet(y - 1, z) << 1 | is_quiet(y + 1, z - 1) << 2;
      const bool row = code_adaptive(coder, is_quiet(y, z) != 0, models[context], 250);
      auto& rows = group(y, z);
      const auto lane = static_cast<std::uint16_t>(1u << (y % wave_lanes));
      rows = static_cast<std::uint16_t>(row ? rows | lane : rows & ~lane);
    }
}

void append_size(std::size_t size, std::vector<std::uint8_t>& out) {
  for (; size >= 128; size >>= 7) out.push_back(static_cast<std::uint8_t>(size | 128));
  out.push_back(static_cast<std::uint8_t>(size));
}

/// Takes a size and then as many bytes from the beginning of `bytes`; returns false if there are not as many.
bool take_part(std::span<const std::uint8_t>& bytes, std::span<const std::uint8_t>& part) {
  std::size_t size = 0, at = 0;
  for (int shift = 0;; shift += 7) {
    if (at == bytes.size() || shift > 56) return false;
    size |= static_cast<std::size_t>(bytes[at] & 127) << shift;
    if (bytes[at++] < 128) break;
  }
  if (size > bytes.size() - at) return false;
  part = bytes.subspan(at, size);
  bytes = bytes.subspan(at + size);
  return true;
}

}  // namespace

PendingWave begin_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction,
                       void (*code_parameters)(RansEncoder&, VoxelParameters)) {
  PendingWave wave{{}, encode_wave(brick, samples, reconstruction)};
  RansEncoder coder(wave.head);
  code_parameters(coder, brick.parameters);
  code_quiet_rows(coder, Schedule(brick.size), wave.symbols.buffers.quiet);
  coder.finish();
  return wave;
}

std::size_t append_wave(PendingWave wave, std::span<const std::uint8_t> to_carry,
                        std::vector<std::uint8_t>& out) {
  const WaveCode code = push_symbols(wave.symbols, to_carry);
  wave.symbols.buffers.memory.reset();
  const std::vector<std::uint8_t>&head = wave.head, &bits = wave.symbols.bits;
  constexpr std::size_t most_of_sizes = 18;
  out.reserve(out.size() + 1 + most_of_sizes + head.size() + bits.size() + 2 * code.words.size());
  if (code.carried == 0)
    out.push_back(code.single ? one_state : many_states);
  else
    out.push_back(code.single ? one_that_carries : many_that_carry);
  append_size(head.size(), out);
  out.insert(out.end(), head.begin(), head.end());
  append_size(bits.size(), out);
  out.insert(out.end(), bits.begin(), bits.end());
  for (const std::uint16_t word : code.words) {
    out.push_back(static_cast<std::uint8_t>(word));
    out.push_back(static_cast<std::uint8_t>(word >> 8));
  }
  return code.carried;
}

Status read_wave(std::span<const std::uint8_t> bytes, WaveBrick& brick, RowWriter samples,
                 bool (*decode_parameters)(RansDecoder&, VoxelParameters&),
                 std::vector<std::uint8_t>& carried) {
  const std::uint8_t kind = bytes[0];
  const bool single = kind == one_state || kind == one_that_carries,
             carries = kind == one_that_carries || kind == many_that_carry;
  if (!single && !carries && kind != many_states) return Status::newer("values of an unknown kind");
  bytes = bytes.subspan(1);
  WaveBytes code;
  code.single = single;
  code.carries = carries;
  std::span<const std::uint8_t> head;
  if (!take_part(bytes, head) || !take_part(bytes, code.bits)) return Status::broken("values end too soon");
  code.words = bytes;
  RansDecoder coder(head);
  if (!decode_parameters(coder, brick.parameters)) return Status::broken("values with impossible parameters");
  const Schedule schedule(brick.size);
  for (auto& half : code.quiet) half.assign(static_cast<std::size_t>(schedule.all_groups), 0xffff);
  code_quiet_rows(coder, schedule, code.quiet);
  if (!coder.finished()) return Status::broken("values with wrong flags of rows");
  if (!decode_wave(brick, code, samples, carried)) return Status::broken("invalid value stream");
  return {};
}

namespace {

// The stream of noise is a little longer than its samples, more so while the models are new.
std::uint64_t longest_stream(SampleType type, Index3 size) {
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * size_of(type) * 5 / 4 + 16384;
}

}  // namespace

std::uint64_t working_bytes_of_encoding_wave(SampleType type, Index3 size) {
  const auto steps = static_cast<std::uint64_t>(2 * Schedule(size).all_steps);
  // The stream is there as chunks, as words, and as the bytes that are appended, which grow by copying. A
  // step keeps 64 bytes of low bits.
  return WaveBuffers::bytes(size, true, true) + 5 * longest_stream(type, size) + 72 * steps +
         2 * WordsBackward::chunk_size * sizeof(std::uint16_t);
}

std::uint64_t working_bytes_of_pending_wave(SampleType type, Index3 size) {
  const auto steps = static_cast<std::uint64_t>(2 * Schedule(size).all_steps);
  // There are the bits of residuals without a symbol, and low bits.
  return WaveBuffers::bytes(size, true, true) + 2 * longest_stream(type, size) + 72 * steps;
}

std::uint64_t working_bytes_of_decoding_wave(Index3 size) { return WaveBuffers::bytes(size, false, true); }

}  // namespace tagrid
