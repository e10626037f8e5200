#include "pipeline/raw/likelier_reading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/file_bytes.h"
#include "io/formats/nrrd/header.h"

namespace tagrid {
namespace {

constexpr std::int64_t stretch_count = 32, stretch_length = 256;
// Distant slices differ more than neighboring rows; the right order must not be suspected because of that.
constexpr double much_smoother = 2;
constexpr std::int64_t least_size = 4;

std::vector<double> read_samples(FileBytes& file, const RawDescription& raw, std::int64_t first,
                                 std::int64_t count) {
  const std::size_t size = size_of(raw.type);
  std::vector<std::byte> bytes(static_cast<std::size_t>(count) * size);
  file.seek(raw.offset + static_cast<std::uint64_t>(first) * size);
  file.read(bytes.data(), bytes.size());
  swap_if_not_native(bytes.data(), static_cast<std::size_t>(count), size, raw.big_endian.value_or(false));
  std::vector<double> values;
  with_sample_type(raw.type, [&](auto type) {
    const auto* samples = reinterpret_cast<const decltype(type)*>(bytes.data());
    values.assign(samples, samples + count);
  });
  return values;
}

/// The mean difference between samples that are dims.x (neighbors along y) and dims.x * dims.y apart.
double roughness(FileBytes& file, const RawDescription& raw, const Index3& dims, std::int64_t total) {
  double sum = 0, count = 0;
  for (const std::int64_t apart : {dims.x, dims.x * dims.y}) {
    const std::int64_t length = std::min(stretch_length, total - apart);
    for (std::int64_t i = 0; i < stretch_count; ++i) {
      const auto part = (static_cast<double>(i) + 0.5) / static_cast<double>(stretch_count);
      const auto first = static_cast<std::int64_t>(part * static_cast<double>(total - apart - length));
      const std::vector<double> here = read_samples(file, raw, first, length),
                                there = read_samples(file, raw, first + apart, length);
      for (std::size_t k = 0; k < here.size(); ++k) {
        const double difference = std::abs(here[k] - there[k]);
        if (!std::isfinite(difference)) continue;
        sum += difference;
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

bool fits(FileBytes& file, const RawDescription& raw) {
  const auto bytes = sample_bytes(raw.dims, raw.type);
  if (!bytes || !file.size() || *file.size() < raw.offset || *file.size() - raw.offset != *bytes)
    return false;
  return raw.offset > 0 || !begins_nrrd(file.peek(9));
}

std::optional<Index3> likelier_dims(const std::string& path, const RawDescription& raw) {
  std::array<std::int64_t, 3> sizes = {raw.dims.x, raw.dims.y, raw.dims.z};
  std::sort(sizes.begin(), sizes.end());
  if (path == "-" || sizes[0] < least_size || sizes[0] == sizes[2]) return std::nullopt;
  FileBytes file(path);
  if (!fits(file, raw)) return std::nullopt;
  const std::int64_t total = raw.dims.x * raw.dims.y * raw.dims.z;
  const double given = roughness(file, raw, raw.dims, total);
  std::optional<Index3> likelier;
  double least = given / much_smoother;
  do {
    const Index3 other = {sizes[0], sizes[1], sizes[2]};
    if (const double r = roughness(file, raw, other, total); r < least) {
      least = r;
      likelier = other;
    }
  } while (std::next_permutation(sizes.begin(), sizes.end()));
  return likelier;
}

namespace {

constexpr std::uint64_t most_stretches = 64, stretch_bytes = 4096, least_stretches = 4;
// Clean data are as smooth as any wrong reading, or smoother; a false alarm would need far more.
constexpr double far_better = 2;
// If fewer neighbors differ, a few jumps would decide everything.
constexpr double least_changes = 0.01;

using Stretch = std::vector<double>;
using Bytes = std::vector<std::byte>;

/// How the bits of a sample are compared. Readings are only compared with each other in the same order: two
/// peaks on both sides of zero lie far apart in one order, and next to each other in another.
enum class Order { without_sign, with_sign, floats };

/// The rank of a number among all with as many bits: huge numbers, common in wrong floats, count little.
template <class Bits>
double place_of(Bits bits, Order order) {
  const auto number = static_cast<std::make_signed_t<Bits>>(bits);
  if (order == Order::without_sign) return static_cast<double>(bits);
  if (order == Order::with_sign || number >= 0) return static_cast<double>(number);
  return -static_cast<double>(number & std::numeric_limits<std::make_signed_t<Bits>>::max());
}

template <class T>
std::vector<T> samples_of(Bytes bytes, bool big_endian) {
  std::vector<T> samples(bytes.size() / sizeof(T));
  swap_if_not_native(bytes.data(), samples.size(), sizeof(T), big_endian);
  std::memcpy(samples.data(), bytes.data(), bytes.size());
  return samples;
}

/// Stretches of a file, in any reading.
class Sample {
 public:
  Sample(FileBytes& file, const RawDescription& raw) {
    const std::uint64_t total = *sample_bytes(raw.dims, raw.type);
    const std::uint64_t count = std::min(most_stretches, total / stretch_bytes);
    for (std::uint64_t i = 0; i < count; ++i) {
      Bytes bytes(stretch_bytes);
      // Somewhere in the i-th of equal parts, by multiples of nearly the golden ratio: at equal distances, all could lie
      // in the same corner of slices.
      const std::uint64_t part = (total - stretch_bytes) / count;
      const std::uint64_t place = part * i + part / 256 * (159 * i % 256);
      // Samples of every size begin at a multiple of 8 bytes.
      file.seek(raw.offset + place / 8 * 8);
      if (file.read(bytes.data(), bytes.size()) == bytes.size()) stretches_.push_back(std::move(bytes));
    }
  }

  bool is_enough() const { return stretches_.size() >= least_stretches; }

  std::vector<Stretch> read(std::size_t size, bool big_endian, Order order) const {
    if (size == 1) return read_as<std::uint8_t>(big_endian, order);
    if (size == 2) return read_as<std::uint16_t>(big_endian, order);
    return size == 4 ? read_as<std::uint32_t>(big_endian, order) : read_as<std::uint64_t>(big_endian, order);
  }

  template <class T, class Take>
  void for_each(bool big_endian, Take take) const {
    for (const Bytes& bytes : stretches_)
      for (const T v : samples_of<T>(bytes, big_endian)) take(v);
  }

 private:
  template <class BitsOfSample>
  std::vector<Stretch> read_as(bool big_endian, Order order) const {
    std::vector<Stretch> read;
    for (const Bytes& bytes : stretches_) {
      Stretch places;
      for (const BitsOfSample bits : samples_of<BitsOfSample>(bytes, big_endian))
        places.push_back(place_of(bits, order));
      read.push_back(std::move(places));
    }
    return read;
  }

  std::vector<Bytes> stretches_;
};

/// The mean difference between samples that are `apart` positions apart.
double near_difference(const std::vector<Stretch>& stretches, std::size_t apart) {
  double sum = 0, count = 0;
  for (const Stretch& s : stretches)
    for (std::size_t i = apart; i < s.size(); ++i, ++count) sum += std::abs(s[i] - s[i - apart]);
  return sum / count;
}

/// The mean difference between unrelated samples.
double far_difference(const std::vector<Stretch>& stretches) {
  double sum = 0, count = 0;
  for (std::size_t a = 0; a < stretches.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      for (std::size_t i = (a + b) % 16; i < stretches[a].size(); i += 16, ++count)
        sum += std::abs(stretches[a][i] - stretches[b][i]);
  return sum / count;
}

/// 0: constant; about 1: noise.
double roughness(const std::vector<Stretch>& stretches) {
  const double far = far_difference(stretches);
  return far > 0 ? near_difference(stretches, 1) / far : 1;
}

double part_that_changes(const std::vector<Stretch>& stretches) {
  double changes = 0, count = 0;
  for (const Stretch& s : stretches)
    for (std::size_t i = 1; i < s.size(); ++i, ++count) changes += s[i] != s[i - 1];
  return changes / count;
}

constexpr std::size_t sizes[] = {1, 2, 4, 8};

std::vector<Order> orders_of(SampleType type) {
  return is_float_type(type) ? std::vector{Order::floats}
                             : std::vector{Order::without_sign, Order::with_sign};
}

/// Searches readings with samples of the same size or larger: wrong ones look like noise.
std::optional<LikelierReading> smoother_reading(const Sample& sample, const RawDescription& raw) {
  const bool given = raw.big_endian.value_or(false);
  std::optional<LikelierReading> best;
  double most = far_better;
  for (const Order order : orders_of(raw.type)) {
    const double rough = roughness(sample.read(size_of(raw.type), given, order));
    for (const std::size_t size : sizes)
      for (const bool big_endian : {given, !given}) {
        if (size < size_of(raw.type)) continue;
        const double other = roughness(sample.read(size, big_endian, order));
        // Pairs of the right samples are smooth, too.
        if (rough <= (best && size > best->sample_bytes ? 1.25 : 1) * most * other) continue;
        most = rough / other;
        best = {size, raw.type, big_endian};
      }
  }
  return best;
}

/// Detects smaller samples read as larger ones: smooth, too, but as if no sample ended between the parts.
std::optional<LikelierReading> smaller_samples(const Sample& sample, const RawDescription& raw) {
  for (const std::size_t size : sizes)
    for (const bool big_endian : {false, true})
      for (const Order order : {Order::without_sign, Order::with_sign}) {
        if (size >= size_of(raw.type)) continue;
        const std::size_t parts = size_of(raw.type) / size;
        const std::vector<Stretch> stretches = sample.read(size, big_endian, order);
        double within = 0, across = 0;
        for (const Stretch& s : stretches)
          for (std::size_t i = parts; i < s.size(); i += parts) {
            within += std::abs(s[i - 1] - s[i - 2]);
            across += std::abs(s[i] - s[i - 1]);
          }
        const bool alike = within > across / 1.25 && across > within / 1.25;
        if (alike && roughness(stretches) < 1 / far_better &&
            near_difference(stretches, 1) < near_difference(stretches, 2) &&
            part_that_changes(stretches) >= least_changes)
          return LikelierReading{size, raw.type, big_endian};
      }
  return std::nullopt;
}

/// Detects 16-bit samples in the wrong byte order that are small once they are swapped. Smoothness cannot show
/// this. If every sample were a multiple of 256, the given order could be right, so some must not be.
std::optional<LikelierReading> small_if_swapped(const Sample& sample, const RawDescription& raw) {
  if (size_of(raw.type) != 2) return std::nullopt;
  const bool given = raw.big_endian.value_or(false);
  double count = 0, small = 0, mixed = 0, large = 0;
  sample.for_each<std::int16_t>(given, [&](std::int16_t v) {
    const auto low = static_cast<std::int8_t>(v & 255);
    ++count;
    small += low >= -32 && low < 32;
    mixed += low != 0 && low != -1;
    large += v < -8192 || v >= 8192;
  });
  if (small < count || mixed < least_changes * count || large < least_changes * count) return std::nullopt;
  return LikelierReading{2, raw.type, !given};
}

std::optional<SampleType> with_other_sign(SampleType type) {
  constexpr std::pair<SampleType, SampleType> pairs[] = {{SampleType::uint8, SampleType::int8},
                                                         {SampleType::uint16, SampleType::int16},
                                                         {SampleType::uint32, SampleType::int32}};
  for (const auto& [without, with] : pairs)
    if (type == without || type == with) return type == with ? without : with;
  return std::nullopt;
}

/// Neighbors that are far apart in one reading, at its two ends, and close in the other one.
struct Wraps {
  double count = 0;
  std::set<double> low, high;  ///< their values in the first reading, of which a few are enough
};

Wraps wraps_of(const std::vector<Stretch>& first, const std::vector<Stretch>& second, double span) {
  constexpr std::size_t enough = 64;
  Wraps wraps;
  for (std::size_t s = 0; s < first.size(); ++s)
    for (std::size_t i = 1; i < first[s].size(); ++i) {
      const double a = first[s][i - 1], b = first[s][i];
      if (std::abs(b - a) <= span / 2 || std::abs(second[s][i] - second[s][i - 1]) >= span / 64) continue;
      ++wraps.count;
      if (wraps.low.size() < enough) wraps.low.insert(std::min(a, b));
      if (wraps.high.size() < enough) wraps.high.insert(std::max(a, b));
    }
  return wraps;
}

/// Detects integers whose sign was read wrongly. Values then wrap around: neighbors lie at both ends of the
/// type. So do black and white of a mask or a clipped picture, but always as the same two numbers; and in a
/// picture that fills its type, edges are fewer and larger than the noise around 0 that makes values wrap.
std::optional<LikelierReading> other_sign(const Sample& sample, const RawDescription& raw) {
  const auto other = with_other_sign(raw.type);
  if (!other) return std::nullopt;
  constexpr double least_part = 0.0005, least_count = 64;
  constexpr std::size_t least_values = 8;
  // This ratio is at least 46 in CT with noise around 0. It is 9 in pictures of two parts in which every fifth
  // sample is an edge.
  constexpr double far_smoother = 20;
  const bool big = raw.big_endian.value_or(false);
  const std::size_t size = size_of(raw.type);
  const bool has_sign = raw.type > *other;
  const std::vector<Stretch> given =
                                 sample.read(size, big, has_sign ? Order::with_sign : Order::without_sign),
                             likelier =
                                 sample.read(size, big, has_sign ? Order::without_sign : Order::with_sign);
  const double span = std::exp2(8 * static_cast<double>(size));
  const Wraps wraps = wraps_of(given, likelier, span), reverse = wraps_of(likelier, given, span);
  double neighbors = 0;
  for (const Stretch& s : given) neighbors += static_cast<double>(s.size() - 1);
  const bool is_suspect = wraps.count >= std::max(least_count, least_part * neighbors) &&
                          wraps.count > 10 * reverse.count && wraps.low.size() >= least_values &&
                          wraps.high.size() >= least_values &&
                          near_difference(given, 1) > far_smoother * near_difference(likelier, 1);
  if (!is_suspect) return std::nullopt;
  return LikelierReading{size, *other, big};
}

/// True if nearly all samples other than 0 are smaller than measured values: small integers look like this.
template <class T>
bool is_tiny(const Sample& sample, bool big_endian) {
  double tiny = 0, count = 0;
  sample.for_each<T>(big_endian, [&](T v) {
    if (v == 0 || std::isnan(v)) return;
    ++count;
    tiny += std::fpclassify(v) == FP_SUBNORMAL;
  });
  return count >= 64 && tiny > 0.9 * count;
}

/// True if nearly all samples but 0 are floats of plausible and different sizes: as integers, 9e8 to 1.3e9.
bool looks_like_floats(const Sample& sample, bool big_endian) {
  double usual = 0, count = 0;
  std::vector<double> of_exponent(41);
  sample.for_each<float>(big_endian, [&](float v) {
    if (v == 0) return;
    ++count;
    const int exponent = std::isfinite(v) ? std::ilogb(v) : 999;
    if (std::abs(exponent) > 20) return;
    ++usual;
    ++of_exponent[static_cast<std::size_t>(exponent + 20)];
  });
  return count >= 64 && usual > 0.95 * count &&
         std::ranges::count_if(of_exponent, [&](double n) { return n > 0.01 * count; }) >= 5;
}

/// Detects integers that were taken for floats, and floats that were taken for integers.
std::optional<LikelierReading> other_class(const Sample& sample, const RawDescription& raw) {
  const bool big = raw.big_endian.value_or(false);
  if (raw.type == SampleType::float64) {
    if (is_tiny<double>(sample, big) && !is_tiny<double>(sample, !big))
      return LikelierReading{8, SampleType::float64, !big};
  } else if (raw.type == SampleType::float32) {
    if (!is_tiny<float>(sample, big)) return std::nullopt;
    if (looks_like_floats(sample, !big)) return LikelierReading{4, SampleType::float32, !big};
    return LikelierReading{4, SampleType::int32, big};
  } else if (size_of(raw.type) == 4) {
    for (const bool other : {big, !big})
      if (looks_like_floats(sample, other)) return LikelierReading{4, SampleType::float32, other};
  }
  return std::nullopt;
}

}  // namespace

std::optional<LikelierReading> likelier_reading(const std::string& path, const RawDescription& raw) {
  if (path == "-") return std::nullopt;
  FileBytes file(path);
  if (!fits(file, raw)) return std::nullopt;
  const Sample sample(file, raw);
  if (!sample.is_enough()) return std::nullopt;
  const Order any = orders_of(raw.type).front();
  if (part_that_changes(sample.read(size_of(raw.type), false, any)) < least_changes) return std::nullopt;
  if (const auto other = other_class(sample, raw)) return other;
  if (const auto smoother = smoother_reading(sample, raw)) return smoother;
  if (const auto swapped = small_if_swapped(sample, raw)) return swapped;
  // Of two samples of 16 bits, the second gives the sign of both together.
  if (const auto smaller = smaller_samples(sample, raw)) return smaller;
  return other_sign(sample, raw);
}

}  // namespace tagrid
