#include "stages/values/few/table.h"

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <type_traits>

#include "stages/entropy/adaptive_bit.h"
#include "stages/entropy/rans_coder.h"
#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

/// Codes numbers below 2^64: how many binary digits there are, the digit after the first one, and the others
/// as they are.
class GapModel {
 public:
  template <class Coder>
  std::uint64_t code(Coder& coder, std::uint64_t value) {
    const auto digits = static_cast<std::uint32_t>(std::bit_width(value));
    std::uint32_t node = 1;
    for (int bit = 6; bit >= 0; --bit)
      node = 2 * node + code_adaptive(coder, (digits >> bit & 1) != 0, length_[node], 60);
    // Only a broken stream has more than 64 digits.
    int left = static_cast<int>(std::min<std::uint32_t>(node - 128, 64));
    if (left == 0) return 0;
    std::uint64_t result = 1;
    if (--left > 0) {
      --left;
      result = 2 | std::uint64_t{code_adaptive(coder, (value >> left & 1) != 0,
                                               second_[static_cast<std::size_t>(left)], 60)};
    }
    while (left > 0) {
      const int bits = std::min(left, 16);
      left -= bits;
      result = result << bits |
               coder.code_raw(static_cast<std::uint32_t>(value >> left & ((1u << bits) - 1)), bits);
    }
    return result;
  }

 private:
  std::array<AdaptiveBit, 128> length_{};
  std::array<AdaptiveBit, 63> second_{};
};

constexpr std::uint64_t folded(std::int64_t v) {
  return v < 0 ? 2 * static_cast<std::uint64_t>(-(v + 1)) + 1 : 2 * static_cast<std::uint64_t>(v);
}
constexpr std::int64_t unfolded(std::uint64_t f) {
  return f & 1 ? -static_cast<std::int64_t>(f / 2) - 1 : static_cast<std::int64_t>(f / 2);
}

/// Floats that are origin + step * k, nearly. No progression: step is 0.
struct Progression {
  double origin = 0, step = 0;
};
constexpr std::uint64_t most_steps = std::uint64_t{1} << 53;

/// The key of an entry of the progression: the product, the sum and the result are each rounded once.
template <class T>
std::int64_t key_at(const Progression& p, std::uint64_t k) {
  const double product = p.step * static_cast<double>(k);
  const double sum = p.origin + product;
  return key_of(static_cast<T>(sum));
}

/// Steps from one entry to the next.
std::uint64_t steps_between(double from, double to, double step) {
  const double steps = std::floor((to - from) / step + 0.5);
  return steps < 0x1p53 ? static_cast<std::uint64_t>(steps) : most_steps;
}

/// The progression that the finite values suggest: its step is the smallest distance, made more exact by the
/// largest one.
template <class T>
Progression progression_of(std::span<const T> values) {
  std::size_t first = 0, last = values.size();
  while (first < last && !is_finite(values[first])) ++first;
  while (first < last && !is_finite(values[last - 1])) --last;
  if (last - first < 3) return {};
  const auto at = [&](std::size_t i) { return static_cast<double>(values[i]); };
  Progression p{at(first), std::numeric_limits<double>::infinity()};
  for (std::size_t i = first + 1; i < last; ++i)
    if (at(i) > at(i - 1)) p.step = std::min(p.step, at(i) - at(i - 1));
  for (int refine = 0; refine < 2; ++refine) {
    if (!(p.step > 0) || !std::isfinite(p.step)) return {};
    std::uint64_t k = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      k += steps_between(at(i - 1), at(i), p.step);
      if (k >= most_steps) return {};
    }
    if (k == 0) return {};
    p.step = (at(last - 1) - p.origin) / static_cast<double>(k);
  }
  return std::isfinite(p.step) && p.step > 0 ? p : Progression{};
}

/// One entry of a table of floats.
struct Entry {
  bool alone = true;        ///< not of the progression: the distance of its key to the one before is stored
  std::uint64_t steps = 0;  ///< of the progression
  std::int64_t missed = 0;  ///< of the key, by the progression
};

template <class T>
Entry entry_of(const Progression& p, std::int64_t key, T value, std::uint64_t k) {
  if (p.step == 0 || !is_finite(value)) return {};
  const double distance = (static_cast<double>(value) - p.origin) / p.step;
  if (!(distance < 0x1p53)) return {};
  const auto nearest = static_cast<std::uint64_t>(std::max(0.0, std::floor(distance + 0.5)));
  if (nearest < k) return {};
  const Int128 missed = Int128{key} - key_at<T>(p, nearest);
  if (missed < -(1 << 20) || missed > 1 << 20) return {};
  return {false, nearest - k, static_cast<std::int64_t>(missed)};
}

/// About how many bits the entries take.
template <class T>
std::uint64_t bits_of_entries(std::span<const T> values, const Progression& p) {
  std::uint64_t bits = 0, k = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int64_t key = key_of(values[i]);
    const Entry e = entry_of(p, key, values[i], k);
    const std::uint64_t gap =
        i == 0 ? 0 : static_cast<std::uint64_t>(key) - static_cast<std::uint64_t>(key_of(values[i - 1])) - 1;
    bits += static_cast<std::uint64_t>(e.alone ? 4 + std::bit_width(gap)
                                               : std::bit_width(e.steps) + std::bit_width(folded(e.missed)));
    k += e.steps;
  }
  return bits;
}

/// The type of which keys have all values.
template <class T>
using KeyRange =
    std::numeric_limits<std::conditional_t<std::is_integral_v<T>, T, std::make_signed_t<BitsOf<T>>>>;

