#include "stages/values/few/labels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>

#include "stages/entropy/adaptive_bit.h"
#include "stages/entropy/rans_coder.h"

namespace tagrid {

namespace {

/// Four labels, the first one in the lowest bits.
std::uint64_t four(const std::uint16_t* labels) {
  std::uint64_t result;
  std::memcpy(&result, labels, sizeof result);
  if constexpr (std::endian::native == std::endian::big)
    result = std::uint64_t{labels[0]} | std::uint64_t{labels[1]} << 16 | std::uint64_t{labels[2]} << 32 |
             std::uint64_t{labels[3]} << 48;
  return result;
}

/// A bit for each of 64 voxels: 1 where the labels above and behind agree: here, after this one, and in the row
/// after this one. Four at a time.
std::uint64_t calm_voxels(const std::uint16_t* above, const std::uint16_t* behind,
                          const std::uint16_t* below_behind) {
  constexpr std::uint64_t low = 0x7fff7fff7fff7fff;
  std::uint64_t calm = 0;
  for (std::size_t x = 0; x < 64; x += 4) {
    const std::uint64_t here = four(above + x);
    const std::uint64_t differ = (four(behind + x) ^ here) | (four(above + x + 1) ^ here) |
                                 (four(behind + x + 1) ^ here) | (four(below_behind + x) ^ here);
    const std::uint64_t equal = ~(((differ & low) + low) | differ | low) >> 15;
    calm |= (equal * 0x1000200040008 >> 48 & 15) << x;
  }
  return calm;
}

/// The labels of a slice and of those around it.
class LabelSlice {
 public:
  explicit LabelSlice(Index3 size)
      : stride_((static_cast<std::size_t>(size.x) + 63) / 64 * 64 + 4),
        rows_(static_cast<std::size_t>(size.y) + 3),
        labels_(stride_ * rows_) {}

  /// Row y from -2 to the number of rows; its x are -2 to the number of samples, and more up to a multiple of 64.
  std::uint16_t* row(std::int64_t y) {
    return labels_.data() + static_cast<std::size_t>(y + 2) * stride_ + 2;
  }
  void copy_row(std::int64_t y, const std::uint16_t* from) {
    std::memcpy(row(y) - 2, from - 2, stride_ * sizeof(std::uint16_t));
  }

 private:
  std::size_t stride_, rows_;
  std::vector<std::uint16_t> labels_;
};

constexpr std::uint32_t limit = 255;

template <class Coder>
class LabelPass {
 public:
  LabelPass(Coder& coder, Index3 size, std::uint32_t count)
      : coder_(coder),
        size_(size),
        count_(count),
        index_bits_(std::bit_width(count - 1)),
        now_(size),
        before_(size) {
    for (std::size_t context = 0; context < expected_.size(); ++context) {
      int agree = 0;
      for (std::size_t i = 0; i < weight.size(); ++i) agree += (context >> i & 1) != 0 ? weight[i] : 0;
      expected_[context] = AdaptiveBit((2 * agree - total) * 40);
    }
  }

  /// Returns false if the decoder has run out of bytes, or if the encoder gives up.
  bool run(std::uint16_t* labels, std::int64_t slices) {
    for (std::int64_t z = 0; z < slices; ++z, std::swap(now_, before_)) {
      before_.copy_row(-1, before_.row(0));
      before_.copy_row(size_.y, before_.row(size_.y - 1));
      now_.copy_row(-1, before_.row(0));
      now_.copy_row(-2, before_.row(0));
      for (std::int64_t y = 0; y < size_.y; ++y, labels += size_.x) {
        if constexpr (Coder::encoding) std::copy_n(labels, size_.x, now_.row(y));
        row(y);
        if constexpr (!Coder::encoding) std::copy_n(now_.row(y), size_.x, labels);
        if (coder_.exhausted()) return false;
      }
    }
    return true;
  }

 private:
  // The neighbours that are compared with the expected label, and how much each says before anything is known.
  static constexpr std::array<int, 12> weight = {4, 4, 4, 2, 2, 2, 2, 2, 2, 1, 1, 1};
  static constexpr int total = 27;

