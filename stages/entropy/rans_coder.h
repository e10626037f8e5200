// Entropy coder: asymmetric numeral systems (J. Duda, "Asymmetric numeral systems: entropy coding combining
// speed of Huffman coding with compression rate of arithmetic coding", 2013), in its range variant. Coding
// goes from the last event to the first, so that decoding can go forward.
//
// Both directions have the same member functions: code(bit, p) returns the bit, which the caller gives when
// encoding and which is ignored when decoding. So a model is written once, as a template over the coder.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace tagrid {

/// A state is in [rans_low, rans_low << 16): it has 47 bits, so that Reciprocals divides it exactly.
inline constexpr std::uint64_t rans_low = std::uint64_t{1} << 31;

/// The part of [0, 65536) that stands for an event.
struct Interval {
  std::uint16_t start;
  std::uint16_t length;  ///< not 0
};

/// Collects the events; finish() codes them from the last to the first and appends the stream to `out`.
class RansEncoder {
 public:
  static constexpr bool encoding = true;
  static constexpr std::size_t chunk_size = 8192;  ///< events that are allocated together

  explicit RansEncoder(std::vector<std::uint8_t>& out) : out_(out) {}

  void code_interval(Interval event) {
    if (count_ == chunk_size) [[unlikely]]
      begin_chunk();
    events_[count_++] = event;
  }

  /// Codes `bit`; the probability of a one is `p` / 65536. REQUIRES: 0 < p < 65536.
  bool code(bool bit, std::uint32_t p) {
    code_interval(bit ? Interval{0, static_cast<std::uint16_t>(p)}
                      : Interval{static_cast<std::uint16_t>(p), static_cast<std::uint16_t>(65536 - p)});
    return bit;
  }

  /// Codes the low `bits` bits of `value`, all equally probable. REQUIRES: bits <= 16, value < 2^bits.
  std::uint32_t code_raw(std::uint32_t value, int bits) {
    if (bits > 0)
      code_interval(
          {static_cast<std::uint16_t>(value << (16 - bits)), static_cast<std::uint16_t>(1u << (16 - bits))});
    return value;
  }

  /// Like RansDecoder::exhausted(), for code that both directions share.
  static constexpr bool exhausted() { return false; }

  void finish();

  /// The peak of the heap for this number of events. It is reached when finish() begins: the events in whole
  /// chunks, the list of chunks, and a word for each event. The stream has at most a word for each event. It
  /// is made after the events are freed, and is counted twice because it grows by copying.
  static constexpr std::uint64_t working_bytes(std::uint64_t events) {
    const std::uint64_t chunks = events / chunk_size + 1;
    return chunks * (chunk_size * sizeof(Interval) + 3 * sizeof(Chunk)) + events * sizeof(std::uint16_t) + 64;
  }

 private:
  using Chunk = std::unique_ptr<Interval[]>;

  void begin_chunk();

  std::vector<std::uint8_t>& out_;
  // Chunks, so that nothing moves as events come. Only the last one is not full; at first there is none.
  Interval* events_ = nullptr;
  std::size_t count_ = chunk_size;
  std::vector<Chunk> chunks_;
};

/// Reads what RansEncoder wrote. Safe on any bytes: past the end it reads zeros, and finished() returns
/// false.
class RansDecoder {
 public:
  static constexpr bool encoding = false;

  explicit RansDecoder(std::span<const std::uint8_t> bytes);

  /// Position in [0, 65536) of the next event. Call advance() next, with the interval that contains it.
  std::uint32_t slot() const { return static_cast<std::uint32_t>(state_ & 0xffff); }
  void advance(std::uint32_t start, std::uint32_t length) {
    state_ = (state_ >> 16) * length + (state_ & 0xffff) - start;
    if (state_ < rans_low) state_ = state_ << 16 | take();
  }

  bool code(bool, std::uint32_t p) {
    const bool bit = slot() < p;
    advance(bit ? 0 : p, bit ? p : 65536 - p);
    return bit;
  }

  std::uint32_t code_raw(std::uint32_t, int bits) {
    if (bits == 0) return 0;
    const std::uint32_t value = slot() >> (16 - bits);
    advance(value << (16 - bits), 1u << (16 - bits));
    return value;
  }

  /// True if all bytes have been used, no more, and the state is the encoder's first one.
  bool finished() const { return position_ == bytes_.size() && state_ == rans_low; }
  /// True once more bytes were requested than there are; then decoding the rest is useless.
  bool exhausted() const { return position_ > bytes_.size(); }

 private:
  std::uint64_t take() {
    const std::size_t at = position_;
    position_ += 2;
    return position_ <= bytes_.size() ? bytes_[at] | std::uint64_t{bytes_[at + 1]} << 8 : 0;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  std::uint64_t state_;
};

/// Division by multiplication (T. Granlund and P. Montgomery, "Division by invariant integers using
/// multiplication", 1994). A division would take longer than everything else that is done for an event.
class Reciprocals {
 public:
  Reciprocals() : of_(65536) {
    for (std::uint64_t divisor = 1; divisor < of_.size(); ++divisor)
      of_[divisor] = ((std::uint64_t{1} << 63) + divisor - 1) / divisor;  // ceil(2^63 / divisor)
  }

  /// dividend / divisor, rounded down. REQUIRES: dividend < 2^47, 0 < divisor < 2^16. The result is exact:
  /// the reciprocal is too large by less than 1, so the product is too large by less than 2^47, which is less
  /// than 2^63 / divisor.
  std::uint64_t divide(std::uint64_t dividend, std::uint64_t divisor) const {
    __extension__ using Wide = unsigned __int128;
    return static_cast<std::uint64_t>(Wide{dividend} * 2 * of_[divisor] >> 64);
  }

 private:
  std::vector<std::uint64_t> of_;
};

// An encoder for code that is one of several: it gives up when the code becomes too long to be chosen.

/// Codes about `most` events: callers ask exhausted() from time to time, and then stop.
class LimitedEncoder {
 public:
  static constexpr bool encoding = true;
  LimitedEncoder(std::vector<std::uint8_t>& out, std::uint64_t most) : coder_(out), left_(most) {}

  bool code(bool bit, std::uint32_t p) {
    count();
    return coder_.code(bit, p);
  }
  std::uint32_t code_raw(std::uint32_t value, int bits) {
    count();
    return coder_.code_raw(value, bits);
  }
  bool exhausted() const { return left_ == 0; }
  void finish() { coder_.finish(); }

 private:
  void count() { left_ -= left_ > 0; }

  RansEncoder coder_;
  std::uint64_t left_;
};

}  // namespace tagrid