/// Codes the entries in both directions. `step`: of integers. Returns false if the keys do not ascend, or are
/// not those of the type.
template <class T, class Coder>
bool code_entries(Coder& coder, const Progression& p, std::uint64_t step, std::size_t count,
                  [[maybe_unused]] std::span<const T> values, [[maybe_unused]] std::vector<T>& decoded) {
  GapModel gaps, steps, misses;
  AdaptiveBit alone;
  std::uint64_t k = 0;
  Int128 key = std::int64_t{KeyRange<T>::min()};
  for (std::size_t i = 0; i < count; ++i) {
    const Int128 before = i == 0 ? key - 1 : key;
    Entry e;
    T value{};
    std::int64_t own = 0;
    if constexpr (Coder::encoding) {
      value = values[i];
      own = key_of(value);
      if constexpr (std::is_floating_point_v<T>) e = entry_of(p, own, value, k);
    }
    if (p.step != 0) e.alone = code_adaptive(coder, e.alone, alone, 250);
    if (e.alone) {
      // The distance of the first entry says nothing of the others.
      GapModel once;
      const std::uint64_t unit = i == 0 ? 1 : step;
      const std::uint64_t gap =
          (i == 0 ? once : gaps)
              .code(coder, Coder::encoding ? static_cast<std::uint64_t>(own - before - 1) / unit : 0);
      key = before + (i == 0 ? Int128{1} : Int128{unit}) + Int128{gap} * unit;
    } else {
      e.steps = steps.code(coder, e.steps);
      if (e.steps > most_steps || k + e.steps > most_steps) return false;
      k += e.steps;
      e.missed = unfolded(misses.code(coder, folded(e.missed)));
      if constexpr (std::is_floating_point_v<T>) key = Int128{key_at<T>(p, k)} + e.missed;
    }
    if (key <= before || key > KeyRange<T>::max()) return false;
    if constexpr (!Coder::encoding) {
      if (coder.exhausted()) return false;
      decoded.push_back(from_key<T>(static_cast<std::int64_t>(key)));
    }
  }
  return true;
}

template <class T>
std::uint64_t common_step(std::span<const T> values) {
  std::uint64_t step = 0;
  for (std::size_t i = 1; i < values.size() && step != 1; ++i)
    step = std::gcd(step, static_cast<std::uint64_t>(key_of(values[i]) - key_of(values[i - 1])));
  return step;
}

std::optional<std::uint64_t> take_number(std::span<const std::uint8_t>& bytes, std::size_t count) {
  if (bytes.size() < count) return {};
  const std::uint64_t number = number_in(bytes.first(count));
  bytes = bytes.subspan(count);
  return number;
}

}  // namespace

template <class T>
void append_table(std::span<const T> values, std::vector<std::uint8_t>& out) {
  append_bytes(values.size() - 1, 2, out);
  Progression p;
  std::uint64_t step = 1;
  if constexpr (std::is_floating_point_v<T>) {
    p = progression_of(values);
    if (p.step != 0 && bits_of_entries(values, p) + 64 >= bits_of_entries(values, {})) p = {};
    append_bytes(std::bit_cast<std::uint64_t>(p.step), 8, out);
    if (p.step != 0) append_bytes(std::bit_cast<std::uint64_t>(p.origin), 8, out);
  } else {
    step = common_step(values);
    append_bytes(step, 4, out);
  }
  std::vector<std::uint8_t> stream;
  RansEncoder coder(stream);
  std::vector<T> none;
  code_entries<T>(coder, p, step, values.size(), values, none);
  coder.finish();
  append_bytes(stream.size(), 4, out);
  out.insert(out.end(), stream.begin(), stream.end());
}

template <class T>
Status take_table(std::span<const std::uint8_t>& bytes, std::size_t samples, std::vector<T>& values) {
  const Status too_short = Status::broken("values end too soon"),
               impossible = Status::broken("values with an impossible table");
  const auto count = take_number(bytes, 2);
  if (!count) return too_short;
  if (*count < 1 || *count >= most_entries(samples)) return impossible;
  Progression p;
  std::uint64_t step = 1;
  if constexpr (std::is_floating_point_v<T>) {
    const auto bits = take_number(bytes, 8);
    if (!bits) return too_short;
    p.step = std::bit_cast<double>(*bits);
    if (!std::isfinite(p.step) || std::signbit(p.step)) return impossible;
    if (p.step != 0) {
      const auto origin = take_number(bytes, 8);
      if (!origin) return too_short;
      p.origin = std::bit_cast<double>(*origin);
      if (!std::isfinite(p.origin)) return impossible;
    }
  } else {
    const auto common = take_number(bytes, 4);
    if (!common) return too_short;
    step = *common;
    if (step == 0) return impossible;
  }
  const auto size = take_number(bytes, 4);
  if (!size || *size > bytes.size()) return too_short;
  RansDecoder coder(bytes.first(*size));
  bytes = bytes.subspan(*size);
  values.clear();
  // Exactly: a quarter of the samples at most.
  values.reserve(*count + 1);
  if (!code_entries<T>(coder, p, step, *count + 1, {}, values) || !coder.finished()) return impossible;
  return {};
}

std::uint64_t working_bytes_of_encoding_table(std::size_t entries, std::size_t bytes) {
  // A flag, and two numbers of eight events and some of 16 bits; the distance of an integer is one number.
  const std::uint64_t events = bytes <= 2 ? 10 : 27;
  return RansEncoder::working_bytes(entries * events + 16) + entries * 2 * bytes + 1024;
}

#define TAGRID_INSTANTIATE(T)                                                 \
  template void append_table(std::span<const T>, std::vector<std::uint8_t>&); \
  template Status take_table(std::span<const std::uint8_t>&, std::size_t, std::vector<T>&);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