  // Everything is inlined: calls would take longer than what they do.
  __attribute__((flatten)) void row(std::int64_t y) {
    std::uint16_t* const c = now_.row(y);
    const std::uint16_t *const a = now_.row(y - 1), *const aa = now_.row(y - 2), *const b = before_.row(y),
                               *const ba = before_.row(y - 1), *const d = before_.row(y + 1);
    const auto count = static_cast<std::size_t>(size_.x);
    c[-1] = c[-2] = a[0];
    for (std::size_t first = 0; first < count; first += 64) {
      const std::size_t end = std::min(count, first + 64);
      const std::uint64_t calm = calm_voxels(a + first, b + first, d + first);
      std::size_t known = first;
      for (std::size_t x = first; x < end;) {
        const int run = std::min(std::countr_one(calm >> (x - first)), static_cast<int>(end - x));
        if (run > 0 && c[static_cast<std::int64_t>(x) - 1] == a[x]) {
          x += code_run(c + x, a[x], static_cast<std::size_t>(run));
          continue;
        }
        if (const std::size_t eight = x / 8 * 8; x >= known) {
          find_like_above(a + eight, aa + eight, b + eight, ba + eight, d + eight);
          known = eight + 8;
        }
        code_one(c + x, a + x, aa + x, b + x, ba + x, d + x, like_above_[x % 8]);
        ++x;
      }
    }
    // The x before the first one are those of the finished row.
    c[-1] = c[-2] = c[0];
    c[count] = c[count - 1];
  }

  // A run of voxels whose neighbours all have the label `usual`. Returns how many voxels were coded.
  std::size_t code_run(std::uint16_t* c, std::uint16_t usual, std::size_t run) {
    std::size_t same = 0;
    if constexpr (Coder::encoding)
      while (same < run && c[same] == usual) ++same;
    const auto length = static_cast<std::size_t>(std::bit_width(run) - 1);
    if (code_adaptive(coder_, same == run, whole_[length], limit)) {
      if constexpr (!Coder::encoding) std::fill_n(c, run, usual);
      return run;
    }
    same = std::min<std::size_t>(
        coder_.code_raw(static_cast<std::uint32_t>(same), static_cast<int>(std::bit_width(run - 1))),
        run - 1);
    if constexpr (!Coder::encoding) std::fill_n(c, same, usual);
    c[same] = code_index(c[same]);
    return same + 1;
  }

  // Contexts of eight voxels whose expected label is the one above, without what the neighbors in their row
  // add. Bits are in the order of `around`. Each neighbor has a loop, which becomes vector code.
  void find_like_above(const std::uint16_t* a, const std::uint16_t* aa, const std::uint16_t* b,
                       const std::uint16_t* ba, const std::uint16_t* d) {
    std::array<std::uint16_t, 8> usual, like;
    std::memcpy(usual.data(), a, sizeof usual);
    like.fill(1 << 1 | 1 << 2);
    const auto compare = [&](const std::uint16_t* neighbors, int bit) {
      std::array<std::uint16_t, 8> n;
      std::memcpy(n.data(), neighbors, sizeof n);
      for (std::size_t x = 0; x < like.size(); ++x)
        like[x] |= n[x] == usual[x] ? static_cast<std::uint16_t>(1 << bit) : std::uint16_t{0};
    };
    compare(a + 1, 3);
    compare(b + 1, 4);
    compare(d, 5);
    compare(a - 1, 6);
    compare(b - 1, 7);
    compare(ba, 8);
    compare(d + 1, 9);
    compare(aa, 11);
    like_above_ = like;
  }

  void code_one(std::uint16_t* c, const std::uint16_t* a, const std::uint16_t* aa, const std::uint16_t* b,
                const std::uint16_t* ba, const std::uint16_t* d, std::size_t like_above) {
    const std::uint16_t left = c[-1], above = a[0], behind = b[0];
    const std::uint16_t e = above == behind ? above : left;
    const std::array<std::uint16_t, 12> around = {left,  above, behind, a[1], b[1],  d[0],
                                                  a[-1], b[-1], ba[0],  d[1], c[-2], aa[0]};
    std::size_t context = like_above | std::size_t{left == e} | std::size_t{c[-2] == e} << 10;
    if (above != behind) {
      context = 0;
      for (std::size_t i = 0; i < around.size(); ++i) context |= std::size_t{around[i] == e} << i;
    }
    if (code_adaptive(coder_, c[0] == e, expected_[context], limit)) {
      c[0] = e;
      return;
    }
    if (count_ == 2) {
      c[0] = static_cast<std::uint16_t>(1 - std::min<std::uint16_t>(e, 1));
      return;
    }
    std::uint16_t other = e, third = e;
    for (const std::uint16_t n : {left, behind, above, a[1], b[1], d[0], d[1]}) {
      if (n == e || n == other) continue;
      if (other != e) {
        third = n;
        break;
      }
      other = n;
    }
    if (other != e) {
      std::size_t like = 0;
      for (std::size_t i = 0; i < 6; ++i) like |= std::size_t{around[i] == other} << i;
      if (code_adaptive(coder_, c[0] == other, other_[like], limit)) {
        c[0] = other;
        return;
      }
    }
    if (third != e && code_adaptive(coder_, c[0] == third, third_, limit)) {
      c[0] = third;
      return;
    }
    c[0] = code_index(c[0]);
  }

  std::uint16_t code_index(std::uint16_t label) {
    const int upper = std::min(index_bits_, 8), lower = index_bits_ - upper;
    std::uint32_t node = 1;
    for (int bit = upper - 1; bit >= 0; --bit)
      node = 2 * node + code_adaptive(coder_, (label >> (lower + bit) & 1) != 0, index_[node], limit);
    const std::uint32_t high = node - (1u << upper);
    const std::uint32_t low = coder_.code_raw(label & ((1u << lower) - 1), lower);
    return static_cast<std::uint16_t>(std::min(high << lower | low, count_ - 1));
  }

  Coder& coder_;
  Index3 size_;
  std::uint32_t count_;
  int index_bits_;
  LabelSlice now_, before_;
  std::array<std::uint16_t, 8> like_above_{};
  std::array<AdaptiveBit, 4096> expected_{};
  std::array<AdaptiveBit, 64> other_{};
  std::array<AdaptiveBit, 7> whole_{};
  std::array<AdaptiveBit, 256> index_{};
  AdaptiveBit third_;
};

std::uint64_t most_events(Index3 size) { return static_cast<std::uint64_t>(size.x * size.y * size.z) + 4096; }

std::uint64_t working_bytes_of_pass(Index3 size) {
  const auto slice = static_cast<std::uint64_t>(((size.x + 63) / 64 * 64 + 4) * (size.y + 3));
  return 2 * slice * sizeof(std::uint16_t) + sizeof(LabelPass<RansDecoder>);
}

}  // namespace

bool append_labels(std::span<const std::uint16_t> labels, Index3 size, std::uint32_t count,
                   std::vector<std::uint8_t>& out) {
  LimitedEncoder coder(out, most_events(size));
  const auto pass = std::make_unique<LabelPass<LimitedEncoder>>(coder, size, count);
  // The encoder only reads them.
  if (!pass->run(const_cast<std::uint16_t*>(labels.data()), size.z)) return false;
  coder.finish();
  return true;
}

Status decode_labels(std::span<const std::uint8_t> bytes, Index3 size, std::uint32_t count,
                     std::span<std::uint16_t> labels) {
  RansDecoder coder(bytes);
  const auto pass = std::make_unique<LabelPass<RansDecoder>>(coder, size, count);
  const std::int64_t slices = static_cast<std::int64_t>(labels.size()) / (size.x * size.y);
  if (!pass->run(labels.data(), slices)) return Status::broken("values end too soon");
  if (slices == size.z && !coder.finished()) return Status::broken("values are followed by other bytes");
  return {};
}

std::uint64_t working_bytes_of_encoding_labels(Index3 size) {
  // The last row may exceed the limit.
  const std::uint64_t events = most_events(size) + 14 * static_cast<std::uint64_t>(size.x);
  return working_bytes_of_pass(size) + RansEncoder::working_bytes(events);
}
std::uint64_t working_bytes_of_decoding_labels(Index3 size) { return working_bytes_of_pass(size); }

}  // namespace tagrid
